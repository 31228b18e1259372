//! What a search found in an older frame, brought to the newest one.
//!
//! ```text
//! detections in frame k ─┬─ on a track, where that was in frame k ─ as there: likeness, marks and network score are taken over
//!                        │                                        └ elsewhere, and agrees better: carried forward, replaces it
//!                        └─ on no track ─ carried forward, becomes a track
//! carried forward: frame k ─ k + stride ─ … ─ newest, some steps a call
//! ```

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use image::RgbImage;
use sdg_geometry::Polygon;

use super::detector::PartDetector;
use super::follow::Effort;
use super::track::{PastPose, Standing, Track};
use crate::model::{Found, Placement};

/// Longest time from one frame that a detection is carried through to the next: a part at 0.5 m/s moves by 20 pixels of a
/// millimetre, which a capture reaches. Chosen by that reasoning.
const MAX_STRIDE: Duration = Duration::from_millis(40);
/// Frames that are kept for a search that has not ended; of more, every second one is kept. Chosen by hand: 44 MB of 640×480.
const MAX_BUFFERED: usize = 48;
/// A detection within this distance and turn of its track confirms it. Chosen by hand: beyond the noise of either.
const SAME_PLACE_PX: f64 = 2.5;
const SAME_TURN_RAD: f64 = 0.05;
/// What another pose of the same part must gain in agreement to replace the followed one. Chosen by hand.
const MIN_GAIN: f64 = 0.01;

/// A frame that may still be needed.
#[derive(Debug, Clone)]
pub(super) struct BufferedFrame {
    pub(super) number: u64,
    pub(super) picture: Arc<RgbImage>,
    pub(super) time: Duration,
}

/// The newest frame, and those since the one that is being searched.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameBuffer {
    frames: VecDeque<BufferedFrame>,
}

impl FrameBuffer {
    pub(super) fn push(&mut self, frame: BufferedFrame) {
        self.frames.push_back(frame);
        if self.frames.len() > MAX_BUFFERED {
            let newest = self.frames.len() - 1;
            let mut idx = 0;
            self.frames.retain(|_| {
                idx += 1;
                idx % 2 == 1 || idx > newest
            });
        }
    }

    /// Drops the frames that are older than `oldest`, but for the newest of all.
    pub(super) fn forget_before(&mut self, oldest: u64) {
        while self.frames.len() > 1 && self.frames[0].number < oldest {
            self.frames.pop_front();
        }
    }

    pub(super) fn newest(&self) -> Option<&BufferedFrame> {
        self.frames.back()
    }

    pub(super) fn get(&self, number: u64) -> Option<&BufferedFrame> {
        self.frames.iter().find(|frame| frame.number == number)
    }

    /// The frame to which something that holds in frame `number` is to be carried next; `None` where that is the newest, which
    /// every track is followed into.
    fn next_after(&self, number: u64, time: Duration) -> Option<&BufferedFrame> {
        let newest = self.newest()?;
        if newest.time.saturating_sub(time) <= MAX_STRIDE {
            return None;
        }
        let mut later = self.frames.iter().filter(|frame| frame.number > number && frame.number < newest.number);
        let first = later.next()?;
        let within = later.take_while(|frame| frame.time.saturating_sub(time) <= MAX_STRIDE).last();
        Some(within.unwrap_or(first))
    }
}

/// Whether a track is near enough to the newest frame to be followed into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Carried {
    /// It is in the frame before the newest, or nearly so.
    ToNewest,
    /// There are frames in between.
    Partly,
    /// It was not there in a frame in between.
    Lost,
}

/// Carries an arriving track through buffered frames, at most `steps` of them, which it counts down.
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

/// What a detection means for a track that it lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Match {
    /// Another part.
    Other,
    /// The same part where the track has it.
    Confirms,
    /// The same part, better placed.
    Corrects,
    /// The same part, no better placed.
    Disagrees,
}

/// Compares a detection with where a track was in that frame.
pub(super) fn compare(detector: &PartDetector, found: &Found, placement: &Placement, past: &PastPose) -> Match {
    let demonstration = &detector.model().demonstrations()[placement.demonstration_idx];
    let there = demonstration.outline(&past.image_from_cutout);
    if !found.detection.outline.as_ref().is_some_and(|outline| is_same_part(outline, &there)) {
        return Match::Other;
    }
    let middle = demonstration.marks.grasp.center();
    let apart = (placement.image_from_cutout.apply(&middle) - past.image_from_cutout.apply(&middle)).norm();
    let symmetry = detector.model().facts().symmetry;
    let turned = symmetry.distance(placement.image_from_cutout.angle, past.image_from_cutout.angle);
    let shrink = (placement.image_from_cutout.scale).max(1.0);
    if apart <= SAME_PLACE_PX * shrink && turned <= SAME_TURN_RAD {
        // A pose turned by the part's symmetry has the marks shifted to another side.
        let is_turned = (placement.image_from_cutout.angle - past.image_from_cutout.angle).radians().abs() > 1.0;
        return if is_turned { Match::Disagrees } else { Match::Confirms };
    }
    if placement.agreement > past.agreement + MIN_GAIN { Match::Corrects } else { Match::Disagrees }
}

/// As of detections: parts do not lie in each other.
pub(super) fn is_same_part(one: &Polygon, other: &Polygon) -> bool {
    const SAME_PART_SHARE: f64 = 0.3;
    one.bounds().intersection(&other.bounds()) > 0.0
        && one.share_inside(other).max(other.share_inside(one)) > SAME_PART_SHARE
}

impl Track {
    /// Marks the track as the better pose of another one.
    pub(super) fn replacing(mut self, id: u64) -> Self {
        self.standing = Standing::Arriving { replaces: Some(id) };
        self
    }
}
