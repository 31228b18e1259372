//! COCO JSON, the canonical annotation. Coordinates are this project's: the centre of the first pixel is (0.5, 0.5).
//!
//! - `bbox`: xywh. `segmentation`: polygons.
//! - `keypoints`: x y v, named `grasp_start` and `grasp_end`.
//! - `attributes`, where CVAT stores values without a COCO field: `jaw_width`, in pixels; `grasp_offset`, the grasp's
//!   centre relative to the box's; `optional`.

use nalgebra::Point2;
use serde_json::{Value, json};

use crate::annotation::{Annotation, ImageFacts};
use crate::coco_image::{choose_image, is_same_id};
use crate::draft::{Border, Draft};
use crate::foreign::is_foreign_annotation;
use crate::json::{Node, describe};
use crate::labelled_instance::{LabelledInstance, is_optional};
use crate::{Error, Result};

/// Reads the objects of one image of a COCO file; the image must have at least one.
pub(crate) fn read(root: &Node, image: &ImageFacts) -> Result<Vec<LabelledInstance>> {
    let instances = read_instances(root, image, Border::MustNotCut)?;
    if instances.is_empty() {
        let id = choose_image(&root.field("images", "the list of images")?.items()?, image)?;
        return Err(Error::NoObject {
            expected: format!("an annotation with `image_id` {}", id.field("id", "the image's number")?.value),
            found: "none".into(),
        });
    }
    Ok(instances)
}

/// Maximum product of the numbers of an image's annotations and of categories, because all categories are searched for
/// each annotation.
const MAX_COMPARISONS: usize = 10_000_000;

/// Reads the objects of one image of a COCO file, if any.
pub(crate) fn read_instances(root: &Node, image: &ImageFacts, border: Border) -> Result<Vec<LabelledInstance>> {
    let images = root.field("images", "the list of images")?.items()?;
    let chosen = choose_image(&images, image)?;
    if let (Some(width), Some(height)) = (chosen.optional("width")?, chosen.optional("height")?) {
        image.check_declared(width.pixels()?, height.pixels()?)?;
    }
    let image_id = chosen.field("id", "the image's number")?;
    let categories = match root.optional("categories")? {
        Some(categories) => categories.items()?,
        None => Vec::new(),
    };

    let mut of_image = Vec::new();
    for annotation in root.field("annotations", "the list of annotations")?.items()? {
        if is_same_id(annotation.field("image_id", "the number of its image")?.value, image_id.value) {
            of_image.push(annotation);
        }
    }
    if of_image.len().saturating_mul(categories.len()) > MAX_COMPARISONS {
        return Err(Error::Malformed {
            place: "annotations and categories".into(),
            expected: format!("at most {MAX_COMPARISONS} pairs of both"),
            found: format!("{} times {}", of_image.len(), categories.len()),
        });
    }
    // If only crowds and masks are marked, they are kept, and reading them gives a specific error.
    if of_image.iter().any(|annotation| !is_foreign_annotation(annotation)) {
        of_image.retain(|annotation| !is_foreign_annotation(annotation));
    }
    // If one annotation has a grasp, keypoints of a category with other keypoint names mark something else.
    let has_grasp = |annotation: &Node| {
        let category = category_of(annotation, &categories).ok().flatten();
        category.is_some_and(|category| is_of_grasps(category)) && has_keypoints(annotation)
    };
    let needs_grasp_names = !of_image.iter().any(has_grasp);
    let instance = |annotation: Node| {
        Ok(LabelledInstance {
            optional: is_optional(annotation.optional("attributes")?.as_ref())?,
            annotation: read_object(&annotation, &categories, needs_grasp_names)?.finish_at(image, border)?,
            place: annotation.place,
        })
    };
    of_image.into_iter().map(instance).collect()
}

