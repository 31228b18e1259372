//! A drawn part for tests: an L with a bright foot and a hole, on a dark background with a brightness gradient.

use std::ops::ControlFlow;

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{Angle, GraspLine, PlanarSimilarity, Polygon};

use crate::facts::ModelKind;
use crate::model::GraspModel;
use crate::teach::{TeachOptions, teach};

const MIDDLE: Point2<f64> = Point2::new(90.0, 70.0);

pub(crate) fn outline() -> Polygon {
    let corners = [(60.0, 40.0), (80.0, 40.0), (80.0, 84.0), (124.0, 84.0), (124.0, 104.0), (60.0, 104.0)];
    Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() }
}

/// A picture of the part at each of the poses `parts`, with antialiased edges.
pub(crate) fn picture([width, height]: [u32; 2], parts: &[PlanarSimilarity]) -> RgbImage {
    let outline = outline();
    let inverses: Vec<PlanarSimilarity> = parts.iter().map(PlanarSimilarity::inverse).collect();
    RgbImage::from_fn(width, height, |x, y| {
        let table = [50.0 + f64::from(x) / 8.0, 55.0 + f64::from(y) / 8.0, 70.0];
        let color_at = |at: Point2<f64>| {
            let on_part = inverses.iter().map(|inverse| inverse.apply(&at)).find(|own| outline.contains(own));
            match on_part {
                Some(own) if (own - Point2::new(70.0, 94.0)).norm() < 5.0 => [30.0, 30.0, 35.0],
                Some(own) if own.x > 100.0 => [230.0, 200.0, 60.0],
                Some(_) => [190.0, 40.0, 30.0],
                None => table,
            }
        };
        let mut sum = [0.0; 3];
        for k in 0..9 {
            let [right, down] = [k % 3, k / 3].map(|k| (f64::from(k) + 0.5) / 3.0);
            let color = color_at(Point2::new(f64::from(x) + right, f64::from(y) + down));
            (0..3).for_each(|c| sum[c] += color[c] / 9.0);
        }
        Rgb(sum.map(|value| value.round() as u8))
    })
}

/// The part rotated by `angle_deg`, with the point `MIDDLE` at (x, y).
pub(crate) fn at(x: f64, y: f64, angle_deg: f64) -> PlanarSimilarity {
    PlanarSimilarity::about(MIDDLE, Point2::new(x, y), Angle::from_degrees(angle_deg), 1.0)
}

pub(crate) fn line() -> GraspLine {
    GraspLine::new(Point2::new(70.0, 50.0), Point2::new(70.0, 80.0))
}

/// A photo of the part at a pose, of this size, and its marks.
pub(crate) fn demonstration_at(size: [u32; 2], pose: &PlanarSimilarity) -> Demonstration {
    let outline = outline().transformed(pose);
    let annotation = Annotation {
        label: "L".into(),
        bbox: outline.bounds(),
        grasp: Some(line().transformed(pose)),
        jaw_width: None,
        outline: Some(outline),
    };
    Demonstration { image: picture(size, &[*pose]), annotation }
}

/// A photo of the part, of this size, and its marks.
pub(crate) fn demonstration(size: [u32; 2]) -> Demonstration {
    demonstration_at(size, &PlanarSimilarity::IDENTITY)
}

/// Model S taught from photos.
pub(crate) fn taught(demonstrations: &[Demonstration]) -> GraspModel {
    let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
    teach(demonstrations, &options, &mut |_| ControlFlow::Continue(())).unwrap().model
}

/// Model S taught from a photo of this size.
pub(crate) fn model(size: [u32; 2]) -> GraspModel {
    taught(&[demonstration(size)])
}
