//! A grasp from above, as seen in the image.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::{Angle, GraspLine, Keypoint};

/// A top grasp in pixels: position of the gripper's centre, angle and opening.
///
/// The angle is the direction of the marked line from start to end; the jaws close across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlanarGrasp {
    /// Pixels to the right.
    pub x: f64,
    /// Pixels down.
    pub y: f64,
    /// Direction of the marked line, y down.
    pub angle: Angle,
    /// The part's width between the jaws, in pixels.
    pub width: f64,
}

impl PlanarGrasp {
    /// The grasp described by a marked line.
    pub fn from_line(line: &GraspLine, width: f64) -> Self {
        let center = line.center();
        Self { x: center.x, y: center.y, angle: line.angle(), width }
    }

    /// Computes the grasp from keypoints on a line: the centre is their mean, the angle is the direction of the
    /// least-squares line, from the first keypoints to the last. Unlabelled keypoints are ignored.
    ///
    /// `None` when fewer than two labelled keypoints remain or when they all coincide.
    ///
    /// # Source
    /// Paper, section IV-C. The original takes the most frequent whole degree and shifts it by an amount that depends
    /// on the angle. Total least squares with `atan2` avoids the errors of these two steps.
    pub fn from_keypoints(keypoints: &[Keypoint], width: f64) -> Option<Self> {
        let labelled: Vec<(f64, Point2<f64>)> = keypoints
            .iter()
            .enumerate()
            .filter(|(_, k)| k.is_labelled())
            .map(|(order, k)| (order as f64, k.point()))
            .collect();
        if labelled.len() < 2 {
            return None;
        }
        let n = labelled.len() as f64;
        let mean = labelled.iter().fold(nalgebra::Vector2::zeros(), |sum, (_, p)| sum + p.coords) / n;
        let mean_order = labelled.iter().map(|(order, _)| order).sum::<f64>() / n;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut forward = nalgebra::Vector2::zeros();
        for (order, p) in &labelled {
            let d = p.coords - mean;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
            forward += d * (order - mean_order);
        }
        if xx + yy <= f64::EPSILON * n {
            return None;
        }
        // The principal axis of the scatter is the line with the least squared distances.
        let axis = 0.5 * (2.0 * xy).atan2(xx - yy);
        let along = axis.cos() * forward.x + axis.sin() * forward.y;
        let angle = Angle::from_radians(if along < 0.0 { axis + std::f64::consts::PI } else { axis });
        Some(Self { x: mean.x, y: mean.y, angle, width })
    }

    /// The centre.
    pub fn center(&self) -> Point2<f64> {
        Point2::new(self.x, self.y)
    }

    /// The inner faces of the two jaws: centre ± half the width, across the marked line.
    pub fn jaws(&self) -> [Point2<f64>; 2] {
        let (sin, cos) = self.angle.radians().sin_cos();
        let across = nalgebra::Vector2::new(-sin, cos) * (0.5 * self.width);
        [self.center() - across, self.center() + across]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_line_upwards_is_minus_ninety_degrees() {
        let line = GraspLine::new(Point2::new(50.0, 80.0), Point2::new(50.0, 20.0));
        let grasp = PlanarGrasp::from_keypoints(&line.keypoints(12), 10.0).unwrap();
        assert!((grasp.angle.degrees() + 90.0).abs() < 1e-9);
        assert!((grasp.y - 50.0).abs() < 1e-9);
    }

    #[test]
    fn jaws_stand_across_the_line() {
        let grasp = PlanarGrasp { x: 5.0, y: 5.0, angle: Angle::ZERO, width: 4.0 };
        assert_eq!(grasp.jaws(), [Point2::new(5.0, 3.0), Point2::new(5.0, 7.0)]);
    }

    #[test]
    fn one_place_has_no_direction() {
        let same = vec![Keypoint::visible(Point2::new(3.0, 3.0)); 12];
        assert_eq!(PlanarGrasp::from_keypoints(&same, 1.0), None);
    }

    proptest! {
        #[test]
        fn recovers_any_direction(degrees in -179.9..180.0f64, x in 0.0..640.0f64, y in 0.0..480.0f64) {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let half = nalgebra::Vector2::new(cos, sin) * 30.0;
            let center = Point2::new(x, y);
            let line = GraspLine::new(center - half, center + half);
            let grasp = PlanarGrasp::from_keypoints(&line.keypoints(12), 1.0).unwrap();
            prop_assert!(grasp.angle.distance(Angle::from_degrees(degrees)) < 1e-9);
            prop_assert!((grasp.center() - center).norm() < 1e-9);
        }
    }
}
