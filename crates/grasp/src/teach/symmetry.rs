//! Parts that look the same at several rotations.
//!
//! A sample's record contains the part's rotation, which the picture of a symmetric part does not show. A network
//! trained on this rotation would learn the mean of the rotations, and a validation would count correct answers as
//! wrong. Therefore keypoints are taught at their positions for the smallest equivalent rotation, and invisible
//! rotations are not errors.

use nalgebra::Point2;
use sdg_demonstration::{Demonstration, Sample};
use sdg_geometry::{Angle, Keypoint, PlanarGrasp, PlanarSimilarity, RotationalSymmetry, Visibility};

/// The symmetry of the part in some demonstrations.
pub(crate) struct HiddenTurns {
    symmetry: RotationalSymmetry,
    /// The rotation centre of the part in each demonstration, in pixels of its photo.
    centers: Vec<Point2<f64>>,
}

impl HiddenTurns {
    pub(crate) fn new(demonstrations: &[Demonstration], symmetry: RotationalSymmetry) -> Self {
        Self { symmetry, centers: demonstrations.iter().map(|d| d.annotation.region().centroid()).collect() }
    }

    /// The sample with its ground truth at the smallest equivalent rotation from the demonstration.
    pub(super) fn canonical(&self, mut sample: Sample) -> Sample {
        if self.symmetry == RotationalSymmetry::None {
            return sample;
        }
        let (width, height) = (f64::from(sample.image.width()), f64::from(sample.image.height()));
        for object in &mut sample.objects {
            let pose = object.image_from_demonstration;
            let center = pose.apply(&self.centers[object.demonstration_idx]);
            let back = PlanarSimilarity::about(center, center, self.symmetry.visible(pose.angle) - pose.angle, 1.0);
            object.image_from_demonstration = back.compose(&pose);
            for keypoint in &mut object.keypoints {
                let at = back.apply(&keypoint.point());
                let inside = (0.0..=width).contains(&at.x) && (0.0..=height).contains(&at.y);
                // An object in front of the part was not rotated with it; it is unknown whether the object covers this
                // place.
                *keypoint = match inside {
                    true => Keypoint::visible(at),
                    false => Keypoint { x: at.x, y: at.y, visibility: Visibility::Unlabelled },
                };
            }
        }
        sample
    }

    /// The equivalent of `grasp` with the smallest rotation from the true grasp. `image_from_demonstration` is the pose
    /// of the demonstration `demonstration_idx`.
    pub(crate) fn nearest(
        &self,
        grasp: &PlanarGrasp,
        true_angle: Angle,
        demonstration_idx: usize,
        image_from_demonstration: &PlanarSimilarity,
    ) -> PlanarGrasp {
        let turn = grasp.angle - true_angle;
        let hidden = turn - self.symmetry.visible(turn);
        let center = image_from_demonstration.apply(&self.centers[demonstration_idx]);
        let moved = PlanarSimilarity::about(center, center, -hidden, 1.0).apply(&grasp.center());
        PlanarGrasp { x: moved.x, y: moved.y, angle: grasp.angle - hidden, width: grasp.width }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use sdg_demonstration::{Annotation, AugmentationConfig, Augmenter};
    use sdg_geometry::{BoundingBox, GraspLine};

    /// A square grasped beside its centre.
    fn square() -> Demonstration {
        let bbox = BoundingBox { x1: 60.0, y1: 40.0, x2: 120.0, y2: 100.0 };
        let grasp = Some(GraspLine::new(Point2::new(110.0, 60.0), Point2::new(110.0, 80.0)));
        let annotation = Annotation { label: "square".into(), bbox, grasp, jaw_width: None, outline: None };
        Demonstration { image: RgbImage::new(180, 140), annotation }
    }

    #[test]
    fn samples_are_turned_by_no_more_than_can_be_seen() {
        let augmenter = Augmenter::new(&[square()], AugmentationConfig::default(), 3).unwrap();
        for (symmetry, max_degrees) in
            [(RotationalSymmetry::Fold(4), 45.0), (RotationalSymmetry::Full, 1e-9), (RotationalSymmetry::None, 180.0)]
        {
            let turns = HiddenTurns::new(&[square()], symmetry);
            for i in 0..20 {
                for object in turns.canonical(augmenter.sample(i)).objects {
                    let pose = object.image_from_demonstration;
                    assert!(pose.angle.degrees().abs() <= max_degrees + 1e-9, "{symmetry:?} {pose:?}");
                    // The keypoints moved with the pose; the warp tilts slightly.
                    let truth = pose.apply(&square().annotation.grasp.unwrap().start);
                    assert!((object.keypoints[0].point() - truth).norm() < 12.0, "{symmetry:?} {:?}", object.keypoints);
                }
            }
        }
    }

    #[test]
    fn a_grasp_a_quarter_turn_round_is_the_same_one() {
        let truth = PlanarGrasp::from_line(&square().annotation.grasp.unwrap(), 60.0);
        // The centre is (90, 70): a rotation by 90° maps (110, 70) to (90, 90).
        let turned = PlanarGrasp { x: 90.0, y: 90.0, angle: truth.angle + Angle::from_degrees(92.0), width: 60.0 };
        let nearest = |symmetry| {
            HiddenTurns::new(&[square()], symmetry).nearest(&turned, truth.angle, 0, &PlanarSimilarity::IDENTITY)
        };
        let found = nearest(RotationalSymmetry::Fold(4));
        assert!((found.center() - truth.center()).norm() < 1e-9, "{found:?}");
        assert!((found.angle.distance(truth.angle).to_degrees() - 2.0).abs() < 1e-9);
        assert!(nearest(RotationalSymmetry::Full).angle.distance(truth.angle) < 1e-9);
        assert_eq!(nearest(RotationalSymmetry::None).center(), turned.center());
    }
}
