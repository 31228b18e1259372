//! OpenDR's single_demo_grasp: `boxes_train.npy` and `kps_train.npy`, a row for each augmented image.
//!
//! | file | shape | a row |
//! |---|---|---|
//! | `boxes_*.npy` | (N, 4) | x1, y1, x2, y2 |
//! | `kps_*.npy` | (N, 2, K) | K values of x, then K values of y; points evenly spaced along the grasp line; K = 12 |
//!
//! Row *i* belongs to the image `i.jpg` of 640×480 pixels. There are no labels and no outlines.
//!
//! # Source
//! OpenDR, src/opendr/control/single_demo_grasp: augmentation and learner_utils. Boxes are hulls of rotated rectangles
//! there and extend beyond the image's edges; here they are clipped.

use nalgebra::Point2;

use crate::draft::Draft;
use crate::keypoint_row::read_grasp;
use crate::npy::NpyArray;
use crate::{Annotation, Error, ImageFacts, Result};

/// The size to which the original resizes every image.
const IMAGE: [u32; 2] = [640, 480];

/// Reads the row of the image's number from the two files, in either order.
pub(crate) fn read(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts) -> Result<Vec<Annotation>> {
    image.check_declared(IMAGE[0], IMAGE[1])?;
    let given = NpyArray::parse(bytes, ".npy file")?;
    let Some(beside) = beside else {
        return Err(Error::MissingBeside {
            expected: "boxes_*.npy together with kps_*.npy of the same ending",
            found: "one of them alone",
        });
    };
    let other = NpyArray::parse(beside, ".npy file beside it")?;
    let (boxes, keypoints) = if given.shape.len() == 2 { (given, other) } else { (other, given) };
    let (&[rows, 4], &[keypoint_rows, 2, count]) = (&boxes.shape[..], &keypoints.shape[..]) else {
        return Err(Error::Malformed {
            place: ".npy files".into(),
            expected: "boxes of shape (N, 4) and keypoints of shape (N, 2, K)".into(),
            found: format!("{:?} and {:?}", boxes.shape, keypoints.shape),
        });
    };
    if rows != keypoint_rows {
        return Err(Error::Malformed {
            place: ".npy files".into(),
            expected: "as many boxes as rows of keypoints".into(),
            found: format!("{rows} and {keypoint_rows}"),
        });
    }

    let row = choose_row(rows, image)?;
    let place = |what: &str| format!("{what} row {row}");
    let corner = |x, y| -> Result<Point2<f64>> {
        // Clipping would turn an infinite number into a position on the edge.
        let point = Point2::new(boxes.at(&[row, x]), boxes.at(&[row, y]));
        match point.iter().find(|value| !value.is_finite()) {
            Some(found) => Err(Error::NotFinite { place: place("boxes"), found: found.to_string() }),
            None => {
                Ok(Point2::new(point.x.clamp(0.0, f64::from(image.width)), point.y.clamp(0.0, f64::from(image.height))))
            }
        }
    };
    let corners = vec![corner(0, 1)?, corner(2, 3)?];
    let mut draft = Draft { place: place("boxes"), corners: Some((corners, place("boxes"))), ..Draft::default() };
    let points: Vec<_> =
        (0..count).map(|k| Some(Point2::new(keypoints.at(&[row, 0, k]), keypoints.at(&[row, 1, k])))).collect();
    read_grasp(&points, &place("kps"), &mut draft)?;
    Ok(vec![draft.finish(image)?])
}

