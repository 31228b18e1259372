//! The grasp model: its taught data, and detection in an image.
//!
//! ```text
//! RgbImage ─┬─ Network: detections, each a pose of the demonstration ───────── laid over the image, refined ─┐
//!           └─ search: the demonstration searched in the whole image ─────────────────────────────────────────┤
//!                                    PlanarGrasp, score ─ the best of those on one part ─ verdict ─ evidence ─┘
//! ```

use std::ops::RangeInclusive;

use burn::tensor::{Device, read_sync};
use image::RgbImage;
use sdg_geometry::Slant;
use sdg_shape::SearchConfig;

use crate::check_config::CheckConfig;
use crate::detection::{Found, GraspDetection, Placement};
use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts};
use crate::models::{Network, PoseCandidate, Proposals};
use crate::region::SearchRegion;
use crate::same_part::{SAME_PART_IOU, are_outlines_of_same_part};
use crate::score_calibration::ScoreCalibration;
use crate::search_window::{SearchWindow, check_region};
use crate::sighting::{Sighting, sightings};
use crate::slanted::{LevelImage, explains_more, suggested_slant};
use crate::taught::TaughtDemonstration;
use crate::verdict::{Clues, Contributions, judge_picture, judge_picture_of_sequence, with_size};
use crate::verification::{PlacedDemonstration, SearchedImage, Shot, search};

/// Minimum length of the shorter side of an image, in pixels. Chosen by hand, not measured: larger than the minimum
/// side of a pyramid level, 24 pixels.
const MIN_SIDE_PX: u32 = 32;

/// A grasp model: taught from demonstrations, finds planar grasps.
#[derive(Debug, Clone)]
pub struct GraspModel {
    pub(crate) preset: String,
    /// `None` for model S.
    pub(crate) network: Option<Network>,
    pub(crate) demonstrations: Vec<TaughtDemonstration>,
    pub(crate) score_calibration: ScoreCalibration,
    pub(crate) facts: TeachingFacts,
}

/// Whether the demonstration is laid over detections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Verification {
    /// Every detection is refined and scored with the demonstration.
    #[default]
    ByShape,
    /// Score and pose come from the network alone. The search of model S, which has no network, is unchanged.
    Off,
}

impl GraspModel {
    /// The grasp model's kind.
    pub fn kind(&self) -> ModelKind {
        self.network.as_ref().map_or(ModelKind::S, Network::kind)
    }

    /// The model with its network used as that of another kind; `None` if the two kinds are not taught in the same way
    /// (see [`ModelKind::taught_as`]). The calibration is kept, although it was fitted to the errors of the first kind.
    pub fn read_as(self, kind: ModelKind) -> Option<Self> {
        if self.kind() == kind {
            return Some(self);
        }
        let network = self.network?.read_as(kind)?;
        Some(Self { network: Some(network), ..self })
    }

    /// The preset's name.
    pub fn preset(&self) -> &str {
        &self.preset
    }

    /// The object's name.
    pub fn object(&self) -> &str {
        &self.demonstrations[0].marks.label
    }

    /// How the model was taught, and its measured quality.
    pub fn facts(&self) -> &TeachingFacts {
        &self.facts
    }

    /// The demonstrations, cropped to the part.
    pub fn demonstrations(&self) -> &[TaughtDemonstration] {
        &self.demonstrations
    }

    /// Moves the network to another device.
    pub fn to_device(mut self, device: &Device) -> Self {
        self.network = self.network.map(|network| network.moved_to(device));
        self
    }

    /// The model with `num_points` edge points compared at each pose in the search of a whole image; taught models use
    /// 64. The calibration is unchanged.
    ///
    /// # Errors
    /// A number of points outside 8 to 1024.
    pub fn with_search_points(self, num_points: usize) -> Result<Self> {
        self.with_check(|check| check.search.num_points = num_points)
    }

    /// The model with other bounds of a part's size relative to the nominal size; the bounds given at teaching remain
    /// in the model's file.
    ///
    /// # Errors
    /// Bounds that do not lie within 0.5 to 1 and 1 to 2.
    pub fn with_size_tolerance(self, tolerance: RangeInclusive<f64>) -> Result<Self> {
        self.with_check(|check| check.search.scales = tolerance.clone())
    }

