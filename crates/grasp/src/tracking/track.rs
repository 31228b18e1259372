//! One part and its state from frame to frame.

use std::collections::VecDeque;
use std::time::Duration;

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::{CloseLook, Evidence};

use super::detector::PartDetector;
use super::follow::{Effort, Followed, SizedPart, StillPose};
use super::frames::BufferedFrame;
use crate::detection::{Found, GraspDetection, Placement};
use crate::facts::TurnSource;
use crate::sighting::Sighting;
use crate::verdict::Contributions;
use crate::verification::PlacedDemonstration;

/// Weight of a new measurement in the velocity. Chosen by hand: after a sudden change of direction, the expected pose
/// is wrong by less than three frames' motion.
const VELOCITY_GAIN: f64 = 0.4;
/// Weight of a new frame in the running means of agreement and size. Chosen by hand.
const STEADY_GAIN: f64 = 0.05;
/// A track is captured once in this many frames: with snapping only, the pose of a long part drifted along the part by
/// 2 pixels. Chosen by hand.
const CAPTURE_EVERY: u64 = 3;
/// Maximum time over which a pose is carried forward by its velocity. Chosen by hand.
const MAX_FORWARD_SECS: f64 = 0.1;
/// If the agreement is below this fraction of its running mean, refinement is repeated with more effort. Chosen by
/// hand.
const POOR_SHARE: f64 = 0.85;
/// Maximum difference between a search's pose and the pose by edges for a correction; larger differences indicate
/// another place. In pixels of the cut-out; chosen by hand.
const MAX_CORRECTION_PX: f64 = 3.0;
/// Maximum difference in rotation for a correction, in radians. Chosen by hand.
const MAX_CORRECTION_RAD: f64 = 0.06;
/// Minimum gain of agreement for a search's pose to replace the followed one. Chosen by hand.
const MIN_GAIN: f64 = 0.005;
/// A close look is repeated if the ratio of the agreement to that at the last close look is below this value or above
/// its inverse. Chosen by hand: a close look takes about as long as following.
const SAME_LOOKS: f64 = 0.85;
/// A close look is repeated after this time. Chosen by hand.
const MAX_LOOK_AGE: Duration = Duration::from_secs(1);
/// Number of frames whose poses are kept for running searches. Chosen by hand: two seconds at 100 frames per second.
const MAX_HISTORY: usize = 200;

/// The last close look, and its time.
#[derive(Debug, Clone, Copy)]
struct LastLook {
    look: CloseLook,
    /// Agreement of edges and surface at that time.
    agreement: f64,
    at: Duration,
}

/// A search's result for a part; valid until the part moves or is covered.
#[derive(Debug, Clone)]
struct Still {
    pose: StillPose,
    /// In pixels of the searched image. The pose of a part under a slanted camera only approximates it.
    detection: GraspDetection,
}

/// Whether a part is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Standing {
    /// Found by a search of an older frame and carried forward; `replaces` is the track that it corrects.
    Arriving {
        replaces: Option<u64>,
    },
    Followed,
    /// The part has been lost since this time.
    Lost(Duration),
}

/// A pose in one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct PastPose {
    pub(super) number: u64,
    /// The demonstration to whose cut-out the poses belong.
    pub(super) demonstration_idx: usize,
    /// The pose by edges alone.
    pub(super) by_edges: PlanarSimilarity,
    pub(super) image_from_cutout: PlanarSimilarity,
    pub(super) agreement: f64,
}

/// One part.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) id: u64,
    pub(super) standing: Standing,
    pub(super) first_seen: Duration,
    part: SizedPart,
    /// The pose by edges in the frame at `time`, the last in which the part was followed.
    by_edges: PlanarSimilarity,
    pub(super) time: Duration,
    pub(super) number: u64,
    velocity_px_per_s: Vector2<f64>,
    turn_rad_per_s: f64,
    /// The scale, smoothed over frames.
    steady_scale: f64,
    /// The agreement, smoothed over frames; `None` before the first frame.
    steady_agreement: Option<f64>,
    close: Option<LastLook>,
    /// The position of the marks relative to the outline, as refined by the last search.
    cutout_from_marks: PlanarSimilarity,
    network_score: f64,
    keypoint_scores: Vec<f64>,
    turn_source: TurnSource,
    /// The offset of the searches' poses from the poses by edges alone, in the cut-out's frame.
    correction: Option<PlanarSimilarity>,
    /// The offset of the last search's pose if it is too large for a correction; tried in the next frame.
    alternative: Option<PlanarSimilarity>,
    /// The last search's result; `None` once the part has moved.
    still: Option<Still>,
    history: VecDeque<PastPose>,
}

