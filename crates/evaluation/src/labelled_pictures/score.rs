//! Compares detections with labels: hits, missed parts, wrong detections.
//!
//! Distances are in pixels of the picture, angles in degrees. The position of a detection is the centre of its grasp.

use std::time::Instant;

use anyhow::{Context, Result};
use nalgebra::Point2;
use sdg_cell::Perception;
use sdg_geometry::{Angle, BoundingBox, PlanarGrasp, RotationalSymmetry, percentile};
use sdg_grasp::{GraspDetection, TaughtDemonstration, Verification};
use serde::Serialize;

use super::picture::{Instance, LabelledPicture};
use crate::statistics::Share;

/// Maximum distance of a hit from the instance's marks, in diagonals of the instance.
pub(super) const MAX_DISTANCE_DIAGONALS: f64 = 0.04;
/// Maximum angle between a hit and the instance's marks.
pub(super) const MAX_ANGLE_DEG: f64 = 10.0;
/// Minimum overlap (IoU) of a detection with an optional instance that has no grasp.
const SAME_PART_IOU: f64 = 0.5;
/// The totals are computed at minimum scores from 0 to 1; this is the number of equal steps between them.
const NUM_SWEEP_STEPS: u32 = 50;

/// The ground truth of an instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// The true grasp; only an optional instance may lack it.
    pub grasp: Option<TrueGrasp>,
    pub bbox: BoundingBox,
    /// Whether the instance may be missed.
    pub optional: bool,
}

/// The true grasp of an instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueGrasp {
    /// The centre of the marks.
    pub center: Point2<f64>,
    /// The direction of the marks.
    pub angle: Angle,
    /// The diagonal of the demonstration's box, scaled to this instance's size.
    pub diagonal_px: f64,
    /// The equivalent rotations.
    pub symmetry: RotationalSymmetry,
    /// Size of a pixel at the grasp, in the plane of the marks, in metres; `None` if the camera is unknown.
    pub pixel_m: Option<f64>,
}

impl Truth {
    /// The ground truth of an instance. If the labels do not state size and symmetry, the diagonal is the length of the
    /// instance's marks times the mean ratio of diagonal to length in the demonstrations, and the symmetry is the
    /// model's.
    pub fn new(instance: &Instance, detector: &Perception) -> Self {
        let demonstrations = detector.model().demonstrations();
        let diagonal_per_length = |demonstration: &TaughtDemonstration| {
            let marks = &demonstration.marks;
            marks.bbox.width().hypot(marks.bbox.height()) / marks.grasp.length()
        };
        let mean = demonstrations.iter().map(diagonal_per_length).sum::<f64>() / demonstrations.len().max(1) as f64;
        let symmetry = detector.model().facts().symmetry;
        let grasp = instance.grasp.map(|line| TrueGrasp {
            center: line.center(),
            angle: line.angle(),
            diagonal_px: instance.extent.map_or(mean * line.length(), |extent| extent.diagonal_px),
            symmetry: instance.extent.map_or(symmetry, |extent| extent.symmetry),
            pixel_m: detector.metres_per_pixel(&line.center()),
        });
        Self { grasp, bbox: instance.bbox, optional: instance.optional }
    }
}

impl TrueGrasp {
    /// The error of a detected grasp.
    pub fn error_of(&self, grasp: &PlanarGrasp) -> HitError {
        let px = (grasp.center() - self.center).norm();
        HitError {
            px,
            mm: self.pixel_m.map(|pixel_m| 1e3 * pixel_m * px),
            percent: 100.0 * px / self.diagonal_px,
            deg: self.symmetry.distance(grasp.angle, self.angle).to_degrees(),
        }
    }
}

/// A picture and the model's detections in it, best score first.
#[derive(Debug, Clone)]
pub struct Tested {
    /// The picture and its labels.
    pub picture: LabelledPicture,
    /// The ground truth of each instance of the picture.
    pub truths: Vec<Truth>,
    /// All detections, whatever their score.
    pub detections: Vec<GraspDetection>,
    /// Duration of the detection, in seconds.
    pub seconds: f64,
}

impl Tested {
    /// Reads a picture and runs the model on it.
    ///
    /// # Errors
    /// The picture cannot be read, or detection fails.
    pub fn detect(mut picture: LabelledPicture, detector: &Perception, verification: Verification) -> Result<Self> {
        let image = sdg_inputs::read_image(&picture.path)?;
        let start = Instant::now();
        let found = detector.detect(&image, verification).with_context(|| picture.path.display().to_string())?;
        let seconds = start.elapsed().as_secs_f64();
        if let Some(region) = detector.region() {
            picture.mark_outside(&region.bounds());
        }
        let truths = picture.instances.iter().map(|instance| Truth::new(instance, detector)).collect();
        let detections = found.into_iter().map(|found| found.detection).collect();
        Ok(Self { picture, truths, detections, seconds })
    }
}