    /// The model with another maximum number of parts in a picture; the default is 100. A search for more takes longer.
    ///
    /// # Errors
    /// [`GraspError::InvalidConfig`] for 0.
    pub fn with_max_detections(self, max_detections: usize) -> Result<Self> {
        if max_detections == 0 {
            return Err(GraspError::InvalidConfig { name: "most detections", expected: "at least 1", found: 0.0 });
        }
        self.with_check(|check| {
            check.max_detections = max_detections;
            // All matches are scored before the best ones are kept. More parts need more starts in proportion.
            check.search.max_matches = max_detections.max(CheckConfig::DEFAULT_MAX_DETECTIONS);
            let max_starts = SearchConfig::DEFAULT_MAX_STARTS.saturating_mul(check.search.max_matches);
            check.search.max_starts =
                (max_starts / CheckConfig::DEFAULT_MAX_DETECTIONS).min(SearchConfig::LARGEST_MAX_STARTS);
        })
    }

    /// The model restricted to this region of pictures; `None` for whole pictures. The region is part of the model's
    /// file.
    ///
    /// # Errors
    /// A region without pixels. A region that names the size of its pictures must also lie within them and be large
    /// enough for the part; other regions are checked with each picture.
    pub fn with_region(mut self, region: Option<SearchRegion>) -> Result<Self> {
        if self.facts.region == region {
            return Ok(self);
        }
        if let Some(region) = &region {
            // A model with known lengths has plan views as demonstrations, whose pixels are not the picture's.
            check_region(region, self.facts.lengths.is_none().then_some(&self.demonstrations))?;
        }
        self.facts.region = region;
        Ok(self)
    }

    /// The searched region of pictures; `None` for whole pictures.
    pub fn region(&self) -> Option<&SearchRegion> {
        self.facts.region.as_ref()
    }

    /// The model without the measured height of its edges: positions are not corrected.
    #[must_use]
    pub fn without_edge_height(mut self) -> Self {
        if let Some(lengths) = &mut self.facts.lengths {
            lengths.edges = None;
        }
        self
    }

    /// The model for plan views of its demonstrations' resolution.
    pub(crate) fn of_known_size(self) -> Result<Self> {
        let mut model = self.with_check(|check| {
            check.search.scales = CheckConfig::KNOWN_SIZE_TOLERANCE;
            check.score = check.score.of_known_size();
        })?;
        // A plan view has the same number of pixels per metre for any number of pixels.
        model.demonstrations.iter_mut().for_each(|demonstration| demonstration.marks.photo_size = None);
        Ok(model)
    }

    /// The searched bounds of a part's size relative to the nominal size.
    pub fn size_tolerance(&self) -> RangeInclusive<f64> {
        self.demonstrations[0].check().search.scales.clone()
    }

    /// The range of a part's size in held-out samples, relative to the photo: sizes at which it is accepted.
    pub fn held_out_sizes(&self) -> RangeInclusive<f64> {
        if self.facts.lengths.is_some() { CheckConfig::KNOWN_SAMPLE_SIZES } else { self.size_tolerance() }
    }

    pub(crate) fn with_check(self, change: impl Fn(&mut CheckConfig)) -> Result<Self> {
        let changed = |demonstration: TaughtDemonstration| {
            let mut check = demonstration.check().clone();
            change(&mut check);
            demonstration.with_check(check)
        };
        let demonstrations = self.demonstrations.into_iter().map(changed).collect::<Result<_>>()?;
        Ok(Self { demonstrations, ..self })
    }

    /// Finds the part in an image, best score first. Detections below 0.5 are also returned, for callers that show
    /// refused detections and the reasons; see [`GraspDetection::is_accepted`].
    ///
    /// # Errors
    /// An image that is too small, or that does not fit the model's region.
    pub fn detect(&self, image: &RgbImage, verification: Verification) -> Result<Vec<GraspDetection>> {
        read_sync(self.detect_async(image, verification))
    }