/// The category of an annotation, if the file has it.
///
/// # Errors
/// Two categories of one id with different keypoint names: the grasp's start is unknown.
fn category_of<'a, 'b>(annotation: &Node, categories: &'b [Node<'a>]) -> Result<Option<&'b Node<'a>>> {
    let Some(id) = annotation.optional("category_id")? else { return Ok(None) };
    let mut of_id =
        categories.iter().filter(|category| category.value.get("id").is_some_and(|own| is_same_id(own, id.value)));
    let Some(first) = of_id.next() else { return Ok(None) };
    let keypoints = |category: &Node| category.value.get("keypoints").cloned();
    match of_id.find(|other| keypoints(other) != keypoints(first)) {
        Some(other) => Err(Error::Malformed {
            place: format!("{}.id", other.place),
            expected: "a unique number".into(),
            found: format!("{}, as {} has, with other keypoints", id.value, first.place),
        }),
        None => Ok(Some(first)),
    }
}

/// Whether a category names both ends of a grasp.
fn is_of_grasps(category: &Node) -> bool {
    let names = category.value.get("keypoints").and_then(Value::as_array);
    names.is_some_and(|names| ["grasp_start", "grasp_end"].iter().all(|end| names.iter().any(|name| name == end)))
}

/// Whether an annotation has a labelled keypoint: exporters write zeros for unlabelled ones.
fn has_keypoints(annotation: &Node) -> bool {
    let keypoints = annotation.value.get("keypoints").and_then(Value::as_array);
    keypoints.is_some_and(|all| all.iter().any(|value| value.as_f64() != Some(0.0)))
}

fn read_object(node: &Node, categories: &[Node], needs_grasp_names: bool) -> Result<Draft> {
    let mut draft = Draft { place: node.place.clone(), ..Draft::default() };
    let category = category_of(node, categories)?;
    if let Some(name) = category.map(|category| category.optional("name")).transpose()?.flatten() {
        draft.label = Some(name.text()?.to_string());
    }
    if let Some(bbox) = node.optional("bbox")?.filter(not_empty_list) {
        let [x, y, width, height] = bbox.numbers()?[..] else {
            return Err(bbox.malformed("four numbers x, y, width, height"));
        };
        if width <= 0.0 || height <= 0.0 {
            return Err(Error::ZeroSize {
                place: bbox.place,
                expected: "a positive width and height".into(),
                found: format!("{width}×{height}"),
            });
        }
        draft.corners = Some((vec![Point2::new(x, y), Point2::new(x + width, y + height)], bbox.place));
    }
    let is_of_something_else = !needs_grasp_names && !category.is_some_and(is_of_grasps);
    if let Some(keypoints) = node.optional("keypoints")?.filter(not_empty_list)
        && !is_of_something_else
    {
        read_keypoints(&keypoints, category, &mut draft)?;
    }
    if let Some(attributes) = node.optional("attributes")?.filter(|attributes| attributes.value.is_object())
        && let Some(width) = attributes.optional("jaw_width")?
    {
        draft.jaw_width = Some((width.number()?, width.place));
    }
    if let Some(segmentation) = node.optional("segmentation")?.filter(not_empty_list) {
        if segmentation.value.is_object() {
            return Err(segmentation.malformed("a list of polygons (a run-length mask has no outline)"));
        }
        let polygons = segmentation.items()?;
        let [polygon] = polygons.as_slice() else {
            return Err(segmentation.malformed("one polygon around the whole part"));
        };
        let numbers = polygon.numbers()?;
        if numbers.len() % 2 == 1 {
            return Err(polygon.malformed("an even count of numbers x, y, x, y, …"));
        }
        let points = numbers.chunks_exact(2).map(|xy| Point2::new(xy[0], xy[1])).collect();
        draft.outline = Some((points, polygon.place.clone()));
    }
    Ok(draft)
}

/// Exporters write `[]` for absent values.
fn not_empty_list(node: &Node) -> bool {
    node.value.as_array().is_none_or(|items| !items.is_empty())
}

