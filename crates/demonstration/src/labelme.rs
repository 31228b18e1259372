//! LabelMe JSON: a `rectangle`, points `grasp_start` and `grasp_end`, an optional `polygon`, connected by `group_id`.

use std::collections::{BTreeSet, HashMap};

use nalgebra::Point2;
use serde_json::{Value, json};

use crate::annotation::ImageFacts;
use crate::draft::{Border, Draft};
use crate::foreign::is_foreign_shape;
use crate::json::{Node, shorten};
use crate::labelled_instance::{LabelledInstance, is_optional};
use crate::{Error, Result};

/// Reads every object of a LabelMe file, which must have at least one.
pub(crate) fn read(root: &Node, image: &ImageFacts) -> Result<Vec<LabelledInstance>> {
    let instances = read_instances(root, image, Border::MustNotCut)?;
    if instances.is_empty() {
        return Err(Error::NoObject {
            expected: "at least a `rectangle` or a `polygon`".into(),
            found: "an empty list of shapes, or other things alone".into(),
        });
    }
    Ok(instances)
}

/// Reads the objects of a LabelMe file, if any, in the order of their first shapes.
pub(crate) fn read_instances(root: &Node, image: &ImageFacts, border: Border) -> Result<Vec<LabelledInstance>> {
    if let (Some(width), Some(height)) = (root.optional("imageWidth")?, root.optional("imageHeight")?) {
        image.check_declared(width.pixels()?, height.pixels()?)?;
    }
    let shapes = root.field("shapes", "the list of shapes")?.items()?;
    let own = shapes.iter().filter(|shape| !is_foreign_shape(shape));
    let shapes = own.map(Shape::read).collect::<Result<Vec<_>>>()?;
    if shapes.is_empty() {
        return Ok(Vec::new());
    }

    // If the shapes have at most one group id, all shapes are one object, even those without the id.
    let ids: BTreeSet<&str> = shapes.iter().filter_map(|shape| shape.group.as_deref()).collect();
    let ungrouped = shapes.iter().filter(|shape| shape.group.is_none()).count();
    if ids.len() <= 1 {
        return Ok(vec![instance(shapes, image, border)?]);
    }
    if ungrouped > 0 {
        return Err(Error::Ungrouped { found: format!("{} groups and {ungrouped} shapes without one", ids.len()) });
    }
    let mut groups: Vec<Vec<Shape>> = Vec::new();
    let mut group_idxs: HashMap<String, usize> = HashMap::new();
    for shape in shapes {
        let at = *group_idxs.entry(shape.group.clone().unwrap_or_default()).or_insert(groups.len());
        if at == groups.len() {
            groups.push(Vec::new());
        }
        groups[at].push(shape);
    }
    groups.into_iter().map(|shapes| instance(shapes, image, border)).collect()
}

fn instance(shapes: Vec<Shape>, image: &ImageFacts, border: Border) -> Result<LabelledInstance> {
    let optional = shapes.iter().any(|shape| shape.optional);
    let place = shapes.first().map(|shape| shape.place.clone()).unwrap_or_default();
    Ok(LabelledInstance { annotation: object(shapes)?.finish_at(image, border)?, optional, place })
}

enum Kind {
    Box,
    Outline,
    GraspStart,
    GraspEnd,
}

struct Shape {
    kind: Kind,
    label: String,
    group: Option<String>,
    points: Vec<Point2<f64>>,
    /// A field of the shape `grasp_start` only: LabelMe keeps fields that it does not know.
    jaw_width: Option<(f64, String)>,
    optional: bool,
    place: String,
}

impl Shape {
    fn read(node: &Node) -> Result<Self> {
        let label = node.field("label", "the shape's name")?.text()?.trim().to_string();
        let group = node.optional("group_id")?.map(|id| id.value.to_string());
        let points_node = node.field("points", "a list of [x, y]")?;
        let mut points = Vec::new();
        for point in points_node.items()? {
            match point.numbers()?.as_slice() {
                &[x, y] => points.push(Point2::new(x, y)),
                _ => return Err(point.malformed("a pair [x, y]")),
            }
        }
        // LabelMe's own default, omitted by old versions.
        let shape_type = node.optional("shape_type")?.map_or(Ok("polygon"), |kind| kind.text())?;
        let (kind, min_points) = match (shape_type, label.as_str()) {
            ("rectangle", _) => (Kind::Box, 2),
            ("polygon", _) => (Kind::Outline, 3),
            ("point", "grasp_start") => (Kind::GraspStart, 1),
            ("point", "grasp_end") => (Kind::GraspEnd, 1),
            ("point", other) => {
                return Err(Error::Malformed {
                    place: node.place.clone(),
                    expected: "a point labelled `grasp_start` or `grasp_end`".into(),
                    found: format!("`{}`", shorten(other)),
                });
            }
            (other, _) => {
                return Err(Error::Malformed {
                    place: format!("{}.shape_type", node.place),
                    expected: "`rectangle`, `polygon` or `point`".into(),
                    found: format!("`{}`", shorten(other)),
                });
            }
        };
        if points.len() < min_points {
            return Err(points_node.malformed(format!("at least {min_points} points for a {shape_type}")));
        }
        let jaw_width = match node.optional("jaw_width")? {
            Some(width) if matches!(kind, Kind::GraspStart) => Some((width.number()?, width.place)),
            _ => None,
        };
        let optional = is_optional(node.optional("flags")?.as_ref())?;
        Ok(Self { kind, label, group, points, jaw_width, optional, place: node.place.clone() })
    }
}

