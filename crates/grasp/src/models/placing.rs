//! The pose of a demonstration from a detection: the demonstration that fits the box best, and the pose that fills a
//! box at a known angle.

use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity};

use crate::facts::TurnSource;
use crate::taught::TaughtDemonstration;

/// A detection converted to a pose of a demonstration.
#[derive(Debug, Clone, Copy)]
pub(super) struct PoseReading {
    pub(super) demonstration_idx: usize,
    pub(super) image_from_cutout: PlanarSimilarity,
    pub(super) turn_source: TurnSource,
}

/// The demonstration that fills the detected box best at `pose`.
pub(super) fn nearest_demonstration(
    demonstrations: &[TaughtDemonstration],
    bbox: &BoundingBox,
    pose: impl Fn(usize, &TaughtDemonstration) -> Option<(PlanarSimilarity, TurnSource)>,
) -> Option<PoseReading> {
    demonstrations
        .iter()
        .enumerate()
        .filter_map(|(demonstration_idx, demonstration)| {
            let (image_from_cutout, turn_source) = pose(demonstration_idx, demonstration)?;
            let overlap = demonstration.outline(&image_from_cutout).bounds().iou(bbox);
            Some((PoseReading { demonstration_idx, image_from_cutout, turn_source }, overlap))
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(reading, _)| reading)
}

/// The demonstration rotated so that its grasp line points to `grasp_angle`, then scaled and shifted so that its
/// outline fills `bbox`.
///
/// A rotation does not map the centre of a part's upright box to the centre of the rotated part's upright box.
/// Therefore the outline is rotated first, and the box of the rotated outline is laid over the detected one. The grasp
/// then has the taught offset from the box's centre at every angle.
pub(super) fn fill_box(
    demonstration: &TaughtDemonstration,
    bbox: &BoundingBox,
    grasp_angle: Angle,
) -> PlanarSimilarity {
    let turn = grasp_angle - demonstration.marks.grasp.angle();
    let pivot = demonstration.marks.bbox.center();
    let turned = PlanarSimilarity::about(pivot, pivot, turn, 1.0);
    let bounds = demonstration.outline(&turned).bounds();
    let scale = (bbox.area() / bounds.area()).sqrt();
    PlanarSimilarity::about(bounds.center(), bbox.center(), Angle::ZERO, scale).compose(&turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taught_marks::TaughtMarks;
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_geometry::{GraspLine, Polygon};

    /// A bright L on a dark cut-out, grasped at the longer leg, away from the centre of its box.
    fn demonstration() -> TaughtDemonstration {
        let corners = [(20.0, 20.0), (120.0, 20.0), (120.0, 40.0), (40.0, 40.0), (40.0, 90.0), (20.0, 90.0)];
        let outline = Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() };
        let cutout = RgbImage::from_fn(140, 110, |x, y| {
            let inside = outline.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            Rgb([if inside { 220 } else { 40 }; 3])
        });
        let marks = TaughtMarks {
            label: "L".into(),
            bbox: outline.bounds(),
            grasp: GraspLine::new(Point2::new(80.0, 30.0), Point2::new(110.0, 30.0)),
            outline: Some(outline),
            width_px: 20.0,
            photo_size: None,
            photo_middle: None,
        };
        TaughtDemonstration::from_parts(cutout, marks).unwrap()
    }

    #[test]
    fn the_box_and_the_turn_give_the_pose_back() {
        let demonstration = demonstration();
        for degrees in [0.0, 30.0, 137.0, -100.0] {
            let truth = PlanarSimilarity::about(
                Point2::new(70.0, 55.0),
                Point2::new(300.0, 200.0),
                Angle::from_degrees(degrees),
                1.2,
            );
            let bbox = demonstration.outline(&truth).bounds();
            let found = fill_box(&demonstration, &bbox, Angle::from_degrees(degrees));
            let (grasp, expected) = (demonstration.grasp(&found), demonstration.grasp(&truth));
            assert!((grasp.center() - expected.center()).norm() < 1e-6, "{degrees}: {grasp:?} {expected:?}");
            assert!(grasp.angle.distance(expected.angle) < 1e-9 && (grasp.width - expected.width).abs() < 1e-6);
        }
    }
}
