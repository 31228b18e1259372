//! Detections that a search found in an older frame, carried forward to the newest frame.
//!
//! ```text
//! detections in frame k ─┬─ on a track, at its pose in frame k ─── near it: likeness, marks and network score are taken
//!                        │                                        │ over, and the difference is tried in the next frame
//!                        │                                        └ elsewhere, and agrees better: carried forward, replaces it
//!                        └─ on no track ─ carried forward, becomes a track
//! carried forward: frame k ─ k + stride ─ … ─ newest, some steps per call
//! ```

use super::detector::PartDetector;
use super::follow::Effort;
use super::frames::FrameBuffer;
use super::track::{PastPose, Standing, Track};
use crate::detection::{Found, Placement};
use crate::same_part::are_outlines_of_same_part;

/// A pose farther than this from its track's pose is carried forward like the pose of another part, because a capture
/// from the track's pose does not reach it. In pixels of the cut-out. Chosen by hand.
const FAR_PX: f64 = 8.0;
/// Rotation relative to its track's pose above which a pose also counts as distant, in radians. Chosen by hand.
const FAR_RAD: f64 = 0.15;
/// Minimum gain of agreement of a distant pose. Chosen by hand.
const MIN_GAIN: f64 = 0.02;

/// Whether a track is near enough to the newest frame to be followed into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Carried {
    /// The track has reached the frame before the newest, or nearly so.
    ToNewest,
    /// Further frames lie between the track and the newest frame.
    Partly,
    /// The part was absent in one of the frames between.
    Lost,
}

/// Carries an arriving track through buffered frames, at most `steps` of them; decreases `steps`.
pub(super) fn carry(detector: &PartDetector, frames: &FrameBuffer, track: &mut Track, steps: &mut usize) -> Carried {
    while let Some(frame) = frames.next_after(track.number, track.time) {
        if *steps == 0 {
            return Carried::Partly;
        }
        *steps -= 1;
        let Some(followed) = track.refine(detector, &frame.picture, frame.time, Effort::Captured) else {
            return Carried::Lost;
        };
        if track.is_poor(&followed) {
            return Carried::Lost;
        }
        track.accept(detector, &followed, frame.number, frame.time);
    }
    Carried::ToNewest
}

/// The meaning of a detection for a track that it overlaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Match {
    /// Another part.
    Other,
    /// The same part at about the track's pose.
    Confirms,
    /// The same part at another pose, or found with another demonstration, of better agreement.
    Corrects,
    /// The same part, but the pose does not agree better, or differs only by the part's symmetry.
    Disagrees,
}

/// Compares a detection with the track's pose in the detection's frame.
pub(super) fn compare(detector: &PartDetector, found: &Found, placement: &Placement, past: &PastPose) -> Match {
    let demonstration = &detector.model().demonstrations()[past.demonstration_idx];
    let there = demonstration.outline(&past.image_from_cutout);
    if !found.detection.outline.as_ref().is_some_and(|outline| are_outlines_of_same_part(outline, &there)) {
        return Match::Other;
    }
    let is_better = placement.agreement > past.agreement + MIN_GAIN;
    if placement.demonstration_idx != past.demonstration_idx {
        // The poses belong to different cut-outs.
        return if is_better { Match::Corrects } else { Match::Disagrees };
    }
    let difference = past.image_from_cutout.inverse().compose(&placement.image_from_cutout);
    let middle = demonstration.marks.grasp.center();
    let apart_px = (difference.apply(&middle) - middle).norm();
    if apart_px <= FAR_PX && difference.angle.radians().abs() <= FAR_RAD {
        return Match::Confirms;
    }
    let seen = detector.model().facts().symmetry.visible(difference.angle).radians().abs();
    if is_better && (apart_px > FAR_PX || seen > FAR_RAD) { Match::Corrects } else { Match::Disagrees }
}

impl Track {
    /// Marks the track as a better pose of the part of track `id`.
    pub(super) fn replacing(mut self, id: u64) -> Self {
        self.standing = Standing::Arriving { replaces: Some(id) };
        self
    }
}