/// The marks in the shapes of one group.
fn object(shapes: Vec<Shape>) -> Result<Draft> {
    let mut draft =
        Draft { place: shapes.first().map(|shape| shape.place.clone()).unwrap_or_default(), ..Draft::default() };
    let (mut box_label, mut outline_label) = (None, None);
    for shape in shapes {
        let twice = match shape.kind {
            Kind::Box => {
                box_label = Some(shape.label);
                draft.corners.replace((shape.points, shape.place.clone())).is_some()
            }
            Kind::Outline => {
                outline_label = Some(shape.label);
                draft.outline.replace((shape.points, shape.place.clone())).is_some()
            }
            Kind::GraspStart => {
                draft.jaw_width = shape.jaw_width;
                draft.grasp_start.replace((shape.points[0], shape.place.clone())).is_some()
            }
            Kind::GraspEnd => draft.grasp_end.replace((shape.points[0], shape.place.clone())).is_some(),
        };
        if twice {
            let kind = match shape.kind {
                Kind::Box => "rectangle",
                Kind::Outline => "polygon",
                Kind::GraspStart => "grasp_start",
                Kind::GraspEnd => "grasp_end",
            };
            return Err(Error::Ungrouped { found: format!("a second `{kind}` at {} in one group", shape.place) });
        }
    }
    draft.label = box_label.or(outline_label);
    Ok(draft)
}

/// The LabelMe version of our files; LabelMe compares it with its own and warns about newer ones.
const VERSION: &str = "5.4.1";