fn read_keypoints(keypoints: &Node, category: Option<&Node>, draft: &mut Draft) -> Result<()> {
    let names = match category.map(|category| category.optional("keypoints")).transpose()?.flatten() {
        Some(names) => names.items()?,
        None => {
            return Err(
                keypoints.malformed("a category that names the keypoints, `grasp_start` and `grasp_end` among them")
            );
        }
    };
    let items = keypoints.items()?;
    if items.len() != 3 * names.len() {
        return Err(keypoints.malformed(format!("x, y, v for each of the category's {} keypoints", names.len())));
    }
    for (name, xyv) in names.iter().zip(items.chunks_exact(3)) {
        let visibility = xyv[2].number()?;
        if ![0.0, 1.0, 2.0].contains(&visibility) {
            return Err(xyv[2].malformed("a visibility 0, 1 or 2"));
        }
        let point = (Point2::new(xyv[0].number()?, xyv[1].number()?), xyv[0].place.clone());
        match name.text()? {
            _ if visibility == 0.0 => {}
            "grasp_start" => draft.grasp_start = Some(point),
            "grasp_end" => draft.grasp_end = Some(point),
            _ => {}
        }
    }
    let known = |wanted: &str| names.iter().any(|name| name.value.as_str() == Some(wanted));
    if !known("grasp_start") || !known("grasp_end") {
        let found = names.iter().take(6).map(|name| describe(name.value)).collect::<Vec<_>>().join(", ");
        return Err(Error::Malformed {
            place: format!("{} of {}", "names", keypoints.place),
            expected: "keypoints `grasp_start` and `grasp_end`".into(),
            found,
        });
    }
    Ok(())
}

/// A COCO file under construction: images and their objects.
///
/// ```
/// use sdg_demonstration::CocoFile;
///
/// let mut file = CocoFile::new();
/// file.push_image("empty.png", 640, 480, &[]);
/// assert!(file.to_json().contains("\"file_name\": \"empty.png\""));
/// ```
#[derive(Debug, Clone, Default)]
pub struct CocoFile {
    labels: Vec<String>,
    images: Vec<Value>,
    annotations: Vec<Value>,
}

impl CocoFile {
    /// Makes a file without images.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an image and its marks; ids count up from 1.
    pub fn push_image(&mut self, file_name: &str, width: u32, height: u32, objects: &[Annotation]) {
        self.push_labelled(file_name, width, height, &LabelledInstance::not_optional(objects.to_vec()));
    }

