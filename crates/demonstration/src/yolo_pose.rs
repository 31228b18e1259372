//! YOLO-pose labels: a text file per image, a line per object, all values as fractions of the image's width and height.
//!
//! ```text
//! class  centre_x centre_y width height  x y v  x y v …      without visibilities if data.yaml has none: x y  x y …
//! ```
//!
//! Labels are in a `data.yaml`; classes are indices into its `names`, and its `kpt_shape` defines the format of a line.
//!
//! # Source
//! The dataset format of Ultralytics' pose models. As in Ultralytics' loader, a byte order mark and blank lines are
//! accepted. Coordinates may be up to a pixel outside the image; in that loader, up to a hundredth of the image. Lines
//! that begin with `#` are comments, and skipped.

use std::fmt::Write;

use nalgebra::Point2;

use crate::data_yaml::DataYaml;
use crate::draft::Draft;
use crate::keypoint_row::read_grasp;
use crate::labelled_instance::LabelledInstance;
use crate::written::WrittenAnnotation;
use crate::{Annotation, Error, ImageFacts, Result};

/// Numbers of a line before its keypoints.
const BOX_NUMBERS: usize = 5;
/// Larger values of a box are not fractions, even with rounding or beyond the image's edge.
const MAX_SHARE: f64 = 1.5;
/// More objects than a person marks on a photo; limits the cost of a hostile file.
const MAX_OBJECTS: usize = 10_000;

/// Whether the first line that is neither blank nor a comment is a row of numbers.
pub(crate) fn looks_like(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(without_mark(bytes)) else { return false };
    let first = text.lines().find(|line| is_row(line)).unwrap_or_default();
    let mut words = first.split_whitespace();
    words.clone().count() > 1 && words.all(|word| word.parse::<f64>().is_ok())
}