    /// As [`Self::detect`] without a region, in an image cut from the middle of a picture of `whole` (width and height)
    /// pixels: the part's possible sizes and the network's input are those for the whole picture.
    ///
    /// # Errors
    /// An image that is too small.
    pub fn detect_in_middle(
        &self,
        image: &RgbImage,
        whole: [u32; 2],
        verification: Verification,
    ) -> Result<Vec<GraspDetection>> {
        let window = SearchWindow::middle_of(whole, image.dimensions().into());
        let counts = |detection: &GraspDetection| window.contains(&detection.grasp.center());
        let mut found = read_sync(self.find_in(image, &window, verification, counts))?;
        found.iter_mut().for_each(|found| window.in_window(found));
        Ok(found.into_iter().map(|found| found.detection).collect())
    }

    /// [`Self::detect`], asynchronous; for browsers, which give access to results of a graphics card only in this way.
    ///
    /// # Errors
    /// As for [`Self::detect`].
    pub async fn detect_async(&self, image: &RgbImage, verification: Verification) -> Result<Vec<GraspDetection>> {
        let found = self.find_async(image, verification).await?;
        Ok(found.into_iter().map(|found| found.detection).collect())
    }

    /// [`Self::detect_async`], with the data of each detection that tracking needs.
    pub(crate) async fn find_async(&self, image: &RgbImage, verification: Verification) -> Result<Vec<Found>> {
        let size = [image.width(), image.height()];
        let Some(region) = self.region() else {
            let counts = |detection: &GraspDetection| detection.lies_within(None, size);
            return self.find_in(image, &SearchWindow::whole(size), verification, counts).await;
        };
        region.check(size)?;
        let window = SearchWindow::about(&region.bounds(), region, size, &self.demonstrations)?;
        self.find_in(&window.cut(image), &window, verification, |detection| detection.lies_in(region)).await
    }

    /// Detections in a window of an image, in pixels of the whole image; only those for which `counts` holds.
    pub(crate) async fn find_in(
        &self,
        image: &RgbImage,
        window: &SearchWindow,
        verification: Verification,
        counts: impl Fn(&GraspDetection) -> bool,
    ) -> Result<Vec<Found>> {
        let (width, height) = image.dimensions();
        let shot = window.shot();
        if width.min(height) < MIN_SIDE_PX {
            return Err(GraspError::ImageTooSmall { least: MIN_SIDE_PX, width, height });
        }
        let mut found: Vec<Found> = match (&self.network, verification) {
            (Some(network), Verification::Off) => network
                .proposals_async(image, shot.size, &self.demonstrations)
                .await?
                .candidates
                .iter()
                .map(|c| Found { detection: self.unverified(c), placement: None })
                .collect(),
            _ => self.find_at_any_slant(image, &shot).await?,
        };
        found.iter_mut().for_each(|found| window.in_whole(found));
        found.retain(|found| counts(&found.detection));
        drop_repeated(&mut found, |found| &found.detection);
        found.truncate(self.demonstrations[0].check().max_detections);
        Ok(found)
    }

    /// Detections as seen by a level camera, or by a slanted camera if that explains the picture better.
    async fn find_at_any_slant(&self, image: &RgbImage, shot: &Shot) -> Result<Vec<Found>> {
        let (level, slant) = self.find_at_slant(image, shot, true).await?;
        let Some(made_level) = slant.and_then(|slant| LevelImage::new(image, shot, &slant)) else { return Ok(level) };
        let (found, _) = self.find_at_slant(&made_level.image, &made_level.shot(), false).await?;
        if explains_more(&each_part_once(&found), &each_part_once(&level)) {
            return Ok(found.into_iter().filter_map(|found| made_level.seen(found)).collect());
        }
        Ok(level)
    }

    /// Detections in an image as if the camera were level, and the slant suggested by the best matches if `suggest` is
    /// set.
    async fn find_at_slant(&self, image: &RgbImage, shot: &Shot, suggest: bool) -> Result<(Vec<Found>, Option<Slant>)> {
        let search = || {
            let searched = SearchedImage::of(image, shot, &self.demonstrations);
            let found = search(&searched);
            (searched, found)
        };
        let ((searched, found), proposals) = self.beside_network(image, shot, search).await;
        let sightings = sightings(&proposals?, &found, &searched);
        let is_asked = suggest && !self.demonstrations[0].check().score.is_size_known;
        let slant = if is_asked { suggested_slant(image, shot, &sightings, &searched) } else { None };
        Ok((self.judged(sightings), slant))
    }

