//! The use of the comparison network in a detection: it decides whether the image under a pose resembles the
//! demonstration.
//!
//! The pose of a part with similar ends is often rotated by 180°, and keypoints on a short grasp line give little
//! information about the ends of a long part. Therefore the model's pose is compared unchanged, and also fitted into
//! the detected box in its direction and in the opposite one. The most likely poses are then corrected by the positions
//! at which the network finds the demonstration's features. All candidates are compared again in views of twice the
//! resolution, where the similarity of the features also counts.

use image::RgbImage;
use sdg_comparison::{Comparison, ComparisonNetwork, Pyramid, Reference, View};
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::parallel;

use super::candidate::PoseCandidate;
use super::consistency::ComparisonEvidence;
use super::placing::fill_box;
use crate::taught::TaughtDemonstration;

/// Maximum number of compared candidates of an image: those with the highest scores before the comparison. Each takes
/// three to six views. In the paper's protocol, a maximum of 16 found no further part, and 616 of the 3200 pictures had
/// five candidates or more.
const MAX_COMPARED: usize = 5;
/// Maximum number of candidates of an image whose poses are corrected before their features are compared at high
/// resolution: the most likely ones. A maximum of four found no further part.
const MAX_CORRECTED: usize = 2;
/// Maximum number of candidates of an image that are also compared rotated by 180° at high resolution: the most likely
/// ones. Such a view takes four times as long as one at the first resolution.
const MAX_TURNED: usize = 2;

/// Evaluates the network on one picture.
pub(super) struct Comparer<'a> {
    network: &'a ComparisonNetwork,
    picture: Pyramid<'a>,
    /// Width and height of the whole picture.
    picture_size: [u32; 2],
    demonstrations: &'a [TaughtDemonstration],
}

/// A candidate and the network's output for its pose.
type Compared = (PoseCandidate, Comparison);

impl<'a> Comparer<'a> {
    /// Prepares `image`, which may be a region of a picture of `picture_size`.
    pub(super) fn new(
        network: &'a ComparisonNetwork,
        image: &'a RgbImage,
        picture_size: [u32; 2],
        demonstrations: &'a [TaughtDemonstration],
    ) -> Self {
        Self { network, picture: Pyramid::new(image), picture_size, demonstrations }
    }

    /// The best of these candidates, each in its most likely pose and with its score, best first. The input must be
    /// sorted in the same way.
    pub(super) async fn compare(&self, mut candidates: Vec<PoseCandidate>) -> Vec<PoseCandidate> {
        candidates.truncate(MAX_COMPARED);
        let likely = candidates.into_iter().map(|one| {
            let poses = likely_poses(self.demonstration(&one), &one);
            (one, poses)
        });
        let mut compared = self.likeliest(likely.collect()).await;
        best_first(&mut compared, |(one, _)| one);

        let corrected: Vec<_> = compared
            .iter()
            .take(MAX_CORRECTED)
            .map(|(one, comparison)| {
                let pose = self.reference(one).corrected(&one.image_from_cutout, &comparison.alignment().offset);
                (one.clone(), vec![pose])
            })
            .collect();
        let corrected = self.likeliest(corrected).await;
        for (one, corrected) in compared.iter_mut().zip(corrected) {
            if corrected.0.network_score >= one.0.network_score {
                *one = corrected;
            }
        }
        let mut aligned = self.aligned(compared).await;
        best_first(&mut aligned, |one| one);
        aligned
    }

    /// Each candidate in its most likely pose; of equally likely poses, the first.
    async fn likeliest(&self, candidates: Vec<(PoseCandidate, Vec<PlanarSimilarity>)>) -> Vec<Compared> {
        let poses = |(one, poses): &(PoseCandidate, Vec<PlanarSimilarity>)| -> Vec<(&Reference, PlanarSimilarity)> {
            poses.iter().map(|pose| (self.reference(one), *pose)).collect()
        };
        let views = self.views(&candidates.iter().flat_map(poses).collect::<Vec<_>>());
        let mut comparisons = self.network.compare(&views).await.into_iter();
        let likeliest = |(one, poses): (PoseCandidate, Vec<PlanarSimilarity>)| {
            let demonstration = self.demonstration(&one);
            let in_pose = |(pose, comparison): (PlanarSimilarity, Comparison)| {
                let evidence = ComparisonEvidence { log_odds: comparison.log_odds, cosine: None };
                (one.clone().in_pose(demonstration, pose, self.picture_size, Some(evidence)), comparison)
            };
            let in_poses = poses.into_iter().zip(comparisons.by_ref()).map(in_pose);
            in_poses.reduce(|best, other| if other.0.network_score > best.0.network_score { other } else { best })
        };
        candidates.into_iter().filter_map(likeliest).collect()
    }