impl Track {
    /// A track from a search's result in a frame; `None` if its demonstration has no shape to compare at that size.
    pub(super) fn new(detector: &PartDetector, frame: &BufferedFrame, found: &Found) -> Option<Self> {
        let placement = found.placement.as_ref()?;
        let part = SizedPart::new(detector, placement, detector.frame_size(&frame.picture))?;
        let mut made = Self {
            id: 0,
            standing: Standing::Arriving { replaces: None },
            first_seen: frame.time,
            part,
            by_edges: placement.image_from_cutout,
            time: frame.time,
            number: frame.number,
            velocity_px_per_s: Vector2::zeros(),
            turn_rad_per_s: 0.0,
            steady_scale: placement.image_from_cutout.scale,
            steady_agreement: None,
            close: None,
            cutout_from_marks: PlanarSimilarity::IDENTITY,
            network_score: 0.0,
            keypoint_scores: Vec::new(),
            turn_source: placement.turn_source,
            correction: None,
            alternative: None,
            still: None,
            history: VecDeque::new(),
        };
        made.take_over(placement, frame.time);
        made.hold(detector, &frame.picture, &found.detection, placement);
        Some(made)
    }

    /// Uses the pose and the score of a search in `picture` for the following frames, until the part moves.
    pub(super) fn hold(
        &mut self,
        detector: &PartDetector,
        picture: &RgbImage,
        detection: &GraspDetection,
        placement: &Placement,
    ) {
        let pose = StillPose { image_from_cutout: placement.image_from_cutout, agreement: f64::NEG_INFINITY };
        let seen = self.part.follow(detector, picture, &pose.image_from_cutout, Effort::Snapped, None, Some(&pose));
        let seen = seen.filter(|_| detection.is_accepted());
        let still = |agreement| Still { pose: StillPose { agreement, ..pose }, detection: detection.clone() };
        self.still = seen.map(|seen| still(seen.agreement));
    }

    /// The verdict of the last search, while it is valid.
    pub(super) fn held_verdict(&self, followed: &Followed) -> Option<(f64, Contributions)> {
        let found = self.held(followed)?;
        Some((found.score, found.evidence?))
    }

    /// `detection` with the outline and the grasp of the last search, while that search is valid.
    pub(super) fn where_held(&self, followed: &Followed, detection: GraspDetection) -> GraspDetection {
        let Some(found) = self.held(followed) else { return detection };
        let GraspDetection { score, evidence, agreement, light, .. } = detection;
        GraspDetection { score, evidence, agreement, light, ..found.clone() }
    }

    fn held(&self, followed: &Followed) -> Option<&GraspDetection> {
        self.still.as_ref().filter(|_| followed.is_held).map(|still| &still.detection)
    }

    /// Uses the marks' shift, the network's score and the close look of a search.
    pub(super) fn take_over(&mut self, found: &Placement, time: Duration) {
        self.cutout_from_marks = found.image_from_cutout.inverse().compose(&found.image_from_marks);
        self.network_score = found.network_score;
        self.keypoint_scores.clone_from(&found.keypoint_scores);
        self.turn_source = found.turn_source;
        if let Some(look) = found.close {
            self.close = Some(LastLook { look, agreement: found.agreement, at: time });
        }
    }