/// A detection that hits an instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub instance_idx: usize,
    /// The error of the detection; `None` for an optional instance without a grasp.
    pub error: Option<HitError>,
}

/// The error of a detection relative to the marks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HitError {
    /// Distance between the centres of both grasps, in pixels.
    pub px: f64,
    /// The distance in millimetres in the plane of the marks, if the camera is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mm: Option<f64>,
    /// The distance in percent of the instance's diagonal.
    pub percent: f64,
    /// The angle between both grasps, in degrees, at most 180.
    pub deg: f64,
}

impl HitError {
    /// Whether the position is within the tolerance.
    pub fn is_in_place(&self) -> bool {
        self.percent <= 100.0 * MAX_DISTANCE_DIAGONALS
    }

    /// Whether position and angle are within their tolerances.
    pub fn is_hit(&self) -> bool {
        self.is_in_place() && self.deg <= MAX_ANGLE_DEG
    }
}

/// The result of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// All parts were found, and no detection is wrong.
    Right,
    /// Parts were missed, and no detection is wrong.
    Missed,
    /// A detection in a picture with the part is not a hit.
    Wrong,
    /// The part is not in the picture, and nothing was detected.
    Quiet,
    /// The part is not in the picture, and something was detected.
    FalseAlarm,
}

/// The detections that count, each with its hit, if any.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The hit of each detection in [`Tested::detections`] that has at least the minimum score.
    pub hits: Vec<Option<Hit>>,
    /// Whether each instance was found.
    found: Vec<bool>,
    optional: Vec<bool>,
}

impl Judged {
    /// Whether the part is in the picture.
    pub fn has_part(&self) -> bool {
        !self.optional.is_empty()
    }

    /// Number of instances found, of all that must be found.
    pub fn parts(&self) -> Share {
        Share::of(self.found.iter().zip(&self.optional).filter(|(_, optional)| !**optional), |(found, _)| **found)
    }

    /// Number of optional instances found, of all of them.
    pub fn optional(&self) -> Share {
        Share::of(self.found.iter().zip(&self.optional).filter(|(_, optional)| **optional), |(found, _)| **found)
    }

    /// Number of parts that were not found.
    pub fn missed(&self) -> usize {
        let parts = self.parts();
        parts.of - parts.count
    }

    /// Whether an instance was found.
    pub fn is_found(&self, instance_idx: usize) -> bool {
        self.found[instance_idx]
    }

    /// Number of detections without a hit in a picture with the part.
    pub fn wrong(&self) -> usize {
        if self.has_part() { self.hits.iter().filter(|hit| hit.is_none()).count() } else { 0 }
    }

    /// Whether a picture with the part has no wrong detection, and a hit unless all instances are optional.
    pub fn is_clean(&self) -> bool {
        let has_enough = self.found.contains(&true) || self.parts().of == 0;
        self.has_part() && has_enough && self.wrong() == 0
    }

    /// Whether a picture without the part has a detection.
    pub fn is_false_alarm(&self) -> bool {
        !self.has_part() && !self.hits.is_empty()
    }

    /// The result of the picture.
    pub fn outcome(&self) -> Outcome {
        match (self.has_part(), self.hits.is_empty()) {
            (false, true) => Outcome::Quiet,
            (false, false) => Outcome::FalseAlarm,
            (true, _) if self.wrong() > 0 => Outcome::Wrong,
            (true, _) if self.missed() > 0 => Outcome::Missed,
            (true, _) => Outcome::Right,
        }
    }

    /// Errors of the found parts; optional instances do not count.
    pub fn errors(&self) -> impl Iterator<Item = &HitError> {
        let on_parts = self.hits.iter().flatten().filter(|hit| !self.optional[hit.instance_idx]);
        on_parts.filter_map(|hit| hit.error.as_ref())
    }
}