/// Writes objects as LabelMe shows them: a group of a rectangle, two points and a polygon for each. The rectangle has
/// the flag `optional`.
pub(crate) fn write(file_name: &str, image: &ImageFacts, instances: &[LabelledInstance]) -> String {
    let mut shapes = Vec::new();
    for (LabelledInstance { annotation: object, optional, .. }, group) in instances.iter().zip(1..) {
        let mut push = |label: &str, shape_type: &str, points: &[Point2<f64>]| {
            let points: Vec<Value> = points.iter().map(|point| json!([point.x, point.y])).collect();
            shapes.push(json!({
                "label": label,
                "points": points,
                "group_id": group,
                "description": "",
                "shape_type": shape_type,
                "flags": if *optional && shape_type == "rectangle" { json!({"optional": true}) } else { json!({}) },
                "mask": null,
            }));
        };
        let [upper_left, _, lower_right, _] = object.bbox.corners();
        push(&object.label, "rectangle", &[upper_left, lower_right]);
        if let Some(line) = &object.grasp {
            push("grasp_start", "point", &[line.start]);
            push("grasp_end", "point", &[line.end]);
        }
        if let Some(outline) = &object.outline {
            push(&object.label, "polygon", &outline.vertices);
        }
        if let (Some(_), Some(width)) = (&object.grasp, object.jaw_width) {
            // The part itself may have the name of the point.
            let is_start = |shape: &&mut Value| shape["shape_type"] == "point" && shape["label"] == "grasp_start";
            let start = shapes.iter_mut().rfind(is_start);
            if let Some(start) = start {
                start["jaw_width"] = json!(width);
            }
        }
    }
    let file = json!({
        "version": VERSION,
        "flags": {},
        "shapes": shapes,
        "imagePath": file_name,
        "imageData": null,
        "imageHeight": image.height,
        "imageWidth": image.width,
    });
    format!("{file:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Annotation, AnnotationFormat};
    use proptest::prelude::*;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    fn full() -> Value {
        json!({
            "version": "5.4.1", "flags": {}, "imagePath": "p.png", "imageData": null,
            "imageHeight": 480, "imageWidth": 640,
            "shapes": [
                {"label": "pendulum", "points": [[300, 260], [100, 80]], "group_id": 1, "shape_type": "rectangle", "flags": {}},
                {"label": "grasp_start", "points": [[150.5, 120]], "group_id": 1, "shape_type": "point", "flags": {}},
                {"label": "grasp_end", "points": [[250, 220]], "group_id": 1, "shape_type": "point", "flags": {}},
                {"label": "pendulum", "points": [[110, 90], [290, 95], [200, 250]], "group_id": 1, "shape_type": "polygon"},
            ]
        })
    }

    fn read_value(value: &Value) -> Result<Vec<Annotation>> {
        Annotation::read(&serde_json::to_vec(value).unwrap(), &IMAGE)
    }

    /// The message after `change`, which must make the file invalid.
    fn message(change: impl FnOnce(&mut Value)) -> String {
        let mut value = full();
        change(&mut value);
        read_value(&value).unwrap_err().to_string()
    }

    #[test]
    fn reads_box_grasp_and_outline() {
        let made = read_value(&full()).unwrap();
        assert_eq!(made.len(), 1);
        assert_eq!(made[0].label, "pendulum");
        assert_eq!(made[0].bbox.to_xywh(), [100.0, 80.0, 200.0, 180.0]);
        let grasp = made[0].require_grasp().unwrap();
        assert_eq!((grasp.start, grasp.end), (Point2::new(150.5, 120.0), Point2::new(250.0, 220.0)));
        assert_eq!(made[0].outline.as_ref().unwrap().vertices[2], Point2::new(200.0, 250.0));
    }

    #[test]
    fn group_ids_tell_objects_apart() {
        let mut value = full();
        let second = json!({"label": "rod", "points": [[1, 1], [9, 9]], "group_id": 2, "shape_type": "rectangle"});
        value["shapes"].as_array_mut().unwrap().push(second);
        let made = read_value(&value).unwrap();
        assert_eq!(made.iter().map(|a| a.label.as_str()).collect::<Vec<_>>(), ["pendulum", "rod"]);
        assert!(made[1].grasp.is_none());
    }

    #[test]
    fn without_any_group_id_all_shapes_are_one_object() {
        let mut value = full();
        for shape in value["shapes"].as_array_mut().unwrap() {
            shape["group_id"] = Value::Null;
        }
        assert_eq!(read_value(&value).unwrap(), read_value(&full()).unwrap());
    }

    #[test]
    fn each_fault_is_named_with_its_place() {
        let second_box =
            json!({"label": "rod", "points": [[1, 1], [9, 9]], "group_id": null, "shape_type": "rectangle"});
        let cases: [(String, &str); 12] = [
            (message(|v| v["imageWidth"] = json!(320)), "made on 320×480 pixels, the image has 640×480"),
            (message(|v| v["shapes"][1]["points"][0][0] = json!(700)), "shapes[1]: expected a place inside"),
            (message(|v| v["shapes"][1]["label"] = json!("grasp-start")), "found `grasp-start`"),
            (message(|v| drop(v["shapes"].as_array_mut().unwrap().remove(1))), "`grasp_end` without `grasp_start`"),
            (message(|v| v["shapes"][0]["points"] = json!([[5, 5], [5, 90]])), "shapes[0]: expected a box of at least"),
            (message(|v| v["shapes"][0]["points"] = json!([[5, 5]])), "shapes[0].points: expected at least 2 points"),
            (message(|v| v["shapes"][3]["points"][0] = json!([1, null])), "shapes[3].points[0][1]: expected a number"),
            (message(|v| v["shapes"][3]["points"][0] = json!([1])), "shapes[3].points[0]: expected a pair"),
            (
                message(|v| v["shapes"][3]["points"].as_array_mut().unwrap().truncate(2)),
                "at least 3 points for a polygon",
            ),
            (message(|v| v["shapes"][3]["points"] = json!([[0, 0], [9, 9], [9, 0], [0, 9]])), "does not cross itself"),
            (message(|v| v["shapes"].as_array_mut().unwrap().push(second_box)), "a second `rectangle` at shapes[4]"),
            (message(|v| v["shapes"] = json!([])), "empty list of shapes"),
        ];
        for (message, expected) in cases {
            assert!(message.contains(expected), "expected `{expected}` in `{message}`");
        }
    }

    #[test]
    fn marks_of_other_things_are_passed_over_and_told() {
        let expected = Annotation::read(full().to_string().as_bytes(), &IMAGE).unwrap();
        let foreign = [("circle", "hole"), ("linestrip", "cable"), ("mask", "rod"), ("point", "hole")];
        let mut file = full();
        for (shape_type, label) in foreign {
            let shape = json!({"label": label, "points": [[1, 1]], "group_id": 7, "shape_type": shape_type});
            file["shapes"].as_array_mut().unwrap().insert(0, shape);
        }
        let text = file.to_string();
        assert_eq!(Annotation::read(text.as_bytes(), &IMAGE).unwrap(), expected);
        let told = Annotation::passed_over(text.as_bytes(), &IMAGE);
        assert!(told.len() == 4 && told[0] == "shapes[0]: a point `hole`", "{told:?}");
        assert!(Annotation::passed_over(full().to_string().as_bytes(), &IMAGE).is_empty());
    }

    #[test]
    fn literals_of_python_are_not_finite() {
        for literal in ["NaN", "Infinity", "-Infinity", "1e999"] {
            let text = serde_json::to_string_pretty(&full()).unwrap().replace("150.5", literal);
            let found = Annotation::read(text.as_bytes(), &IMAGE).unwrap_err();
            assert!(matches!(found, Error::NotFinite { .. }), "{literal}: {found:?}");
            assert!(found.to_string().contains("line "), "{found}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let message = |text: &str| Annotation::read(text.as_bytes(), &IMAGE).unwrap_err().to_string();
        for empty in ["", " \n"] {
            assert!(message(empty).contains("found nothing: the file is empty"));
        }
        assert!(message("<annotation></annotation>").contains("found XML"));
        assert!(message("0,0.5,0.46,0.2,0.22,0.52,0.48,2\n").contains("commas: YOLO-pose has blanks"));
        let utf16 =
            [b"\xff\xfe".as_slice(), &"{}".encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>()].concat();
        assert!(Annotation::read(&utf16, &IMAGE).unwrap_err().to_string().contains("UTF-16: save it as UTF-8"));
        assert!(message("{\"shapes\": [").contains("not JSON (line 1"));
        assert!(message("[1, 2]").contains("found a list of 2"));
        assert!(message("{\"model\": 3}").contains("an object with `model`"));
        assert!(message("\u{89}PNG").contains("not JSON"));
    }

    #[test]
    fn the_jaws_of_a_part_with_the_name_of_the_point_come_back() {
        let bbox = BoundingBox { x1: 10.0, y1: 20.0, x2: 110.0, y2: 80.0 };
        let marked = Annotation {
            label: "grasp_start".into(),
            bbox,
            grasp: Some(GraspLine::new(Point2::new(30.0, 50.0), Point2::new(90.0, 50.0))),
            jaw_width: Some(42.5),
            outline: Some(Polygon::from_box(&bbox)),
        };
        let written = AnnotationFormat::LabelMe.write(&IMAGE, std::slice::from_ref(&marked)).unwrap();
        assert_eq!(Annotation::read(written.text.as_bytes(), &IMAGE).unwrap(), std::slice::from_ref(&marked));
        assert!(written.left_out.is_empty());
        let without_line = Annotation { grasp: None, ..marked };
        let written = AnnotationFormat::LabelMe.write(&IMAGE, &[without_line]).unwrap();
        assert_eq!(
            written.left_out,
            ["the jaws of `grasp_start`, 42.5 pixels apart: LabelMe's are marks of a grasp's line"]
        );
    }

    /// Every marked position. Reading decimal text may change the last bit.
    fn points(marked: &Annotation) -> impl Iterator<Item = Point2<f64>> {
        let line = marked.grasp.iter().flat_map(|line| [line.start, line.end]);
        let outline = marked.outline.iter().flat_map(|outline| outline.vertices.iter().copied());
        marked.bbox.corners().into_iter().chain(line).chain(outline)
    }

    proptest! {
        #[test]
        fn round_trip(x in 0.0..300.0f64, y in 0.0..200.0f64, w in 2.0..300.0f64, h in 2.0..200.0f64, whole in any::<bool>()) {
            let bbox = BoundingBox { x1: x, y1: y, x2: x + w, y2: y + h };
            let first = Annotation {
                label: "rod \"end\"".into(),
                bbox,
                grasp: whole.then(|| GraspLine::new(Point2::new(x, y + h), Point2::new(x + w, y))),
                jaw_width: whole.then_some(h),
                outline: whole.then(|| Polygon::from_box(&bbox)),
            };
            let second = Annotation { label: "other".into(), grasp: None, jaw_width: None, ..first.clone() };
            for marked in [vec![first.clone()], vec![first, second]] {
                let written = AnnotationFormat::LabelMe.write(&IMAGE, &marked).unwrap();
                prop_assert!(written.left_out.is_empty());
                let read = Annotation::read(written.text.as_bytes(), &IMAGE).unwrap();
                prop_assert_eq!(read.len(), marked.len());
                for (found, expected) in read.iter().zip(&marked) {
                    prop_assert_eq!(&found.label, &expected.label);
                    prop_assert!(points(found).zip(points(expected)).all(|(a, b)| (a - b).norm() < 1e-9));
                    prop_assert_eq!(points(found).count(), points(expected).count());
                    prop_assert_eq!(found.jaw_width.is_some(), expected.jaw_width.is_some());
                    prop_assert!(found.jaw_width.is_none_or(|width| (width - h).abs() < 1e-9));
                }
            }
        }
    }
}