/// The row given by the image's name. If there is only one row, any name selects it, because people rename files.
fn choose_row(rows: usize, image: &ImageFacts) -> Result<usize> {
    let stem = image.file_name.map(|name| name.rsplit(['/', '\\']).next().unwrap_or(name));
    let number = stem.and_then(|name| name.split('.').next()).and_then(|stem| stem.parse::<usize>().ok());
    match (rows, number) {
        (1, _) => Ok(0),
        (_, Some(number)) if number < rows => Ok(number),
        _ => Err(Error::ImageNotFound {
            expected: "an image named by its row, such as `17.jpg`".into(),
            found: format!("{rows} rows and {}", stem.map_or("no name".into(), |name| format!("`{name}`"))),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npy::tests::file;

    fn floats(values: &[f64]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    fn boxes(values: &[f64]) -> Vec<u8> {
        file("'<f8'", "False", &format!("({}, 4)", values.len() / 4), &floats(values))
    }

    /// Three keypoints per row.
    fn keypoints(values: &[f64]) -> Vec<u8> {
        file("'<f8'", "False", &format!("({}, 2, 3)", values.len() / 6), &floats(values))
    }

    fn facts(file_name: &str) -> ImageFacts<'_> {
        ImageFacts { width: 640, height: 480, file_name: Some(file_name) }
    }

    fn two_rows() -> [Vec<u8>; 2] {
        [
            boxes(&[10.0, 20.0, 110.0, 220.0, -15.5, 30.0, 700.0, 90.0]),
            keypoints(&[20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 100.0, 200.0, 300.0, 40.0, 50.0, 60.0]),
        ]
    }

    #[test]
    fn the_image_s_number_is_its_row_and_boxes_end_at_the_edge() {
        let [boxes, keypoints] = two_rows();
        let made = Annotation::read_with(&boxes, Some(&keypoints), &facts("train/1.jpg")).unwrap();
        assert_eq!(made[0].bbox.to_xywh(), [0.0, 30.0, 640.0, 60.0]);
        let grasp = made[0].grasp.unwrap();
        assert_eq!((grasp.start, grasp.end), (Point2::new(100.0, 40.0), Point2::new(300.0, 60.0)));
        assert_eq!(Annotation::read_with(&keypoints, Some(&boxes), &facts("1.jpg")).unwrap(), made);
    }

    #[test]
    fn each_fault_is_named() {
        let [good_boxes, good_keypoints] = two_rows();
        let message = |boxes: &[u8], keypoints: Option<&[u8]>, name: &str| {
            Annotation::read_with(boxes, keypoints, &facts(name)).unwrap_err().to_string()
        };
        let one_row = boxes(&[10.0, 20.0, 110.0, 220.0]);
        let nan = boxes(&[f64::NAN, 20.0, 110.0, 220.0, 1.0, 2.0, 3.0, 4.0]);
        let bent = keypoints(&[20.0, 90.0, 40.0, 50.0, 60.0, 70.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0]);
        let away = keypoints(&[-20.0, 10.0, 40.0, 50.0, 60.0, 70.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0]);
        for (found, expected) in [
            (message(&good_boxes, None, "0.jpg"), "together with kps_*.npy"),
            (message(&good_boxes, Some(&good_boxes), "0.jpg"), "keypoints of shape (N, 2, K)"),
            (message(&good_boxes, Some(b"\x93NUMPY"), "0.jpg"), "cut off in the header"),
            (message(&one_row, Some(&good_keypoints), "0.jpg"), "as many boxes as rows of keypoints, found 1 and 2"),
            (message(&good_boxes, Some(&good_keypoints), "2.jpg"), "2 rows and `2.jpg`"),
            (message(&good_boxes, Some(&good_keypoints), "part.png"), "named by its row"),
            (message(&nan, Some(&good_keypoints), "0.jpg"), "boxes row 0: expected a finite number, found NaN"),
            (message(&good_boxes, Some(&bent), "0.jpg"), "keypoint 2 of 3, 60.0 pixels beside it"),
            (message(&good_boxes, Some(&away), "0.jpg"), "kps row 0, keypoint 1: expected a place inside"),
        ] {
            assert!(found.contains(expected), "expected `{expected}` in `{found}`");
        }
        let larger = ImageFacts { width: 1280, height: 960, file_name: None };
        let found = Annotation::read_with(&good_boxes, Some(&good_keypoints), &larger).unwrap_err().to_string();
        assert!(found.contains("made on 640×480"), "{found}");
    }
}