/// Whether a line is neither blank nor a comment.
fn is_row(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Reads every object; `beside` is the `data.yaml`, if there is one.
pub(crate) fn read(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts) -> Result<Vec<Annotation>> {
    let data = beside.map(DataYaml::parse).transpose()?.unwrap_or_default();
    let text = std::str::from_utf8(without_mark(bytes)).map_err(|error| Error::Malformed {
        place: "labels".into(),
        expected: "text".into(),
        found: format!("other bytes after {}", error.valid_up_to()),
    })?;
    let mut objects = Vec::new();
    for (line, number) in text.lines().zip(1..).filter(|(line, _)| is_row(line)) {
        if objects.len() == MAX_OBJECTS {
            return Err(Error::Malformed {
                place: format!("line {number}"),
                expected: format!("at most {MAX_OBJECTS} objects"),
                found: "more".into(),
            });
        }
        let place = format!("line {number}");
        let read = read_line(line, &place, &data, image)?;
        if data.keypoint_shape.is_none() {
            check_is_pose(line, &place)?;
        }
        objects.push(read);
    }
    if objects.is_empty() {
        return Err(Error::NoObject { expected: "a line of numbers for each object".into(), found: "none".into() });
    }
    Ok(objects)
}

fn read_line(line: &str, place: &str, data: &DataYaml, image: &ImageFacts) -> Result<Annotation> {
    let malformed = |expected: &str, found: String| Error::Malformed {
        place: place.to_owned(),
        expected: expected.to_owned(),
        found,
    };
    let mut numbers = Vec::new();
    for (word, at) in line.split_whitespace().zip(1..) {
        let value: f64 = word
            .parse()
            .map_err(|_| malformed("numbers", format!("`{}` as number {at}", crate::json::shorten(word))))?;
        if !value.is_finite() {
            return Err(Error::NotFinite { place: format!("{place}, number {at}"), found: word.into() });
        }
        numbers.push(value);
    }
    if numbers.len() < BOX_NUMBERS {
        return Err(malformed("class, box and keypoints: at least 5 numbers", numbers.len().to_string()));
    }
    let (head, rest) = numbers.split_at(BOX_NUMBERS);
    let [class, x, y, width, height] = [head[0], head[1], head[2], head[3], head[4]];
    if class < 0.0 || class.fract() != 0.0 {
        return Err(malformed("a class counted from 0", class.to_string()));
    }
    let stride = keypoint_stride(rest, data).ok_or_else(|| {
        malformed(
            "keypoints of x, y or of x, y, visibility",
            match data.keypoint_shape {
                Some([count, numbers]) => format!("{} numbers where data.yaml says {count}×{numbers}", rest.len()),
                None => format!("{} numbers", rest.len()),
            },
        )
    })?;

    let [across, down] = [f64::from(image.width), f64::from(image.height)];
    if width <= 0.0 || height <= 0.0 {
        return Err(Error::ZeroSize {
            place: place.to_owned(),
            expected: "a positive width and height".into(),
            found: format!("{width}×{height}"),
        });
    }
    if let Some(found) = [x, y, width, height].into_iter().find(|share| *share > MAX_SHARE) {
        return Err(malformed(
            "a box in shares of the image's width and height, from 0 to 1",
            format!("{found}, which seems to be in pixels or percent"),
        ));
    }
    let corner = |side: f64| Point2::new((x + side * width) * across, (y + side * height) * down);
    let mut draft = Draft {
        label: data.names.get(class as usize).cloned(),
        place: place.to_owned(),
        corners: Some((vec![corner(-0.5), corner(0.5)], format!("{place}, box"))),
        ..Draft::default()
    };
    let keypoints: Vec<_> = rest
        .chunks_exact(stride)
        .map(|keypoint| {
            let unlabelled = match keypoint.get(2) {
                Some(&visibility) => visibility == 0.0,
                // Without visibilities, Ultralytics treats keypoints left of or above the image as unlabelled.
                None => keypoint[0] < 0.0 || keypoint[1] < 0.0,
            };
            (!unlabelled).then(|| Point2::new(keypoint[0] * across, keypoint[1] * down))
        })
        .collect();
    match data.grasp_among_keypoints(class as usize, keypoints.len()) {
        Some([start, end]) => read_grasp(&[keypoints[start], keypoints[end]], place, &mut draft)?,
        None => read_grasp(&keypoints, place, &mut draft)?,
    }
    draft.finish(image)
}

/// Refuses a row that may be corners of an oriented box or of a segment: such rows have as many numbers as a box and
/// keypoints without visibilities.
fn check_is_pose(line: &str, place: &str) -> Result<()> {
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let rest = &numbers[BOX_NUMBERS..];
    if rest.is_empty() || keypoint_stride(rest, &DataYaml::default()) == Some(3) {
        return Ok(());
    }
    Err(Error::Malformed {
        place: place.to_owned(),
        expected: "keypoints with visibilities, or a data.yaml whose `kpt_shape` says that they have none".into(),
        found: format!("{} numbers, which may be an oriented box or a segment", numbers.len()),
    })
}

/// Numbers per keypoint: from data.yaml, or as the numbers themselves allow.
fn keypoint_stride(rest: &[f64], data: &DataYaml) -> Option<usize> {
    if let Some([count, stride]) = data.keypoint_shape {
        return (rest.is_empty() || rest.len() == count * stride).then_some(stride);
    }
    // Every third number is a visibility: fractions of the image are hardly ever exactly 0, 1 or 2.
    let visibilities =
        rest.len().is_multiple_of(3) && rest.iter().skip(2).step_by(3).all(|v| [0.0, 1.0, 2.0].contains(v));
    match (visibilities, rest.len().is_multiple_of(2)) {
        (true, _) => Some(3),
        (false, true) => Some(2),
        (false, false) => None,
    }
}

/// Writes the labels and their data.yaml.
pub(crate) fn write(image: &ImageFacts, instances: &[LabelledInstance]) -> WrittenAnnotation {
    let [across, down] = [f64::from(image.width), f64::from(image.height)];
    let mut names: Vec<String> = Vec::new();
    let mut text = String::new();
    let mut left_out = Vec::new();
    for LabelledInstance { annotation: object, optional, .. } in instances {
        let class = names.iter().position(|name| *name == object.label).unwrap_or_else(|| {
            names.push(object.label.clone());
            names.len() - 1
        });
        let center = object.bbox.center();
        let shares = [center.x / across, center.y / down, object.bbox.width() / across, object.bbox.height() / down];
        let keypoints = match &object.grasp {
            Some(line) => [line.start, line.end].map(|p| [p.x / across, p.y / down, 2.0]),
            None => [[0.0; 3]; 2],
        };
        // Writing into a string cannot fail. A number has the shortest digits that restore its value.
        let _ = write!(text, "{class}");
        for number in shares.iter().chain(keypoints.iter().flatten()) {
            let _ = write!(text, " {number}");
        }
        text.push('\n');
        if let Some(outline) = &object.outline {
            left_out.push(format!(
                "the outline of `{}` ({} points): a YOLO-pose line has a box and keypoints only",
                object.label,
                outline.vertices.len()
            ));
        }
        if *optional {
            left_out.push(format!(
                "the flag `optional` of `{}`: a YOLO-pose line has a box and keypoints only",
                object.label
            ));
        }
        if let Some(width) = object.jaw_width {
            left_out.push(format!(
                "the jaws of `{}`, {width} pixels apart: a YOLO-pose line has a box and keypoints only",
                object.label
            ));
        }
    }
    let data_yaml = DataYaml { names, keypoint_shape: Some([2, 3]), ..DataYaml::default() }.to_text();
    WrittenAnnotation { text, data_yaml: Some(data_yaml), left_out }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AnnotationFormat;
    use proptest::prelude::*;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    fn read_text(text: &str) -> Result<Vec<Annotation>> {
        Annotation::read(text.as_bytes(), &IMAGE)
    }

    #[test]
    fn shares_become_pixels() {
        let made = read_text("0 0.5 0.5 0.25 0.5 0.4 0.5 2 0.6 0.5 1\n\n").unwrap();
        assert_eq!(made[0].bbox.to_xywh(), [240.0, 120.0, 160.0, 240.0]);
        assert_eq!(made[0].grasp.unwrap().start, Point2::new(256.0, 240.0));
        let announced = Some(&b"kpt_shape: [2, 2]\n"[..]);
        let without_visibility = Annotation::read_with(b"0 0.5 0.5 0.25 0.5 0.4 0.5 0.6 0.5", announced, &IMAGE);
        assert_eq!(without_visibility.unwrap()[0].grasp, made[0].grasp);
        let commented = read_text("# class x y w h\n0 0.5 0.5 0.25 0.5 0.4 0.5 2 0.6 0.5 1\n  # end\n").unwrap();
        assert_eq!(commented, made);
        let unmarked = read_text("0 0.5 0.5 0.25 0.5 0 0 0 0 0 0").unwrap();
        assert_eq!(unmarked[0].grasp, None);
        assert_eq!(read_text("0 0.5 0.5 0.25 0.5").unwrap()[0].grasp, None);
    }

    #[test]
    fn more_objects_than_a_photo_has_are_refused() {
        let refused = read_text(&"0 0.5 0.5 0.25 0.5\n".repeat(MAX_OBJECTS + 1)).unwrap_err().to_string();
        assert!(refused.contains("line 10001") && refused.contains("at most 10000 objects"), "{refused}");
    }

    #[test]
    fn data_yaml_names_the_class_and_says_how_to_read() {
        let yaml = b"kpt_shape: [3, 2]\nnames: [rod, pendulum]\n";
        // By itself this row would be two keypoints with visibilities 1.
        let row = b"1 0.5 0.5 1 1 0 0.5 1 0.5 1 1";
        let three = Annotation::read_with(row, Some(yaml), &IMAGE).unwrap_err().to_string();
        assert!(three.contains("keypoint 2 of 3, 341.8 pixels"), "{three}");
        let row = b"1 0.5 0.5 0.9 0.9 0.25 0.5 0.5 0.5 0.75 0.5";
        let made = Annotation::read_with(row, Some(yaml), &IMAGE).unwrap();
        assert_eq!((made[0].label.as_str(), made[0].grasp.unwrap().length()), ("pendulum", 320.0));
    }

    #[test]
    fn corners_are_not_taken_for_a_box_and_keypoints() {
        let refused = |text: &str, yaml: Option<&[u8]>| {
            let error = Annotation::read_with(text.as_bytes(), yaml, &IMAGE).unwrap_err().to_string();
            assert!(error.contains("line 1") && error.contains("an oriented box or a segment"), "{error}");
        };
        let oriented = "0 0.404687 0.35 0.60625 0.35 0.60625 0.579167 0.404687 0.579167";
        refused(oriented, None);
        refused("0 0.596094 0.575 0.460156 0.458333 0.919531 0.360417 0.489063 0.421875", None);
        // Also if the numbers can be those of a box and two keypoints.
        refused("0 0.5 0.5 0.25 0.5 0.4 0.5 0.6 0.5", None);
        refused("0 0.5 0.5 0.25 0.5 0.4 0.5 0.6 0.5", Some(b"names: [rod]\n"));
        let announced = Some(&b"kpt_shape: [2, 2]\nnames: [rod]\n"[..]);
        assert!(Annotation::read_with(b"0 0.5 0.5 0.25 0.5 0.4 0.5 0.6 0.5", announced, &IMAGE).is_ok());
    }

    #[test]
    fn names_of_keypoints_say_which_is_the_start() {
        let yaml = b"kpt_shape: [2, 3]\nkpt_names:\n  0:\n    - grasp_end\n    - grasp_start\n";
        let made = Annotation::read_with(b"0 0.5 0.5 0.25 0.5 0.4 0.5 2 0.6 0.5 2", Some(yaml), &IMAGE).unwrap();
        assert_eq!(made[0].grasp.unwrap().start, Point2::new(384.0, 240.0));
    }

    #[test]
    fn each_fault_is_named_with_its_line() {
        let good = "0 0.5 0.5 0.25 0.5 0.4 0.5 2 0.6 0.5 2\n";
        let message = |second: &str| read_text(&format!("{good}{second}\n")).unwrap_err().to_string();
        for (line, expected) in [
            ("0 0.5 0.5 0.25", "line 2: expected class, box and keypoints: at least 5 numbers, found 4"),
            ("0 0.5 0.5 nan 0.5", "line 2, number 4: expected a finite number, found nan"),
            ("0 0.5 0.5 1e999 0.5", "line 2, number 4: expected a finite number"),
            ("0 0.5 half 0.25 0.5", "found `half` as number 3"),
            ("0.5 0.5 0.5 0.25 0.5", "a class counted from 0, found 0.5"),
            ("0 0.5 0.5 0 0.5", "a positive width and height, found 0×0.5"),
            (
                "0 320 240 160 240",
                "line 2: expected a box in shares of the image's width and height, from 0 to 1, found 320",
            ),
            ("0 50 50 0.25 0.5", "found 50, which seems to be in pixels or percent"),
            ("0 0.9 0.5 0.5 0.5", "line 2, box: expected a place inside"),
            ("0 0.5 0.5 0.25 0.5 0.4 0.5 0.6", "line 2: expected keypoints of x, y"),
            ("0 0.5 0.5 0.25 0.5 0.4 0.5 2 0 0 0", "`grasp_start` without `grasp_end`"),
            ("0 0.5 0.5 0.25 0.5 0.4 0.5 2 1.6 0.5 2", "line 2, keypoint 2: expected a place inside"),
            ("0 0.5 0.5 0.5 0.5 0.3 0.3 2 0.5 0.7 2 0.6 0.6 2", "lie evenly on the grasp line"),
        ] {
            let message = message(line);
            assert!(message.contains(expected), "expected `{expected}` in `{message}`");
        }
    }

    #[test]
    fn an_outline_is_left_out_aloud() {
        let bbox = BoundingBox { x1: 10.0, y1: 20.0, x2: 110.0, y2: 220.0 };
        let marked = Annotation {
            label: "rod".into(),
            bbox,
            grasp: None,
            jaw_width: Some(30.0),
            outline: Some(Polygon::from_box(&bbox)),
        };
        let written = AnnotationFormat::YoloPose.write(&IMAGE, &[marked]).unwrap();
        assert_eq!(written.left_out.len(), 2);
        assert!(written.left_out[0].contains("outline of `rod` (4 points)"), "{:?}", written.left_out);
        assert!(written.left_out[1].contains("the jaws of `rod`, 30 pixels apart"), "{:?}", written.left_out);
    }

    proptest! {
        #[test]
        fn round_trip(x in 0.0..300.0f64, y in 0.0..200.0f64, w in 2.0..300.0f64, h in 2.0..200.0f64, graspless in any::<bool>()) {
            let bbox = BoundingBox { x1: x, y1: y, x2: x + w, y2: y + h };
            let grasp = (!graspless).then(|| GraspLine::new(Point2::new(x, y + h), Point2::new(x + w, y)));
            let marked = [
                Annotation { label: "rod end: left".into(), bbox, grasp, jaw_width: None, outline: None },
                Annotation { label: "it's".into(), bbox, grasp: None, jaw_width: None, outline: None },
            ];
            let written = AnnotationFormat::YoloPose.write(&IMAGE, &marked).unwrap();
            let yaml = written.data_yaml.as_deref().map(str::as_bytes);
            let read = Annotation::read_with(written.text.as_bytes(), yaml, &IMAGE).unwrap();
            prop_assert_eq!(read.len(), 2);
            for (found, expected) in read.iter().zip(&marked) {
                prop_assert_eq!(&found.label, &expected.label);
                // Dividing and multiplying by the image's size may change the last bit.
                let close = |a: Point2<f64>, b: Point2<f64>| (a - b).norm() < 1e-9;
                prop_assert!(found.bbox.corners().iter().zip(expected.bbox.corners()).all(|(&a, b)| close(a, b)));
                prop_assert_eq!(found.grasp.is_some(), expected.grasp.is_some());
                if let (Some(a), Some(b)) = (found.grasp, expected.grasp) {
                    prop_assert!(close(a.start, b.start) && close(a.end, b.end));
                }
            }
        }
    }
}