    /// The network's boxes and candidates, and the result of `work`, which is done meanwhile.
    #[cfg(not(target_arch = "wasm32"))]
    async fn beside_network<R: Send>(
        &self,
        image: &RgbImage,
        shot: &Shot,
        work: impl FnOnce() -> R + Send,
    ) -> (R, Result<Proposals>) {
        let Some(network) = &self.network else { return (work(), Ok(Proposals::default())) };
        sdg_shape::parallel::join(work, || read_sync(network.proposals_async(image, shot.size, &self.demonstrations)))
    }

    /// The network's boxes and candidates, and the result of `work`, one after the other: a browser has one thread.
    #[cfg(target_arch = "wasm32")]
    async fn beside_network<R>(
        &self,
        image: &RgbImage,
        shot: &Shot,
        work: impl FnOnce() -> R,
    ) -> (R, Result<Proposals>) {
        let Some(network) = &self.network else { return (work(), Ok(Proposals::default())) };
        let proposals = network.proposals_async(image, shot.size, &self.demonstrations).await;
        (work(), proposals)
    }

    fn unverified(&self, candidate: &PoseCandidate) -> GraspDetection {
        GraspDetection {
            demonstration_idx: candidate.demonstration_idx,
            score: self.score_calibration.network.apply(candidate.network_score),
            network_score: candidate.network_score,
            agreement: None,
            evidence: None,
            bbox: candidate.bbox,
            keypoints: candidate.keypoints.clone(),
            outline: None,
            grasp: candidate.grasp,
            turn_source: candidate.turn_source,
            light: 1.0,
        }
    }

    /// Scores the sightings of one picture together.
    fn judged(&self, sightings: Vec<Sighting<'_>>) -> Vec<Found> {
        let clues: Vec<Clues> = sightings.iter().map(|sighting| self.clues(sighting)).collect();
        let judged = judge_picture(&clues, &self.demonstrations[0].check().score);
        let num_keypoints = self.num_keypoints();
        sightings
            .into_iter()
            .zip(judged)
            .map(|(sighting, (score, evidence))| {
                let placement = Placement::of(&sighting);
                Found { detection: sighting.detection(score, evidence, num_keypoints), placement: Some(placement) }
            })
            .collect()
    }

    /// The verdict's inputs for a sighting.
    pub(crate) fn clues(&self, sighting: &Sighting<'_>) -> Clues {
        let PlacedDemonstration { demonstration_idx, evidence, image_from_cutout, .. } = sighting.placed;
        let network = self.score_calibration.log_likelihood_ratio(sighting.network_score);
        let resemblance = self.score_calibration.resemblance;
        Clues { demonstration_idx, evidence, log_size: image_from_cutout.scale.ln(), network, resemblance }
    }

    /// The scores of all sightings in one picture of a sequence. `earlier_log_sizes` are the sizes of parts in earlier
    /// pictures, by demonstration, as in [`Clues::log_size`].
    pub(crate) fn judge_in_sequence(
        &self,
        clues: &[Clues],
        earlier_log_sizes: &[(usize, f64)],
    ) -> Vec<(f64, Contributions)> {
        judge_picture_of_sequence(clues, earlier_log_sizes, &self.demonstrations[0].check().score)
    }

    /// The verdict on a detection with this evidence, but with another contribution of the size.
    pub(crate) fn verdict_with_size(&self, evidence: Contributions, size: f64) -> (f64, Contributions) {
        with_size(evidence, size, &self.demonstrations[0].check().score)
    }

    /// Number of keypoints of a detection of this model.
    pub(crate) fn num_keypoints(&self) -> usize {
        if self.kind().has_keypoints() { crate::NUM_KEYPOINTS } else { 0 }
    }
}