/// Judges the detections with a score of at least `min_score`. In order of decreasing score, each takes the nearest
/// free instance that it hits. No detection takes an instance from a detection with a higher score, so a higher
/// `min_score` only removes the last hits of the list.
pub fn judge(tested: &Tested, min_score: f64) -> Judged {
    let mut found = vec![false; tested.truths.len()];
    let counted = tested.detections.iter().filter(|detection| detection.score >= min_score);
    let hits = counted.map(|detection| {
        let hit = nearest(&tested.truths, &found, &detection.grasp)
            .or_else(|| without_grasp(&tested.truths, &found, &detection.bbox))?;
        found[hit.instance_idx] = true;
        Some(hit)
    });
    let hits = hits.collect();
    Judged { hits, found, optional: tested.truths.iter().map(|truth| truth.optional).collect() }
}

/// The nearest free instance that a grasp hits, as a hit.
fn nearest(truths: &[Truth], taken: &[bool], grasp: &PlanarGrasp) -> Option<Hit> {
    let free = truths.iter().enumerate().filter(|(instance_idx, _)| !taken[*instance_idx]);
    free.filter_map(|(instance_idx, truth)| Some((instance_idx, truth.grasp?.error_of(grasp))))
        .filter(|(_, error)| error.is_hit())
        .min_by(|(_, one), (_, other)| one.px.total_cmp(&other.px))
        .map(|(instance_idx, error)| Hit { instance_idx, error: Some(error) })
}

/// The free instance without a grasp whose box overlaps the detection's box enough, as a hit.
fn without_grasp(truths: &[Truth], taken: &[bool], bbox: &BoundingBox) -> Option<Hit> {
    let is_same = |(instance_idx, truth): &(usize, &Truth)| {
        truth.grasp.is_none() && !taken[*instance_idx] && truth.bbox.iou(bbox) >= SAME_PART_IOU
    };
    let (instance_idx, _) = truths.iter().enumerate().find(is_same)?;
    Some(Hit { instance_idx, error: None })
}

/// Totals over all pictures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Totals {
    /// Parts found, of all that must be found.
    pub found: Share,
    pub missed: usize,
    /// Number of detections without a hit in pictures with the part.
    pub wrong: usize,
    pub optional: Share,
    /// Pictures with the part that are [clean](Judged::is_clean).
    pub clean: Share,
    /// Pictures without the part that have a detection.
    pub false_alarms: Share,
    /// Errors of the found parts; `None` if none was found.
    pub errors: Option<Errors>,
}

/// Errors of found parts: the median and the 95th percentile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Errors {
    pub median_px: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_mm: Option<f64>,
    pub median_percent: f64,
    pub median_deg: f64,
    pub p95_px: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p95_mm: Option<f64>,
    pub p95_percent: f64,
    pub p95_deg: f64,
}

impl Totals {
    /// Sums the results.
    pub fn of<'a>(judged: impl IntoIterator<Item = &'a Judged>) -> Self {
        let judged: Vec<&Judged> = judged.into_iter().collect();
        let (with_part, without_part): (Vec<&Judged>, Vec<&Judged>) =
            judged.iter().copied().partition(|judged| judged.has_part());
        let errors: Vec<&HitError> = judged.iter().flat_map(|judged| judged.errors()).collect();
        Self {
            found: judged.iter().map(|judged| judged.parts()).sum(),
            missed: judged.iter().map(|judged| judged.missed()).sum(),
            wrong: judged.iter().map(|judged| judged.wrong()).sum(),
            optional: judged.iter().map(|judged| judged.optional()).sum(),
            clean: Share::of(with_part, |judged| judged.is_clean()),
            false_alarms: Share::of(without_part, |judged| judged.is_false_alarm()),
            errors: Errors::of(&errors),
        }
    }
}

impl Errors {
    fn of(errors: &[&HitError]) -> Option<Self> {
        let at = |percent: f64, read: fn(&HitError) -> f64| percentile(errors.iter().map(|error| read(error)), percent);
        let mm = |percent: f64| percentile(errors.iter().filter_map(|error| error.mm), percent);
        Some(Self {
            median_px: at(50.0, |error| error.px)?,
            median_mm: mm(50.0),
            median_percent: at(50.0, |error| error.percent)?,
            median_deg: at(50.0, |error| error.deg)?,
            p95_px: at(95.0, |error| error.px)?,
            p95_mm: mm(95.0),
            p95_percent: at(95.0, |error| error.percent)?,
            p95_deg: at(95.0, |error| error.deg)?,
        })
    }
}