    /// Each candidate at the position of the part's features in views of twice the resolution, with a score that
    /// includes the similarity of the features. The first [`MAX_TURNED`] candidates, which must be the most likely
    /// ones, are rotated by 180° if the features are then more similar.
    async fn aligned(&self, compared: Vec<Compared>) -> Vec<PoseCandidate> {
        let reference = |one: &PoseCandidate| self.demonstration(one).finer_reference(self.network.config());
        let ways = |(idx, (one, _)): (usize, &Compared)| match idx {
            ..MAX_TURNED => vec![one.image_from_cutout, turned(self.demonstration(one), &one.image_from_cutout)],
            _ => vec![one.image_from_cutout],
        };
        let poses: Vec<Vec<PlanarSimilarity>> = compared.iter().enumerate().map(ways).collect();
        let in_poses = |((one, _), poses): (&Compared, &Vec<PlanarSimilarity>)| -> Vec<(&Reference, PlanarSimilarity)> {
            poses.iter().map(|pose| (reference(one), *pose)).collect()
        };
        let views = self.views(&compared.iter().zip(&poses).flat_map(in_poses).collect::<Vec<_>>());
        let mut alignments = self.network.align(&views).await.into_iter();
        let aligned = |((one, comparison), poses): (Compared, Vec<PlanarSimilarity>)| {
            let ways = poses.into_iter().zip(alignments.by_ref());
            let (pose, alignment) =
                ways.reduce(|best, other| if other.1.cosine > best.1.cosine { other } else { best })?;
            let pose = reference(&one).corrected(&pose, &alignment.offset);
            let evidence = ComparisonEvidence { log_odds: comparison.log_odds, cosine: Some(alignment.cosine) };
            let demonstration = self.demonstration(&one);
            Some(one.in_pose(demonstration, pose, self.picture_size, Some(evidence)))
        };
        compared.into_iter().zip(poses).filter_map(aligned).collect()
    }

    fn views(&self, poses: &[(&Reference, PlanarSimilarity)]) -> Vec<View> {
        parallel::map(poses, |(reference, pose)| reference.view(&self.picture, pose))
    }

    fn demonstration(&self, candidate: &PoseCandidate) -> &'a TaughtDemonstration {
        &self.demonstrations[candidate.demonstration_idx]
    }

    fn reference(&self, candidate: &PoseCandidate) -> &'a Reference {
        self.demonstration(candidate).reference(self.network.config())
    }
}

/// Sorts by score; a stable sort.
pub(super) fn best_first<T>(candidates: &mut [T], candidate: impl Fn(&T) -> &PoseCandidate) {
    candidates.sort_by(|a, b| candidate(b).network_score.total_cmp(&candidate(a).network_score));
}

/// The pose rotated by 180° about the centre of the marked box.
fn turned(demonstration: &TaughtDemonstration, pose: &PlanarSimilarity) -> PlanarSimilarity {
    let center = demonstration.marks.bbox.center();
    pose.compose(&PlanarSimilarity::about(center, center, Angle::from_degrees(180.0), 1.0))
}

/// The model's pose; the pose fitted into the box in the same direction, if it differs; the pose fitted into the box in
/// the opposite direction.
fn likely_poses(demonstration: &TaughtDemonstration, read: &PoseCandidate) -> Vec<PlanarSimilarity> {
    /// Maximum distance of a point between two poses that count as one, as a fraction of the box's diagonal.
    const MAX_DISTANCE: f64 = 0.01;
    let PoseCandidate { bbox, grasp, image_from_cutout, .. } = read;
    let laid = fill_box(demonstration, bbox, grasp.angle);
    let opposite = fill_box(demonstration, bbox, grasp.angle + Angle::from_degrees(180.0));
    let marked = demonstration.marks.bbox;
    let is_read = [(marked.x1, marked.y1), (marked.x2, marked.y2)].into_iter().all(|(x, y)| {
        let corner = nalgebra::Point2::new(x, y);
        let apart = (laid.apply(&corner) - image_from_cutout.apply(&corner)).norm();
        apart <= MAX_DISTANCE * bbox.width().hypot(bbox.height())
    });
    if is_read { vec![*image_from_cutout, opposite] } else { vec![*image_from_cutout, laid, opposite] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::TurnSource;
    use crate::teach::tests::demonstration;
    use nalgebra::Point2;

    #[test]
    fn both_directions_fill_the_box_and_what_was_read_comes_first() {
        let taught = TaughtDemonstration::new(&demonstration()).unwrap();
        let (from, to) = (taught.marks.bbox.center(), Point2::new(200.0, 140.0));
        let pose = PlanarSimilarity::about(from, to, Angle::from_degrees(33.0), 1.1);
        let bbox = taught.outline(&pose).bounds();
        let read = |image_from_cutout: PlanarSimilarity| PoseCandidate {
            class_probability: 0.9,
            network_score: 0.9,
            bbox,
            keypoints: Vec::new(),
            grasp: taught.grasp(&image_from_cutout),
            demonstration_idx: 0,
            image_from_cutout,
            turn_source: TurnSource::Keypoints,
        };
        let likely = likely_poses(&taught, &read(pose));
        assert_eq!((likely.len(), likely[0]), (2, pose));
        assert!(taught.outline(&likely[1]).bounds().iou(&bbox) > 0.999);
        assert!((likely[1].angle.distance(pose.angle).to_degrees() - 180.0).abs() < 1e-9);
        // A pose that is too small is also fitted into its box.
        let small = PlanarSimilarity::about(from, to, Angle::from_degrees(33.0), 0.8);
        let likely = likely_poses(&taught, &read(small));
        assert_eq!((likely.len(), likely[0]), (3, small));
        assert!((likely[1].apply(&from) - pose.apply(&from)).norm() < 1e-6 && (likely[1].scale - 1.1).abs() < 1e-9);
    }
}
