//! Finds a picture's image in a COCO file.

use serde_json::Value;

use crate::annotation::ImageFacts;
use crate::file_name::{NameLikeness, base_name, common_parts};
use crate::json::{Node, shorten};
use crate::{Error, Result};

/// The image with the photo's name; of several, the one whose folders match best. A single image may have any name,
/// because people rename files.
pub(crate) fn choose_image<'a>(images: &[Node<'a>], image: &ImageFacts) -> Result<Node<'a>> {
    if let [only] = images {
        return Ok(only.clone());
    }
    let (mut names, mut named) = (Vec::new(), Vec::new());
    for node in images {
        let name = node.field("file_name", "the image's name")?.text()?;
        named.push((node, name));
        names.push(shorten(base_name(name)));
    }
    let mut fitting: Vec<(usize, &Node<'a>, &str)> = Vec::new();
    for likeness in NameLikeness::ALL {
        let wanted = image.file_name.into_iter();
        fitting = wanted
            .flat_map(|wanted| named.iter().map(move |(node, name)| (wanted, *node, *name)))
            .filter(|(wanted, _, name)| likeness.holds(wanted, name))
            .map(|(wanted, node, name)| (common_parts(wanted, name), node, name))
            .collect();
        if !fitting.is_empty() {
            break;
        }
    }
    if let Some(most) = fitting.iter().map(|(parts, ..)| *parts).max() {
        fitting.retain(|(parts, ..)| *parts == most);
        let [(_, chosen, _)] = fitting[..] else {
            let several: Vec<String> =
                fitting.iter().map(|(_, node, name)| format!("{} `{}`", node.place, shorten(name))).collect();
            return Err(Error::ImageNotFound {
                expected: "one image of that name and folder".into(),
                found: several.join(" and "),
            });
        };
        let id = chosen.field("id", "the image's number")?.value;
        if let Some(other) = images
            .iter()
            .find(|other| other.place != chosen.place && other.value.get("id").is_some_and(|own| is_same_id(own, id)))
        {
            return Err(Error::Malformed {
                place: format!("{}.id", chosen.place),
                expected: "a unique number".into(),
                found: format!("{id}, as {} has", other.place),
            });
        }
        return Ok(chosen.clone());
    }
    const SHOWN: usize = 6;
    let count = names.len();
    names.truncate(SHOWN);
    Err(Error::ImageNotFound {
        expected: match image.file_name {
            Some(name) => format!("an image named `{}`", base_name(name)),
            None => "a single image, or the name of one".into(),
        },
        found: if count == 0 { "no image".into() } else { format!("{count} images: {}", names.join(", ")) },
    })
}

/// Whether two ids are equal as text or as numbers: some programs write a number as 1.0 or as text.
pub(crate) fn is_same_id(one: &Value, other: &Value) -> bool {
    let number = |id: &Value| id.as_f64().or_else(|| id.as_str()?.trim().parse().ok());
    one == other || number(one).is_some_and(|one| Some(one) == number(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Annotation, CocoFile};
    use nalgebra::Point2;
    use sdg_geometry::{BoundingBox, GraspLine};
    use serde_json::json;

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    fn pendulum() -> Annotation {
        Annotation {
            label: "pendulum".into(),
            bbox: BoundingBox { x1: 100.0, y1: 80.25, x2: 300.5, y2: 260.0 },
            grasp: Some(GraspLine::new(Point2::new(150.5, 120.0), Point2::new(250.0, 220.0))),
            jaw_width: None,
            outline: None,
        }
    }

    fn read_named(value: &Value, file_name: Option<&str>) -> Result<Vec<Annotation>> {
        Annotation::read(&serde_json::to_vec(value).unwrap(), &ImageFacts { file_name, ..IMAGE })
    }

    fn full() -> Value {
        let mut file = CocoFile::new();
        file.push_image("a.png", 640, 480, &[pendulum()]);
        serde_json::from_str(&file.to_json()).unwrap()
    }

    #[test]
    fn one_of_several_images_is_chosen_by_name() {
        let mut file = CocoFile::new();
        let other = Annotation { label: "rod".into(), grasp: None, jaw_width: None, outline: None, ..pendulum() };
        file.push_image("a.png", 640, 480, &[pendulum()]);
        file.push_image("b.png", 640, 480, std::slice::from_ref(&other));
        let value: Value = serde_json::from_str(&file.to_json()).unwrap();
        assert_eq!(read_named(&value, Some("folder/b.png")).unwrap(), [other]);
        let found = read_named(&value, Some("c.png")).unwrap_err().to_string();
        assert!(found.contains("an image named `c.png`") && found.contains("2 images: a.png, b.png"), "{found}");
        assert!(read_named(&value, None).unwrap_err().to_string().contains("a single image"));
        assert!(read_named(&full(), Some("renamed.png")).is_ok(), "the only image needs no name");
    }

    #[test]
    fn of_images_of_one_name_the_folders_choose_or_both_are_named() {
        let other = Annotation { label: "rod".into(), grasp: None, jaw_width: None, outline: None, ..pendulum() };
        let of = |names: [&str; 2]| {
            let mut file = CocoFile::new();
            file.push_image(names[0], 640, 480, &[pendulum()]);
            file.push_image(names[1], 640, 480, std::slice::from_ref(&other));
            serde_json::from_str::<Value>(&file.to_json()).unwrap()
        };
        let value = of(["cam_a/image.jpg", "cam_b/image.jpg"]);
        assert_eq!(read_named(&value, Some("/data/cam_b/image.jpg")).unwrap(), std::slice::from_ref(&other));
        assert_eq!(read_named(&value, Some("C:\\data\\cam_b\\image.jpg")).unwrap(), std::slice::from_ref(&other));
        assert_ne!(read_named(&value, Some("./cam_a/image.jpg")).unwrap(), std::slice::from_ref(&other));
        for (value, wanted) in [(&value, "image.jpg"), (&of(["image.jpg", "image.jpg"]), "cam_b/image.jpg")] {
            let found = read_named(value, Some(wanted)).unwrap_err().to_string();
            assert!(found.contains("images[0]") && found.contains("images[1]"), "{found}");
        }
        let mut twice = of(["other.jpg", "image.jpg"]);
        twice["images"][1]["id"] = json!(1);
        let found = read_named(&twice, Some("image.jpg")).unwrap_err().to_string();
        assert!(found.contains("images[1].id: expected a unique number"), "{found}");
    }

    #[test]
    fn a_name_may_be_escaped_or_of_another_system_or_ending() {
        let other = Annotation { label: "rod".into(), ..pendulum() };
        let mut file = CocoFile::new();
        file.push_image("images/Teil%20eins.JPG", 640, 480, &[pendulum()]);
        file.push_image("images/Teil%20zwei.JPG", 640, 480, std::slice::from_ref(&other));
        let value: Value = serde_json::from_str(&file.to_json()).unwrap();
        for name in ["Teil zwei.JPG", "/x/teil zwei.jpg", "Teil%20zwei.JPG", "Teil zwei.png"] {
            assert_eq!(read_named(&value, Some(name)).unwrap(), std::slice::from_ref(&other), "{name}");
        }
        assert!(read_named(&value, Some("Teil drei.JPG")).is_err());
    }
}