    /// Compares a search's pose with the pose by edges in the searched frame: a small difference corrects the following
    /// frames, a large one is tried in the next frame. Without effect if the search's pose agrees less.
    pub(super) fn correct(&mut self, detector: &PartDetector, past: &PastPose, found: &Placement) {
        let difference = past.by_edges.inverse().compose(&found.image_from_cutout);
        let middle = self.part.demonstration(detector).marks.bbox.center();
        let (shift, turn) = (difference.apply(&middle) - middle, difference.angle.radians());
        if found.agreement < past.agreement {
            return;
        }
        if shift.norm() > MAX_CORRECTION_PX || turn.abs() > MAX_CORRECTION_RAD {
            self.correction = None;
            self.alternative = Some(difference);
            return;
        }
        // Half of the previous correction is kept, so that the noise of one search does not move the part fully.
        let before = self.correction.unwrap_or(difference);
        let shift = 0.5 * (shift + (before.apply(&middle) - middle));
        let turn = Angle::from_radians(0.5 * (turn + before.angle.radians()));
        let scale = (difference.scale * before.scale).sqrt();
        self.correction = Some(PlanarSimilarity::about(middle, middle + shift, turn, scale));
    }

    /// The part's centre for the cut-out's pose `image_from_cutout`, in pixels of the searched image.
    fn middle(&self, detector: &PartDetector, image_from_cutout: &PlanarSimilarity) -> Point2<f64> {
        image_from_cutout.apply(&self.part.demonstration(detector).marks.bbox.center())
    }

    /// The expected pose at a time.
    pub(super) fn expected(&self, detector: &PartDetector, time: Duration) -> PlanarSimilarity {
        let secs = time.saturating_sub(self.time).as_secs_f64().min(MAX_FORWARD_SECS);
        let middle = self.middle(detector, &self.by_edges);
        let turn = Angle::from_radians(self.turn_rad_per_s * secs);
        let scale = self.steady_scale / self.by_edges.scale;
        let moved = PlanarSimilarity::about(middle, middle + self.velocity_px_per_s * secs, turn, scale);
        moved.compose(&self.by_edges)
    }

    /// Refines the part in a frame, without a decision about the result; `None` if too little of the part lies in the
    /// frame.
    pub(super) fn refine(
        &mut self,
        detector: &PartDetector,
        picture: &RgbImage,
        time: Duration,
        effort: Effort,
    ) -> Option<Followed> {
        let start = self.expected(detector, time);
        let still = self.still.as_ref().map(|still| &still.pose);
        let followed = self.part.follow(detector, picture, &start, effort, self.correction.as_ref(), still)?;
        if followed.is_held {
            return Some(followed);
        }
        self.still = None;
        let captured_from = |start: &PlanarSimilarity, followed: Followed, gain: f64| {
            let captured = self.part.follow(detector, picture, start, Effort::Captured, self.correction.as_ref(), None);
            captured.filter(|captured| captured.agreement > followed.agreement + gain).unwrap_or(followed)
        };
        let followed = match self.alternative.map(|alternative| start.compose(&alternative)) {
            Some(alternative) => captured_from(&alternative, followed, MIN_GAIN),
            None if effort == Effort::Snapped && self.is_poor(&followed) => captured_from(&start, followed, 0.0),
            None => followed,
        };
        if self.alternative.take().is_some() {
            self.steady_scale = followed.by_edges.scale;
        }
        Some(followed)
    }

    /// A close look at the refined pose; a new one only if the result may have changed.
    pub(super) fn close_look(
        &mut self,
        detector: &PartDetector,
        picture: &RgbImage,
        time: Duration,
        followed: &Followed,
    ) -> Option<CloseLook> {
        let min_agreement = self.part.demonstration(detector).check().search.min_agreement;
        if followed.agreement < min_agreement {
            return None;
        }
        let is_the_same = self.close.is_some_and(|last| {
            let ratio = followed.agreement / last.agreement.max(f64::MIN_POSITIVE);
            (SAME_LOOKS..=1.0 / SAME_LOOKS).contains(&ratio) && time.saturating_sub(last.at) < MAX_LOOK_AGE
        });
        if !is_the_same {
            let look = self.part.close_look(detector, picture, &followed.image_from_cutout)?;
            self.close = Some(LastLook { look, agreement: followed.agreement, at: time });
        }
        self.close.map(|last| last.look)
    }

    /// The track that an arriving one corrects.
    pub(super) fn replaces(&self) -> Option<u64> {
        match self.standing {
            Standing::Arriving { replaces } => replaces,
            _ => None,
        }
    }

