//! Label files of test pictures: any number of instances per picture, including none.
//!
//! A demonstration marks one part and must have a grasp; a test picture may mark many parts, or none, which means that
//! the part is absent. Boxes, points and outlines are read by the code for demonstrations.

use serde_json::Value;

use crate::draft::Border;
use crate::file_name::base_name;
use crate::format::json_format;
use crate::json::{self, Node, shorten};
use crate::labelled_instance::LabelledInstance;
use crate::{AnnotationFormat, Error, ImageFacts, Result, coco, labelme};

/// A label file, LabelMe or COCO JSON, parsed once for all the pictures that it labels.
///
/// ```
/// use sdg_demonstration::{ImageFacts, LabelFile};
///
/// let coco = br#"{"images": [{"id": 1, "file_name": "empty.png", "width": 64, "height": 48}], "annotations": []}"#;
/// let labels = LabelFile::parse(coco)?;
/// assert_eq!(labels.picture_names()?, ["empty.png"]);
/// let picture = ImageFacts { width: 64, height: 48, file_name: Some("empty.png") };
/// assert!(labels.instances(&picture)?.is_empty());
/// # Ok::<(), sdg_demonstration::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LabelFile {
    format: AnnotationFormat,
    value: Value,
}

impl LabelFile {
    /// Parses the file's bytes.
    ///
    /// # Errors
    /// [`Error::NotJson`] and [`Error::NotFinite`] for text that is not JSON, [`Error::WrongFile`] for other JSON.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let value = json::parse(bytes)?;
        Ok(Self { format: json_format(&value)?, value })
    }

    /// LabelMe or COCO.
    pub fn format(&self) -> AnnotationFormat {
        self.format
    }

    /// The names of the labelled pictures, without folders, in the file's order. LabelMe: at most one.
    ///
    /// # Errors
    /// A name that is not text; COCO without the list of images, an image without a name, or two with the same name.
    pub fn picture_names(&self) -> Result<Vec<String>> {
        let root = Node::root(&self.value);
        let name = |node: &Node| node.text().map(|text| base_name(text).to_owned());
        if self.format == AnnotationFormat::LabelMe {
            return root.optional("imagePath")?.iter().map(name).collect();
        }
        let images = root.field("images", "the list of images")?.items()?;
        let mut names: Vec<String> = Vec::with_capacity(images.len());
        let mut known = std::collections::HashSet::with_capacity(images.len());
        for image in images {
            let node = image.field("file_name", "the image's name")?;
            let name = name(&node)?;
            if !known.insert(name.clone()) {
                return Err(Error::Malformed {
                    place: node.place,
                    expected: "each image once".into(),
                    found: format!("`{}` again", shorten(&name)),
                });
            }
            names.push(name);
        }
        Ok(names)
    }

    /// The marks of one picture, in the file's order; empty if the part is absent.
    ///
    /// # Errors
    /// The errors of [`Annotation::read`], except [`Error::NoObject`] for a picture without marks, and except the
    /// errors of boxes and outlines across the picture's border. A grasp must lie inside.
    pub fn instances(&self, image: &ImageFacts) -> Result<Vec<LabelledInstance>> {
        let root = Node::root(&self.value);
        match self.format {
            AnnotationFormat::LabelMe => labelme::read_instances(&root, image, Border::MayCut),
            _ => coco::read_instances(&root, image, Border::MayCut),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Annotation, CocoFile};
    use nalgebra::Point2;
    use serde_json::json;

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: Some("a.png") };

    fn parse(value: &Value) -> LabelFile {
        LabelFile::parse(&serde_json::to_vec(value).unwrap()).unwrap()
    }

    /// A group of a box and a grasp line, as LabelMe writes them.
    fn group(id: u32, x: f64, optional: bool) -> Vec<Value> {
        let flags = json!({"optional": optional});
        vec![
            json!({"label": "rod", "shape_type": "rectangle", "points": [[x, 10], [x + 40.0, 30]], "group_id": id}),
            json!({"label": "grasp_start", "shape_type": "point", "points": [[x + 5.0, 20]], "group_id": id,
                   "flags": flags}),
            json!({"label": "grasp_end", "shape_type": "point", "points": [[x + 35.0, 20]], "group_id": id}),
        ]
    }

    fn labelme(shapes: Vec<Value>) -> Value {
        json!({"imagePath": "..\\photos\\a.png", "imageWidth": 640, "imageHeight": 480, "shapes": shapes})
    }

    #[test]
    fn labelme_instances_keep_the_file_s_order_and_their_flag() {
        // Eleven groups: as text, "10" would come before "2".
        let shapes = (1..=11).flat_map(|id| group(id, 50.0 * f64::from(id - 1), id == 3)).collect();
        let labels = parse(&labelme(shapes));
        assert_eq!(
            (labels.format(), labels.picture_names().unwrap()),
            (AnnotationFormat::LabelMe, vec!["a.png".into()])
        );
        let instances = labels.instances(&IMAGE).unwrap();
        let lefts: Vec<f64> = instances.iter().map(|instance| instance.annotation.bbox.x1).collect();
        assert_eq!(lefts, (0..11).map(|i| 50.0 * f64::from(i)).collect::<Vec<_>>());
        let optional: Vec<usize> = (0..11).filter(|&i| instances[i].optional).collect();
        assert_eq!((optional, instances[3].place.as_str()), (vec![2], "shapes[9]"));
        let line = instances[2].annotation.grasp.unwrap();
        assert_eq!((line.start, line.end), (Point2::new(105.0, 20.0), Point2::new(135.0, 20.0)));
    }

    #[test]
    fn coco_instances_belong_to_the_picture_named() {
        let marked = parse(&labelme([group(1, 10.0, false), group(2, 100.0, false)].concat()));
        let objects: Vec<Annotation> =
            marked.instances(&IMAGE).unwrap().into_iter().map(|instance| instance.annotation).collect();
        let mut file = CocoFile::new();
        let flagged = [(&objects[0], false), (&objects[1], true)]
            .map(|(annotation, optional)| LabelledInstance::new(annotation.clone(), optional));
        file.push_labelled("a.png", 640, 480, &flagged);
        file.push_image("b.png", 320, 240, &[]);
        let labels = LabelFile::parse(file.to_json().as_bytes()).unwrap();
        assert_eq!(labels.picture_names().unwrap(), ["a.png", "b.png"]);
        let instances = labels.instances(&IMAGE).unwrap();
        assert_eq!(instances.iter().map(|instance| instance.optional).collect::<Vec<_>>(), [false, true]);
        assert_eq!(instances[1].annotation, objects[1]);
        let other = ImageFacts { width: 320, height: 240, file_name: Some("b.png") };
        assert!(labels.instances(&other).unwrap().is_empty());
        let resized = ImageFacts { file_name: Some("b.png"), ..IMAGE };
        assert_eq!(labels.instances(&resized), Err(Error::OtherImageSize { annotated: [320, 240], image: [640, 480] }));
    }

    #[test]
    fn a_picture_without_marks_is_one_without_the_part_but_its_size_is_checked() {
        assert_eq!(parse(&labelme(Vec::new())).instances(&IMAGE), Ok(Vec::new()));
        let other = ImageFacts { width: 64, ..IMAGE };
        assert!(matches!(parse(&labelme(Vec::new())).instances(&other), Err(Error::OtherImageSize { .. })));
        // As a demonstration the same file is refused.
        let text = serde_json::to_vec(&labelme(Vec::new())).unwrap();
        assert!(matches!(Annotation::read(&text, &IMAGE), Err(Error::NoObject { .. })));
    }

    #[test]
    fn the_border_may_cut_a_part_but_not_its_grasp() {
        let mut shapes = group(1, 10.0, false);
        shapes[0]["points"] = json!([[10, -30], [700, 30]]);
        shapes.push(json!({"label": "rod", "shape_type": "polygon", "points": [[10, 10], [700, -30], [60, 30]],
                           "group_id": 1}));
        let value = labelme(shapes);
        let cut = parse(&value).instances(&IMAGE).unwrap().remove(0).annotation;
        assert_eq!((cut.bbox.to_xywh(), cut.outline), ([10.0, 0.0, 630.0, 30.0], None));
        // A demonstration must show the whole part.
        let text = serde_json::to_vec(&value).unwrap();
        assert!(matches!(Annotation::read(&text, &IMAGE), Err(Error::OutsideImage { .. })));

        let mut shapes = group(1, 10.0, false);
        shapes[1]["points"] = json!([[15, -20]]);
        let found = parse(&labelme(shapes)).instances(&IMAGE).unwrap_err().to_string();
        assert!(found.contains("shapes[1]: expected a place inside the image of 640×480 pixels"), "{found}");
        let mut shapes = group(1, 10.0, false);
        shapes[0]["points"] = json!([[650, 10], [700, 30]]);
        let found = parse(&labelme(shapes)).instances(&IMAGE).unwrap_err().to_string();
        assert!(found.contains("shapes[0]: expected a place inside"), "{found}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let message = |value: &Value| parse(value).instances(&IMAGE).unwrap_err().to_string();
        let mut shapes = group(1, 10.0, false);
        shapes[0]["flags"] = json!({"optional": "yes"});
        assert!(message(&labelme(shapes)).contains("shapes[0].flags.optional: expected true or false"));
        let twice = json!({"images": [{"id": 1, "file_name": "x/a.png"}, {"id": 2, "file_name": "a.png"}],
                           "annotations": []});
        let found = parse(&twice).picture_names().unwrap_err().to_string();
        assert!(found.contains("images[1].file_name: expected each image once, found `a.png` again"), "{found}");
        for (text, part) in [("{\"shapes\": [", "not JSON"), ("[{}]", "wrong annotation file"), ("", "empty")] {
            let found = LabelFile::parse(text.as_bytes()).unwrap_err().to_string();
            assert!(found.contains(part), "{found}");
        }
    }
}