    /// Adds a test picture and its instances, each optional or not; ids count up from 1.
    pub fn push_labelled(&mut self, file_name: &str, width: u32, height: u32, instances: &[LabelledInstance]) {
        let image_id = self.images.len() + 1;
        self.images.push(json!({"id": image_id, "file_name": file_name, "width": width, "height": height}));
        for LabelledInstance { annotation: object, optional, .. } in instances {
            let category = self.labels.iter().position(|label| *label == object.label).unwrap_or_else(|| {
                self.labels.push(object.label.clone());
                self.labels.len() - 1
            });
            let [x, y, box_width, box_height] = object.bbox.to_xywh();
            let mut annotation = json!({
                "id": self.annotations.len() + 1,
                "image_id": image_id,
                "category_id": category + 1,
                "bbox": [x, y, box_width, box_height],
                "area": object.outline.as_ref().map_or(object.bbox.area(), |outline| outline.area()),
                "iscrowd": 0,
                "segmentation": object.outline.iter().map(|outline| {
                    outline.vertices.iter().flat_map(|vertex| [vertex.x, vertex.y]).collect::<Vec<_>>()
                }).collect::<Vec<_>>(),
            });
            let keypoints = match &object.grasp {
                Some(line) => [line.start.x, line.start.y, 2.0, line.end.x, line.end.y, 2.0],
                None => [0.0; 6],
            };
            annotation["keypoints"] = keypoints
                .iter()
                .enumerate()
                .map(|(i, &value)| if i % 3 == 2 { json!(value as u8) } else { json!(value) })
                .collect();
            annotation["num_keypoints"] = json!(if object.grasp.is_some() { 2 } else { 0 });
            let mut attributes = serde_json::Map::new();
            if let Some(width) = object.jaw_width {
                attributes.insert("jaw_width".into(), json!(width));
            }
            if let Some(line) = &object.grasp {
                // `grasp_offset` is for people and other programs: it follows from box and keypoints, and is not read.
                let offset = line.center() - object.bbox.center();
                attributes.insert("grasp_offset".into(), json!([offset.x, offset.y]));
            }
            if *optional {
                attributes.insert("optional".into(), json!(true));
            }
            if !attributes.is_empty() {
                annotation["attributes"] = attributes.into();
            }
            self.annotations.push(annotation);
        }
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        let categories: Vec<Value> = self
            .labels
            .iter()
            .enumerate()
            .map(|(i, label)| {
                json!({"id": i + 1, "name": label, "keypoints": ["grasp_start", "grasp_end"], "skeleton": [[1, 2]]})
            })
            .collect();
        format!("{:#}\n", json!({"images": self.images, "annotations": self.annotations, "categories": categories}))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    fn pendulum() -> Annotation {
        Annotation {
            label: "pendulum".into(),
            bbox: BoundingBox { x1: 100.0, y1: 80.25, x2: 300.5, y2: 260.0 },
            grasp: Some(GraspLine::new(Point2::new(150.5, 120.0), Point2::new(250.0, 220.0))),
            jaw_width: Some(42.5),
            outline: Some(Polygon {
                vertices: vec![Point2::new(110.0, 90.0), Point2::new(290.0, 95.5), Point2::new(200.0, 250.0)],
            }),
        }
    }

    fn full() -> Value {
        let mut file = CocoFile::new();
        file.push_image("a.png", 640, 480, &[pendulum()]);
        serde_json::from_str(&file.to_json()).unwrap()
    }

    fn read_named(value: &Value, file_name: Option<&str>) -> Result<Vec<Annotation>> {
        Annotation::read(&serde_json::to_vec(value).unwrap(), &ImageFacts { file_name, ..IMAGE })
    }

    fn message(change: impl FnOnce(&mut Value)) -> String {
        let mut value = full();
        change(&mut value);
        read_named(&value, None).unwrap_err().to_string()
    }

    #[test]
    fn a_crowd_beside_the_part_is_passed_over_and_told() {
        let expected = read_named(&full(), None).unwrap();
        let image_id = full()["images"][0]["id"].clone();
        for crowd in [
            json!({"id": 9, "image_id": image_id, "iscrowd": 1, "segmentation": {"counts": [0, 9], "size": [480, 640]}}),
            json!({"id": 9, "image_id": image_id, "iscrowd": 0, "segmentation": {"counts": "ab", "size": [480, 640]}, "keypoints": []}),
        ] {
            let mut file = full();
            file["annotations"].as_array_mut().unwrap().push(crowd);
            assert_eq!(read_named(&file, None).unwrap(), expected);
            let told = |file: &Value, file_name| {
                Annotation::passed_over(file.to_string().as_bytes(), &ImageFacts { file_name, ..IMAGE })
            };
            assert_eq!(told(&file, None), ["annotations[1]: a crowd or a mask without keypoints"]);
            // Another image of the file has no crowd.
            file["images"].as_array_mut().unwrap().push(json!({"id": 7, "file_name": "other.png"}));
            assert_eq!(told(&file, Some("a.png")).len(), 1);
            assert!(told(&file, Some("other.png")).is_empty());
        }
    }

    #[test]
    fn a_category_without_a_grasp_blocks_none_with_it() {
        let expected = read_named(&full(), None).unwrap();
        let other = |keypoints: Value, names: Value| {
            let mut file = full();
            file["categories"].as_array_mut().unwrap().push(json!({"id": 2, "name": "hole", "keypoints": names}));
            file["annotations"].as_array_mut().unwrap().insert(
                0,
                json!({
                "id": 9, "image_id": 1, "category_id": 2, "bbox": [10, 10, 30, 30], "keypoints": keypoints}),
            );
            file
        };
        for (keypoints, names) in
            [(json!([20, 20, 2]), Value::Null), (json!([0, 0, 0]), Value::Null), (json!([20, 20, 2]), json!(["rim"]))]
        {
            let mut file = other(keypoints, names);
            let read = read_named(&file, None).unwrap();
            assert_eq!((read[0].label.as_str(), read[0].grasp, &read[1]), ("hole", None, &expected[0]));
            // Alone, such keypoints may be the grasp under other names.
            file["annotations"].as_array_mut().unwrap().pop();
            let alone = read_named(&file, None);
            assert!(alone.is_err(), "{alone:?}");
        }
        let mut twice = full();
        let swapped = json!({"id": 1, "name": "pendulum", "keypoints": ["grasp_end", "grasp_start"]});
        twice["categories"].as_array_mut().unwrap().push(swapped);
        let found = read_named(&twice, None).unwrap_err().to_string();
        assert!(found.contains("categories[1].id") && found.contains("categories[0]"), "{found}");
    }

    #[test]
    fn ids_are_compared_as_numbers() {
        let expected = read_named(&full(), None).unwrap();
        for other in [json!("1"), json!(1.0)] {
            for key in ["image_id", "category_id"] {
                let mut file = full();
                assert_eq!(file["annotations"][0][key], 1);
                file["annotations"][0][key] = other.clone();
                assert_eq!(read_named(&file, None).unwrap(), expected, "{key} {other}");
            }
        }
    }

    #[test]
    fn an_area_that_is_no_number_is_not_needed() {
        let text = full().to_string();
        let area = full()["annotations"][0]["area"].to_string();
        let expected = read_named(&full(), None).unwrap();
        for literal in ["NaN", "Infinity", "-Infinity"] {
            let text = text.replace(&format!("\"area\":{area}"), &format!("\"area\": {literal}"));
            assert!(text.contains(literal));
            assert_eq!(Annotation::read(text.as_bytes(), &IMAGE).unwrap(), expected, "{literal}");
        }
    }

    #[test]
    fn what_is_written_is_what_coco_says() {
        let value = full();
        let annotation = &value["annotations"][0];
        assert_eq!(annotation["bbox"], json!([100.0, 80.25, 200.5, 179.75]));
        assert_eq!(annotation["keypoints"], json!([150.5, 120.0, 2, 250.0, 220.0, 2]));
        assert_eq!(annotation["segmentation"], json!([[110.0, 90.0, 290.0, 95.5, 200.0, 250.0]]));
        assert_eq!(annotation["attributes"], json!({"jaw_width": 42.5, "grasp_offset": [0.0, -0.125]}));
        assert_eq!(value["categories"][0]["keypoints"], json!(["grasp_start", "grasp_end"]));
    }

    #[test]
    fn box_from_the_polygon_and_keypoints_of_visibility_zero() {
        let mut value = full();
        value["annotations"][0]["bbox"] = json!([]);
        value["annotations"][0]["keypoints"] = json!([0, 0, 0, 0, 0, 0]);
        let made = read_named(&value, None).unwrap();
        assert_eq!(made[0].bbox, BoundingBox { x1: 110.0, y1: 90.0, x2: 290.0, y2: 250.0 });
        assert_eq!(made[0].grasp, None);
    }

    #[test]
    fn annotations_times_categories_are_bounded() {
        const COUNT: usize = 3200;
        let mut value = full();
        let annotation = json!({"image_id": value["annotations"][0]["image_id"], "category_id": "none"});
        value["annotations"] = vec![annotation; COUNT].into();
        value["categories"] = (0..COUNT).map(|id| json!({"id": id})).collect();
        let refused = read_named(&value, None).unwrap_err().to_string();
        assert!(refused.contains("at most 10000000 pairs") && refused.contains("3200 times 3200"), "{refused}");
    }

    #[test]
    fn each_fault_is_named_with_its_place() {
        let annotation = |v: &mut Value, field: &str, value: Value| v["annotations"][0][field] = value;
        let cases: [(String, &str); 15] = [
            (
                message(|v| annotation(v, "attributes", json!({"jaw_width": "wide"}))),
                "attributes.jaw_width: expected a n",
            ),
            (message(|v| annotation(v, "attributes", json!({"jaw_width": -3}))), "expected jaws 1 to 800 pixels apart"),
            (message(|v| v["images"][0]["width"] = json!(1280)), "made on 1280×480"),
            (message(|v| annotation(v, "bbox", json!([1, 2, 0, 5]))), "annotations[0].bbox: expected a positive width"),
            (message(|v| annotation(v, "bbox", json!([1, 2, 5]))), "annotations[0].bbox: expected four numbers"),
            (
                message(|v| annotation(v, "bbox", json!([600, 2, 100, 5]))),
                "annotations[0].bbox: expected a place inside",
            ),
            (message(|v| annotation(v, "keypoints", json!([1, 2, 2]))), "each of the category's 2 keypoints"),
            (message(|v| annotation(v, "keypoints", json!([9, 9, 2, 9, 9, 2]))), "at least 1 pixel apart"),
            (message(|v| annotation(v, "keypoints", json!([9, 9, 2, 0, 0, 0]))), "`grasp_start` without `grasp_end`"),
            (message(|v| annotation(v, "keypoints", json!([9, 9, 7, 0, 0, 0]))), "a visibility 0, 1 or 2"),
            (message(|v| annotation(v, "segmentation", json!([[1, 2, 3, 4]]))), "3 to 10000 distinct points"),
            (message(|v| annotation(v, "segmentation", json!({"counts": [1], "size": [1, 1]}))), "run-length mask"),
            (message(|v| annotation(v, "segmentation", json!([[1, 2], [3, 4]]))), "one polygon around the whole part"),
            (message(|v| annotation(v, "image_id", json!(5))), "holds no object"),
            (message(|v| v["categories"][0]["keypoints"] = json!(["nose", "tail"])), "`grasp_start` and `grasp_end`"),
        ];
        for (message, expected) in cases {
            assert!(message.contains(expected), "expected `{expected}` in `{message}`");
        }
    }

    proptest! {
        #[test]
        fn round_trip(x in 0.0..300.0f64, y in 0.0..200.0f64, w in 2.0..300.0f64, h in 2.0..200.0f64, with_outline in any::<bool>()) {
            let bbox = BoundingBox { x1: x, y1: y, x2: x + w, y2: y + h };
            let made = Annotation {
                label: "part".into(),
                bbox,
                grasp: Some(GraspLine::new(Point2::new(x, y), Point2::new(x + w, y + h))),
                jaw_width: with_outline.then_some(h),
                outline: with_outline.then(|| Polygon::from_box(&bbox)),
            };
            let mut file = CocoFile::new();
            file.push_image("a.png", 640, 480, std::slice::from_ref(&made));
            let read = Annotation::read(file.to_json().as_bytes(), &IMAGE).unwrap().remove(0);
            // Decimal text and x + (x2 - x) may each change the last bit.
            let close = |a: Point2<f64>, b: Point2<f64>| (a - b).norm() < 1e-9;
            prop_assert!(read.bbox.corners().iter().zip(bbox.corners()).all(|(&a, b)| close(a, b)));
            let (grasp, wanted) = (read.grasp.unwrap(), made.grasp.unwrap());
            prop_assert!(close(grasp.start, wanted.start) && close(grasp.end, wanted.end));
            prop_assert_eq!(read.outline.is_some(), with_outline);
            prop_assert_eq!(read.jaw_width.is_some(), with_outline);
            prop_assert!(read.jaw_width.is_none_or(|width| (width - h).abs() < 1e-9));
            for (&a, b) in read.outline.iter().flat_map(|o| &o.vertices).zip(bbox.corners()) {
                prop_assert!(close(a, b));
            }
        }

        #[test]
        fn any_value_in_any_field_never_panics(path in 0usize..9, number in any::<f64>(), text in ".{0,12}", kind in 0usize..5) {
            let replacement = match kind {
                0 => json!(number), 1 => json!(text), 2 => Value::Null, 3 => json!([number, text]), _ => json!({"id": number}),
            };
            let mut value = full();
            let slot = match path {
                0 => &mut value["images"], 1 => &mut value["images"][0], 2 => &mut value["images"][0]["width"],
                3 => &mut value["annotations"], 4 => &mut value["annotations"][0], 5 => &mut value["annotations"][0]["bbox"],
                6 => &mut value["annotations"][0]["segmentation"], 7 => &mut value["annotations"][0]["keypoints"],
                _ => &mut value["categories"],
            };
            *slot = replacement;
            let _ = read_named(&value, Some("a.png"));
        }
    }
}
