//! The pictures and their ground truth, by the formulas of `peers/scene.py`, so that both sides get the same pictures.

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_detection::{ObjectMask, Target};
use sdg_geometry::{BoundingBox, GraspLine, Mask};

/// Width of every picture, in pixels.
pub const WIDTH: u32 = 640;
/// Height of every picture, in pixels.
pub const HEIGHT: u32 = 480;

/// Picture number `number`: a texture that is different at every place.
pub fn picture(number: u32) -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| Rgb([x ^ y, x * y / 64 + 40 * number, x + 2 * y].map(|v| v as u8)))
}

/// One box in each cell of a grid, in pixels.
pub fn boxes(columns: u32, rows: u32) -> Vec<BoundingBox> {
    let (width, height) = (WIDTH / columns, HEIGHT / rows);
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| {
            let x = column * width + width / 10 + (5 * column + 3 * row) % 8;
            let y = row * height + height / 10 + (3 * column + 7 * row) % 10;
            let [x1, y1, x2, y2] = [x, y, x + 3 * width / 4, y + 3 * height / 4].map(f64::from);
            BoundingBox { x1, y1, x2, y2 }
        })
        .collect()
}

/// A part in each cell of a grid, with keypoints along its box's diagonal; its mask is the box without its lower right
/// quarter.
pub fn target(columns: u32, rows: u32, num_keypoints: usize) -> Target {
    let boxes = boxes(columns, rows);
    let keypoints = boxes.iter().map(|of_part| diagonal(of_part, num_keypoints)).collect();
    let masks = boxes.iter().map(mask).collect();
    Target { labels: vec![0; boxes.len()], keypoints, masks, boxes }
}

fn mask(of_part: &BoundingBox) -> ObjectMask {
    let [x1, y1, x2, y2] = [of_part.x1, of_part.y1, of_part.x2, of_part.y2].map(|v| v as u32);
    let [x, y] = [(x1 + x2) / 2, (y1 + y2) / 2];
    let inside = |u, v| (x1..x2).contains(&u) && (y1..y2).contains(&v) && (u < x || v < y);
    Mask::from_fn(WIDTH, HEIGHT, inside).into()
}

/// The centres of `count` equal sections of a box's diagonal.
fn diagonal(of_part: &BoundingBox, count: usize) -> Vec<sdg_geometry::Keypoint> {
    let half = 0.5 / count as f64;
    let at = |along: f64| Point2::new(of_part.x1 + along * of_part.width(), of_part.y1 + along * of_part.height());
    GraspLine::new(at(half), at(1.0 - half)).keypoints(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_stay_inside_and_apart() {
        for (columns, rows) in [(8, 4), (3, 2)] {
            let boxes = boxes(columns, rows);
            assert_eq!(boxes.len(), (columns * rows) as usize);
            for (idx, one) in boxes.iter().enumerate() {
                assert!(one.x2 <= f64::from(WIDTH) && one.y2 <= f64::from(HEIGHT), "{one:?}");
                assert!(boxes[..idx].iter().all(|other| other.iou(one) == 0.0));
            }
        }
    }

    #[test]
    fn numbers_that_scene_py_gives_too() {
        assert_eq!(picture(1).get_pixel(37, 211).0, [37 ^ 211, (37 * 211 / 64 + 40) as u8, (37u32 + 422) as u8]);
        let last = boxes(8, 4)[31];
        assert_eq!([last.x1, last.y1, last.x2, last.y2], [572.0, 374.0, 632.0, 464.0]);
        let points = &target(8, 4, 17).keypoints[31];
        assert!((points[0].x - (572.0 + 60.0 * 0.5 / 17.0)).abs() < 1e-9 && points.len() == 17);
    }
}