/// Sorts, best score first, and keeps the best of several detections of the same part, which is recognised by the
/// overlap of outlines or, without outlines, of boxes. Of detections that converged to the same pose, the one with the
/// highest network score is kept, so that the result does not depend on the last bits of the scores.
fn drop_repeated<T>(found: &mut Vec<T>, detection: impl Fn(&T) -> &GraspDetection) {
    // Chosen by hand: above the rounding of single precision, below any difference that distinguishes poses.
    const SAME_SCORE: f64 = 1e-4;
    found.sort_by(|a, b| detection(b).score.total_cmp(&detection(a).score));
    let mut kept: Vec<T> = Vec::with_capacity(found.len());
    for next in found.drain(..) {
        match kept.iter_mut().find(|better| are_of_same_part(detection(better), detection(&next))) {
            None => kept.push(next),
            Some(better) => {
                let (one, other) = (detection(better), detection(&next));
                let as_good = one.score - other.score < SAME_SCORE;
                if as_good && other.network_score > one.network_score {
                    *better = next;
                }
            }
        }
    }
    *found = kept;
}

/// The detections of [`drop_repeated`]: network and search can each find the same part.
fn each_part_once(found: &[Found]) -> Vec<&GraspDetection> {
    let mut detections: Vec<&GraspDetection> = found.iter().map(|found| &found.detection).collect();
    drop_repeated(&mut detections, |&detection| detection);
    detections
}

pub(crate) fn are_of_same_part(one: &GraspDetection, other: &GraspDetection) -> bool {
    match (&one.outline, &other.outline) {
        (Some(one), Some(other)) => are_outlines_of_same_part(one, other),
        _ => one.bbox.iou(&other.bbox) >= SAME_PART_IOU,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::TurnSource;
    use sdg_geometry::{Angle, BoundingBox, PlanarGrasp};

    fn detection(x: f64, score: f64, network_score: f64) -> GraspDetection {
        GraspDetection {
            demonstration_idx: 0,
            score,
            network_score,
            agreement: Some(score),
            evidence: None,
            bbox: BoundingBox { x1: x, y1: 0.0, x2: x + 20.0, y2: 10.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x: x + 10.0, y: 5.0, angle: Angle::from_degrees(0.0), width: 4.0 },
            turn_source: TurnSource::Keypoints,
            light: 1.0,
        }
    }

    #[test]
    fn of_repeated_detections_the_best_stays_and_of_equals_the_surest() {
        let mut found: Vec<Found> = [
            detection(0.0, 0.900_000_1, 0.1),
            detection(0.0, 0.9, 0.7),
            detection(100.0, 0.8, 0.2),
            detection(1.0, 0.7, 0.99),
        ]
        .map(|detection| Found { detection, placement: None })
        .into();
        drop_repeated(&mut found, |found| &found.detection);
        let kept: Vec<_> = found.iter().map(|kept| (kept.detection.bbox.x1, kept.detection.network_score)).collect();
        assert_eq!(kept, [(0.0, 0.7), (100.0, 0.2)]);
    }

    #[cfg(feature = "teach")]
    #[test]
    fn more_parts_than_by_default_have_more_starts() {
        let model = crate::drawn_part::model([320, 240]);
        let starts = [1, 100, 200, usize::MAX].map(|max_detections| {
            let model = model.clone().with_max_detections(max_detections).unwrap();
            model.demonstrations()[0].check().search.max_starts
        });
        assert_eq!(starts, [1024, 1024, 2048, 4096]);
    }

    #[test]
    fn parts_found_by_network_and_search_count_once_for_a_slant() {
        let found = |all: &[(f64, f64)]| -> Vec<Found> {
            let found_at = |&(x, agreement)| {
                let detection = GraspDetection { agreement: Some(agreement), ..detection(x, 0.9, 0.0) };
                Found { detection, placement: None }
            };
            all.iter().map(found_at).collect()
        };
        let level = found(&[(0.0, 0.7), (100.0, 0.7), (1.0, 0.7), (101.0, 0.7)]);
        let slanted = found(&[(0.0, 0.75), (100.0, 0.75)]);
        assert!(explains_more(&each_part_once(&slanted), &each_part_once(&level)));
        assert!(!explains_more(&each_part_once(&level), &each_part_once(&slanted)));
    }
}