/// The totals for each kind of picture that the labels name, in order of first appearance.
pub fn by_kind<'a>(tested: &[&'a Tested], min_score: f64) -> Vec<(&'a str, Totals)> {
    let mut kinds: Vec<(&str, Vec<Judged>)> = Vec::new();
    for tested in tested {
        let Some(kind) = tested.picture.kind.as_deref() else { continue };
        let judged = judge(tested, min_score);
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, of_kind)) => of_kind.push(judged),
            None => kinds.push((kind, vec![judged])),
        }
    }
    kinds.into_iter().map(|(kind, judged)| (kind, Totals::of(&judged))).collect()
}

/// The totals at minimum scores from 0 to 1.
pub fn sweep(tested: &[&Tested]) -> Vec<(f64, Totals)> {
    (0..=NUM_SWEEP_STEPS)
        .map(|step| {
            let min_score = f64::from(step) / f64::from(NUM_SWEEP_STEPS);
            let judged: Vec<Judged> = tested.iter().map(|tested| judge(tested, min_score)).collect();
            (min_score, Totals::of(&judged))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_grasp::TurnSource;

    /// An instance with a diagonal of 100 pixels, so hits are within 4 pixels.
    fn truth(x: f64, degrees: f64, optional: bool) -> Truth {
        let grasp = TrueGrasp {
            center: Point2::new(x, 50.0),
            angle: Angle::from_degrees(degrees),
            diagonal_px: 100.0,
            symmetry: RotationalSymmetry::None,
            pixel_m: None,
        };
        Truth { grasp: Some(grasp), bbox: BoundingBox { x1: x - 5.0, y1: 45.0, x2: x + 5.0, y2: 55.0 }, optional }
    }

    fn detection(x: f64, degrees: f64, score: f64) -> GraspDetection {
        GraspDetection {
            demonstration_idx: 0,
            score,
            network_score: score,
            agreement: None,
            evidence: None,
            light: 1.0,
            bbox: BoundingBox { x1: x - 5.0, y1: 45.0, x2: x + 5.0, y2: 55.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x, y: 50.0, angle: Angle::from_degrees(degrees), width: 4.0 },
            turn_source: TurnSource::Search,
        }
    }

    fn tested(truths: Vec<Truth>, detections: Vec<GraspDetection>) -> Tested {
        let picture = LabelledPicture {
            path: "a.png".into(),
            labels: "a.json".into(),
            size: [640, 480],
            instances: Vec::new(),
            kind: None,
        };
        Tested { picture, truths, detections, seconds: 0.0 }
    }

    fn judged(truths: Vec<Truth>, detections: Vec<GraspDetection>) -> Judged {
        judge(&tested(truths, detections), 0.5)
    }

    #[test]
    fn a_hit_lies_within_four_percent_and_ten_degrees() {
        // The limit is inclusive; 3.9 and 9.9 avoid the rounding of the last bit.
        for (dx, turn, is_hit) in
            [(3.9, 9.9, true), (4.1, 0.0, false), (0.0, 10.1, false), (-3.9, -9.9, true), (0.0, 180.0, false)]
        {
            let found = judged(vec![truth(100.0, 175.0, false)], vec![detection(100.0 + dx, 175.0 + turn, 0.9)]);
            assert_eq!(found.parts(), Share { count: usize::from(is_hit), of: 1 }, "{dx} px, {turn} deg");
            assert_eq!((found.wrong(), found.is_clean()), (usize::from(!is_hit), is_hit));
        }
    }

    #[test]
    fn turns_that_cannot_be_seen_are_no_error() {
        let half_a_turn_off = |symmetry: RotationalSymmetry| {
            let mut truth = truth(100.0, 10.0, false);
            truth.grasp.as_mut().unwrap().symmetry = symmetry;
            judged(vec![truth], vec![detection(101.0, -172.0, 0.9)])
        };
        for (symmetry, count) in
            [(RotationalSymmetry::None, 0), (RotationalSymmetry::Fold(2), 1), (RotationalSymmetry::Full, 1)]
        {
            assert_eq!(half_a_turn_off(symmetry).parts().count, count, "{symmetry:?}");
        }
        let error = half_a_turn_off(RotationalSymmetry::Fold(2)).hits[0].unwrap().error.unwrap();
        assert!((error.deg - 2.0).abs() < 1e-9 && (error.px - 1.0).abs() < 1e-9, "{error:?}");
        assert!((error.percent - 1.0).abs() < 1e-9, "{error:?}");
    }

    #[test]
    fn one_detection_to_one_instance_from_the_best_score_on() {
        // Each detection hits both instances. The first takes the nearer instance, the second the remaining one.
        let found = judged(
            vec![truth(100.0, 0.0, false), truth(103.0, 0.0, false)],
            vec![detection(102.0, 0.0, 0.9), detection(102.5, 0.0, 0.8), detection(102.0, 0.0, 0.7)],
        );
        let order: Vec<Option<usize>> = found.hits.iter().map(|hit| hit.map(|hit| hit.instance_idx)).collect();
        assert_eq!(order, [Some(1), Some(0), None]);
        assert_eq!((found.parts(), found.wrong()), (Share { count: 2, of: 2 }, 1));
        assert_eq!(found.outcome(), Outcome::Wrong);
    }

    #[test]
    fn an_optional_instance_is_neither_missed_nor_wrong() {
        let truths = || vec![truth(100.0, 0.0, false), truth(200.0, 0.0, true)];
        let missed = judged(truths(), vec![detection(100.0, 0.0, 0.9)]);
        assert_eq!((missed.missed(), missed.wrong(), missed.outcome()), (0, 0, Outcome::Right));
        let hit = judged(truths(), vec![detection(200.0, 0.0, 0.9)]);
        assert_eq!((hit.missed(), hit.wrong(), hit.optional()), (1, 0, Share { count: 1, of: 1 }));
        // There is a hit and no wrong detection, although the part was missed. The error of the optional instance is
        // not counted.
        assert!(hit.is_clean() && hit.errors().next().is_none());
        assert_eq!(hit.outcome(), Outcome::Missed);
        // Nothing has to be found in a picture of optional instances.
        for (detections, is_clean) in
            [(Vec::new(), true), (vec![detection(200.0, 0.0, 0.9)], true), (vec![detection(300.0, 0.0, 0.9)], false)]
        {
            let judged = judged(vec![truth(200.0, 0.0, true)], detections);
            assert_eq!((judged.is_clean(), judged.outcome() == Outcome::Right), (is_clean, is_clean));
        }
        assert!(!judged(Vec::new(), Vec::new()).is_clean());
    }

    #[test]
    fn an_optional_instance_without_a_grasp_is_hit_by_its_box() {
        let box_alone = Truth { grasp: None, ..truth(200.0, 0.0, true) };
        // Boxes of 10 pixels have an overlap of 7 of 13 at a distance of 3, and of 6 of 14 at a distance of 4.
        for (x, wrong) in [(203.0, 0), (204.0, 1)] {
            let found = judged(vec![truth(100.0, 0.0, false), box_alone], vec![detection(x, 90.0, 0.9)]);
            assert_eq!((found.wrong(), found.optional().count), (wrong, 1 - wrong), "{x}");
        }
    }

    #[test]
    fn totals_count_parts_detections_and_pictures() {
        let pictures = [
            tested(vec![truth(100.0, 0.0, false)], vec![detection(101.0, 0.0, 0.9), detection(300.0, 0.0, 0.6)]),
            tested(vec![truth(100.0, 0.0, false), truth(200.0, 0.0, false)], vec![detection(203.0, 4.0, 0.7)]),
            tested(vec![truth(100.0, 0.0, false)], vec![detection(100.0, 0.0, 0.4)]),
            tested(Vec::new(), vec![detection(100.0, 0.0, 0.8), detection(150.0, 0.0, 0.7)]),
            tested(Vec::new(), vec![detection(100.0, 0.0, 0.3)]),
        ];
        let at = |min_score: f64| Totals::of(&pictures.each_ref().map(|tested| judge(tested, min_score)));
        let totals = at(0.5);
        assert_eq!((totals.found, totals.missed, totals.wrong), (Share { count: 2, of: 4 }, 2, 1));
        assert_eq!((totals.clean, totals.false_alarms), (Share { count: 1, of: 3 }, Share { count: 1, of: 2 }));
        // The errors are 1 and 3 pixels, 0 and 4 degrees; the medians are between them.
        let errors = totals.errors.unwrap();
        assert!((errors.median_px - 2.0).abs() < 1e-9 && (errors.median_deg - 2.0).abs() < 1e-9, "{errors:?}");
        // Without the weak detections, there is one wrong detection less and one more clean picture.
        let strict = at(0.65);
        assert_eq!((strict.wrong, strict.clean.count, strict.false_alarms.count), (0, 2, 1));
        let lax = at(0.0);
        assert_eq!((lax.found.count, lax.false_alarms.count), (3, 2));
        assert_eq!(at(1.0).errors, None);
        let swept = sweep(&pictures.each_ref());
        assert_eq!((swept.len(), &swept[25]), (51, &(0.5, totals)));
    }
}