    /// The demonstration with which the part was found.
    pub(super) fn demonstration_idx(&self) -> usize {
        self.part.demonstration_idx
    }

    /// [`crate::verdict::Clues::log_size`], smoothed over frames.
    pub(super) fn log_size(&self) -> f64 {
        self.steady_scale.ln()
    }

    /// The first effort of refinement in a frame.
    pub(super) fn default_effort(&self, number: u64) -> Effort {
        if (number + self.id).is_multiple_of(CAPTURE_EVERY) { Effort::Captured } else { Effort::Snapped }
    }

    /// Whether an agreement is so far below its running mean that the part may not be there.
    pub(super) fn is_poor(&self, followed: &Followed) -> bool {
        self.steady_agreement.is_some_and(|steady| followed.agreement < POOR_SHARE * steady)
    }

    /// The followed part as an input of the verdict.
    pub(super) fn sighting<'a>(
        &self,
        detector: &'a PartDetector,
        followed: &Followed,
        close: Option<CloseLook>,
    ) -> Sighting<'a> {
        let placed = PlacedDemonstration {
            demonstration: self.part.demonstration(detector),
            demonstration_idx: self.part.demonstration_idx,
            range_idx: 0,
            image_from_cutout: followed.image_from_cutout,
            image_from_marks: followed.image_from_cutout.compose(&self.cutout_from_marks),
            colors: self.part.colors,
            agreement: followed.agreement,
            evidence: Evidence { close, ..followed.evidence },
            light: followed.light,
        };
        Sighting {
            placed,
            network_score: self.network_score,
            keypoint_scores: self.keypoint_scores.clone(),
            turn_source: self.turn_source,
        }
    }

    /// Moves the track to its refined pose.
    pub(super) fn accept(&mut self, detector: &PartDetector, followed: &Followed, number: u64, time: Duration) {
        let secs = time.saturating_sub(self.time).as_secs_f64();
        let shift = self.middle(detector, &followed.by_edges) - self.middle(detector, &self.by_edges);
        let turn = (followed.by_edges.angle - self.by_edges.angle).radians();
        if matches!(self.standing, Standing::Lost(_)) || secs > MAX_FORWARD_SECS {
            self.velocity_px_per_s = Vector2::zeros();
            self.turn_rad_per_s = 0.0;
        } else if secs > 0.0 {
            // The first measurement has no predecessor to be smoothed with.
            let gain = if self.history.is_empty() { 1.0 } else { VELOCITY_GAIN };
            self.velocity_px_per_s += (shift / secs - self.velocity_px_per_s) * gain;
            self.turn_rad_per_s += (turn / secs - self.turn_rad_per_s) * gain;
        }
        self.steady_scale *= (followed.by_edges.scale / self.steady_scale).powf(STEADY_GAIN);
        let steady = self.steady_agreement.unwrap_or(followed.agreement);
        self.steady_agreement = Some(steady + STEADY_GAIN * (followed.agreement - steady));
        self.by_edges = followed.by_edges;
        (self.time, self.number) = (time, number);
        if self.history.len() == MAX_HISTORY {
            self.history.pop_front();
        }
        let Followed { by_edges, image_from_cutout, agreement, .. } = *followed;
        let demonstration_idx = self.part.demonstration_idx;
        self.history.push_back(PastPose { number, demonstration_idx, by_edges, image_from_cutout, agreement });
    }

    /// The track's pose in a frame, if it was followed there.
    pub(super) fn past_pose(&self, number: u64) -> Option<PastPose> {
        let idx = self.history.binary_search_by_key(&number, |past| past.number).ok()?;
        self.history.get(idx).copied()
    }

    /// Continues from another pose of the same part; id, age and earlier history are kept.
    pub(super) fn replace_by(&mut self, other: Self) {
        let mut history = std::mem::take(&mut self.history);
        history.retain(|past| other.history.front().is_none_or(|first| past.number < first.number));
        history.extend(&other.history);
        *self = Self { id: self.id, first_seen: self.first_seen, standing: Standing::Followed, history, ..other };
    }
}
