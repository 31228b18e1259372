//! All parts of a sequence.

use std::sync::Arc;
use std::time::Duration;

use image::RgbImage;
use sdg_geometry::BoundingBox;
use sdg_shape::CloseLook;

use super::arrival::{Carried, Match, carry, compare};
use super::continuity::CoarseView;
use super::detector::{PartDetector, PartSearch, SearchOutcome};
use super::follow::{Effort, Followed};
use super::frames::{BufferedFrame, FrameBuffer};
use super::track::{PastPose, Standing, Track};
use super::{TrackState, TrackedPart, TrackerConfig};
use crate::detection::{Found, GraspDetection};
use crate::error::Result;
use crate::model::are_of_same_part;
use crate::plan_view::PlanarPose;
use crate::verdict::{Clues, Contributions};
use sdg_shape::PixelRect;

/// Minimum score for a detection to become a track, and for a lost track to be found again: the acceptance threshold.
const ACCEPTED: f64 = 0.5;
/// Maximum number of captures of arriving tracks in one frame, so that a finished search does not delay the frame.
/// Chosen by hand.
const MAX_CARRY_STEPS: usize = 3;

/// Follows parts from frame to frame.
///
/// # Example
/// ```no_run
/// # use std::{sync::Arc, time::Duration};
/// # use sdg_grasp::{Device, GraspModel, Tracker, TrackerConfig};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let frames: Vec<image::RgbImage> = Vec::new();
/// let model = GraspModel::from_bytes(&std::fs::read("pendulum.sdg")?, &Device::flex())?;
/// let mut tracker = Tracker::new(model.into(), TrackerConfig::default());
/// for (number, picture) in frames.into_iter().enumerate() {
///     let mut parts = tracker.frame(Arc::new(picture), Duration::from_millis(10 * number as u64));
///     if let Some(search) = tracker.search_before_answer() {
///         parts = tracker.answer(search.run())?;
///     }
///     for part in parts.iter().filter(|part| part.is_followed()) {
///         println!("part {}: ({:.1}, {:.1})", part.id, part.detection.grasp.x, part.detection.grasp.y);
///     }
///     // On another thread, while further frames arrive:
///     if let Some(search) = tracker.search_due() {
///         tracker.take_outcome(search.run())?;
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Tracker {
    detector: Arc<PartDetector>,
    pub(super) config: TrackerConfig,
    frames: FrameBuffer,
    next_number: u64,
    next_id: u64,
    tracks: Vec<Tracked>,
    /// Tracks that are carried forward to the newest frame.
    pub(super) arriving: Vec<Track>,
    /// The frame that is being searched.
    searching: Option<u64>,
    /// The time at which the last search began.
    searched_at: Option<Duration>,
    /// The newest frame at low resolution; `None` before the first frame.
    coarse: Option<CoarseView>,
    /// The discontinuity of the newest frame, until the frame is searched.
    gap: Option<Gap>,
}

/// The kind of discontinuity between a frame and the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gap {
    /// The frame is the first, or was taken long after the one before.
    Unrelated,
    /// A part was just lost, or the picture changed beside the parts.
    Changed,
}

/// A track and its last score.
#[derive(Debug)]
struct Tracked {
    track: Track,
    part: TrackedPart,
    /// Whether the part was lost in the frame before the newest, as returned to the caller.
    was_lost: bool,
    /// Whether the newest finished search accepted its part.
    is_in_search: bool,
}

/// The reported data of a track.
type Shown = (GraspDetection, Option<PlanarPose>);

/// A track refined in the newest frame, before it is judged.
struct Refined {
    followed: Followed,
    close: Option<CloseLook>,
}

impl Tracker {
    /// A tracker without parts.
    pub fn new(detector: PartDetector, config: TrackerConfig) -> Self {
        Self {
            detector: Arc::new(detector),
            config,
            frames: FrameBuffer::default(),
            next_number: 0,
            next_id: 0,
            tracks: Vec::new(),
            arriving: Vec::new(),
            searching: None,
            searched_at: None,
            coarse: None,
            gap: None,
        }
    }

    /// Follows all known parts into a frame; returns all of them, including lost ones, in the order in which they were
    /// first found.
    ///
    /// `captured` is the time since a moment that is the same for all frames of the sequence. A frame of another size
    /// starts a new sequence.
    pub fn frame(&mut self, picture: Arc<RgbImage>, captured: Duration) -> Vec<TrackedPart> {
        if self.frames.newest().is_some_and(|newest| newest.picture.dimensions() != picture.dimensions()) {
            self.restart();
        }
        let number = self.next_number;
        self.next_number += 1;
        let before = self.frames.newest().cloned();
        let boxes_before = self.followed_boxes();
        self.tracks.iter_mut().for_each(|tracked| tracked.was_lost = !tracked.part.is_followed());
        self.frames.push(BufferedFrame { number, picture: picture.clone(), time: captured });
        self.frames.forget_before(self.oldest_needed());

        let mut arrived = self.carry_forward();
        let mut refined = self.refine_all(&picture, captured, &mut arrived);
        self.judge_all(&mut refined, number, captured, arrived);
        self.drop_doubled();
        self.tracks.retain(|tracked| match tracked.track.standing {
            Standing::Lost(since) => captured.saturating_sub(since) < self.config.forget_after,
            _ => true,
        });
        self.gap = self.gap_after(before.as_ref(), boxes_before, &picture, captured);
        self.parts()
    }

    /// The search to be run before the newest frame is answered; `None` if that frame continues the one before. The
    /// first frame continues nothing. A frame more than [`TrackerConfig::search_every`] after the one before continues
    /// it only if the pictures are equal. A frame more than [`TrackerConfig::moves_within`] after the one before does
    /// not continue it if a followed part is gone or the picture changed elsewhere. The search's result goes to
    /// [`Self::answer`]. A running search is abandoned.
    pub fn search_before_answer(&mut self) -> Option<PartSearch> {
        self.gap?;
        self.search_newest()
    }

    /// Makes the result of [`Self::search_before_answer`] the answer to the newest frame: parts that the search did not
    /// find are lost.
    ///
    /// # Errors
    /// As for [`crate::GraspModel::detect`].
    pub fn answer(&mut self, outcome: SearchOutcome) -> Result<Vec<TrackedPart>> {
        if self.searching != Some(outcome.number) {
            return Ok(self.parts());
        }
        self.searching = None;
        self.arriving.clear();
        let gap = self.gap.take();
        let Some(frame) = self.frames.get(outcome.number).cloned() else { return Ok(self.parts()) };
        let mut found = outcome.found?;
        self.compare_with_search(&found, frame.number);
        found.retain(|found| found.detection.is_accepted());
        found.truncate(self.config.max_parts);
        let mut arrived: Vec<_> = found.iter().filter_map(|found| self.arrived(&frame, found)).collect();
        if gap == Some(Gap::Changed) {
            let clues: Vec<Clues> = arrived
                .iter()
                .map(|(track, Refined { followed, close }, _)| {
                    self.detector.model().clues(&track.sighting(&self.detector, followed, *close))
                })
                .collect();
            let judged = self.detector.model().judge_in_sequence(&clues, &self.log_sizes());
            let verdicts = arrived
                .iter()
                .zip(judged)
                .map(|((track, Refined { followed, .. }, _), judged)| self.verdict_on_arrived(track, followed, judged));
            let mut is_accepted = verdicts.map(|(score, _)| score >= ACCEPTED).collect::<Vec<_>>().into_iter();
            arrived.retain(|_| is_accepted.next() == Some(true));
        }
        let is_found = |id: u64| arrived.iter().any(|(track, ..)| track.replaces() == Some(id));
        for tracked in self.tracks.iter_mut().filter(|tracked| !is_found(tracked.track.id)) {
            tracked.lose(frame.time);
        }
        for (track, refined, shown) in arrived {
            self.enter(track, &refined.followed, frame.number, frame.time, shown);
        }
        Ok(self.parts())
    }

    /// A detection in the newest frame as a track in it, and the reported data; `None` if the detection cannot be
    /// refined or reported.
    fn arrived(&self, frame: &BufferedFrame, found: &Found) -> Option<(Track, Refined, Shown)> {
        let mut track = Track::new(&self.detector, frame, found)?;
        if let Some((idx, ..)) = self.matched(found, frame.number) {
            track = track.replacing(self.tracks[idx].track.id);
        }
        let followed = track.refine(&self.detector, &frame.picture, frame.time, Effort::Snapped)?;
        let close = track.close_look(&self.detector, &frame.picture, frame.time, &followed);
        let size = self.detector.frame_size(&frame.picture);
        let shown = shown_within(&self.detector, found.detection.clone(), size)?;
        Some((track, Refined { followed, close }, shown))
    }

    /// The reference sizes by demonstration, the oldest track's first: parts of one sequence have one size, like parts of
    /// one picture, so that a look-alike of another size is not a lost part.
    fn log_sizes(&self) -> Vec<(usize, f64)> {
        self.tracks.iter().map(|tracked| (tracked.track.demonstration_idx(), tracked.track.log_size())).collect()
    }

    /// Notes for each track whether a search of frame `number` accepted its part.
    fn compare_with_search(&mut self, all_found: &[Found], number: u64) {
        self.tracks.iter_mut().for_each(|tracked| tracked.is_in_search = false);
        for found in all_found.iter().filter(|found| found.detection.is_accepted()) {
            if let Some((idx, ..)) = self.matched(found, number) {
                self.tracks[idx].is_in_search = true;
            }
        }
    }

    /// The verdict on an arrived track, given the verdict `judged` in the newest frame. A held track has the verdict of
    /// the search, which may have rectified the picture of a slanted camera. The search compared the part's size with
    /// those of the parts that it found. If the reference of [`Self::log_sizes`] is not among them, the size counts as
    /// in `judged`.
    fn verdict_on_arrived(
        &self,
        track: &Track,
        followed: &Followed,
        judged: (f64, Contributions),
    ) -> (f64, Contributions) {
        let Some((score, evidence)) = track.held_verdict(followed) else { return judged };
        let reference =
            self.tracks.iter().find(|tracked| tracked.track.demonstration_idx() == track.demonstration_idx());
        if reference.is_none_or(|reference| reference.is_in_search) {
            return (score, evidence);
        }
        self.detector.model().verdict_with_size(evidence, judged.1.size)
    }

    fn parts(&self) -> Vec<TrackedPart> {
        self.tracks.iter().map(|tracked| tracked.part.clone()).collect()
    }

    fn followed_boxes(&self) -> Vec<BoundingBox> {
        let followed = self.tracks.iter().filter(|tracked| tracked.part.is_followed());
        followed.map(|tracked| tracked.part.detection.bbox).collect()
    }

    /// The area of a frame in which changes count.
    fn watched(&self, picture: &RgbImage) -> PixelRect {
        let (width, height) = picture.dimensions();
        let region = self.detector.region().filter(|region| region.check([width, height]).is_ok());
        region.map_or(PixelRect { left: 0, top: 0, width, height }, |region| PixelRect {
            left: region.x,
            top: region.y,
            width: region.width,
            height: region.height,
        })
    }

    /// The discontinuity of the newest frame, given the boxes of the parts in the frame before.
    fn gap_after(
        &mut self,
        before: Option<&BufferedFrame>,
        mut boxes: Vec<BoundingBox>,
        picture: &RgbImage,
        captured: Duration,
    ) -> Option<Gap> {
        let coarse = CoarseView::new(picture, &self.watched(picture));
        let coarse_before = self.coarse.replace(coarse.clone());
        let Some((before, coarse_before)) = before.zip(coarse_before) else { return Some(Gap::Unrelated) };
        let passed = captured.checked_sub(before.time).filter(|passed| *passed <= self.config.search_every);
        let Some(passed) = passed else {
            return (*before.picture != *picture).then_some(Gap::Unrelated);
        };
        if passed <= self.config.moves_within {
            return None;
        }
        boxes.extend(self.followed_boxes());
        let has_changed = self.tracks.iter().any(|tracked| tracked.was_just_lost(captured))
            || coarse.has_changed_beside(&coarse_before, &boxes);
        has_changed.then_some(Gap::Changed)
    }

    /// The search to be run now, on the newest frame; `None` while a search is running or none is due.
    pub fn search_due(&mut self) -> Option<PartSearch> {
        let newest = self.frames.newest()?;
        if self.searching.is_some() {
            return None;
        }
        let is_missing = self.tracks.is_empty()
            || self.tracks.iter().any(|tracked| matches!(tracked.track.standing, Standing::Lost(_)));
        let is_due = self.searched_at.is_none_or(|at| newest.time.saturating_sub(at) >= self.config.search_every);
        if !(is_due || is_missing && self.arriving.is_empty()) {
            return None;
        }
        self.search_newest()
    }

    fn search_newest(&mut self) -> Option<PartSearch> {
        let newest = self.frames.newest()?;
        self.searching = Some(newest.number);
        self.searched_at = Some(newest.time);
        let (number, picture) = (newest.number, newest.picture.clone());
        Some(PartSearch { number, picture, detector: self.detector.clone() })
    }

    /// Takes the result of a search, which is carried forward while the next frames are followed.
    ///
    /// # Errors
    /// As for [`crate::GraspModel::detect`].
    pub fn take_outcome(&mut self, outcome: SearchOutcome) -> Result<()> {
        if self.searching != Some(outcome.number) {
            // The search belongs to a finished sequence, or was abandoned.
            return Ok(());
        }
        self.searching = None;
        let Some(frame) = self.frames.get(outcome.number).cloned() else { return Ok(()) };
        let all_found = outcome.found?;
        self.compare_with_search(&all_found, frame.number);
        // This search has the parts of the earlier one in a newer frame.
        self.arriving.clear();
        let num_followed = self.tracks.iter().filter(|tracked| tracked.part.is_followed()).count();
        let mut num_free = self.config.max_parts.saturating_sub(num_followed);
        for found in all_found {
            let Some(placement) = &found.placement else { continue };
            let arriving = || Track::new(&self.detector, &frame, &found);
            match self.matched(&found, frame.number) {
                Some((idx, past, Match::Confirms)) => {
                    self.tracks[idx].track.take_over(placement, frame.time);
                    self.tracks[idx].track.correct(&self.detector, &past, placement);
                    self.tracks[idx].track.hold(&self.detector, &frame.picture, &found.detection, placement);
                }
                Some((idx, _, Match::Corrects)) if found.detection.is_accepted() => {
                    let id = self.tracks[idx].track.id;
                    self.arriving.extend(arriving().map(|track| track.replacing(id)));
                }
                Some(_) => {}
                None if found.detection.is_accepted() && num_free > 0 => {
                    num_free -= 1;
                    self.arriving.extend(arriving());
                }
                None => {}
            }
        }
        Ok(())
    }

    /// The track that a detection of frame `number` overlaps, and its pose in that frame.
    fn matched(&self, found: &Found, number: u64) -> Option<(usize, PastPose, Match)> {
        let placement = found.placement.as_ref()?;
        self.tracks.iter().enumerate().find_map(|(idx, tracked)| {
            let past = tracked.track.past_pose(number)?;
            let compared = compare(&self.detector, found, placement, &past);
            (compared != Match::Other).then_some((idx, past, compared))
        })
    }

    fn restart(&mut self) {
        self.frames = FrameBuffer::default();
        self.tracks.clear();
        self.arriving.clear();
        self.searching = None;
        self.searched_at = None;
        self.coarse = None;
    }

    fn oldest_needed(&self) -> u64 {
        let arriving = self.arriving.iter().map(|track| track.number);
        arriving.chain(self.searching).min().unwrap_or(self.next_number)
    }

    /// Carries the results of searches through the buffered frames; returns those near the newest frame.
    fn carry_forward(&mut self) -> Vec<Track> {
        let mut steps = MAX_CARRY_STEPS;
        let mut arrived = Vec::new();
        for mut track in std::mem::take(&mut self.arriving) {
            match carry(&self.detector, &self.frames, &mut track, &mut steps) {
                Carried::ToNewest => arrived.push(track),
                Carried::Partly => self.arriving.push(track),
                Carried::Lost => {}
            }
        }
        arrived
    }

    /// Refines all tracks, and then the arrived ones, in the newest frame.
    fn refine_all(&mut self, picture: &RgbImage, captured: Duration, arrived: &mut [Track]) -> Vec<Option<Refined>> {
        let detector = &*self.detector;
        let retry_for = self.config.retry_for;
        let number = self.next_number - 1;
        let known = self.tracks.iter_mut().map(|tracked| &mut tracked.track);
        known
            .chain(arrived)
            .map(|track| {
                let effort = match track.standing {
                    Standing::Lost(since) if captured.saturating_sub(since) > retry_for => return None,
                    Standing::Followed | Standing::Lost(_) => track.default_effort(number),
                    Standing::Arriving { .. } => Effort::Captured,
                };
                let followed = track.refine(detector, picture, captured, effort)?;
                if matches!(track.standing, Standing::Lost(_)) && track.is_poor(&followed) {
                    return None;
                }
                let close = track.close_look(detector, picture, captured, &followed);
                Some(Refined { followed, close })
            })
            .collect()
    }

    /// Scores the refined tracks, all of one picture together, and decides which are followed.
    fn judge_all(&mut self, refined: &mut Vec<Option<Refined>>, number: u64, captured: Duration, arrived: Vec<Track>) {
        let detector = self.detector.clone();
        let newcomers = refined.split_off(self.tracks.len());
        let all =
            self.tracks.iter().map(|tracked| &tracked.track).chain(&arrived).zip(refined.iter().chain(&newcomers));
        let clues: Vec<Option<Clues>> = all
            .map(|(track, refined)| {
                let Refined { followed, close } = refined.as_ref()?;
                Some(detector.model().clues(&track.sighting(&detector, followed, *close)))
            })
            .collect();
        let asked: Vec<Clues> = clues.iter().flatten().copied().collect();
        let mut judged = detector.model().judge_in_sequence(&asked, &self.log_sizes()).into_iter();
        let mut verdicts = clues.iter().map(|clues| clues.as_ref().and_then(|_| judged.next())).collect::<Vec<_>>();
        let of_newcomers = verdicts.split_off(self.tracks.len());

        let output = |track: &Track, refined: &Refined, (score, evidence), size: [u32; 2]| {
            let sighting = track.sighting(&detector, &refined.followed, refined.close);
            let detection = sighting.detection(score, evidence, detector.model().num_keypoints());
            shown_within(&detector, track.where_held(&refined.followed, detection), size)
        };
        let size = self.frames.newest().map_or([0, 0], |newest| detector.frame_size(&newest.picture));
        for ((tracked, refined), verdict) in self.tracks.iter_mut().zip(refined.iter()).zip(verdicts) {
            let least = match tracked.track.standing {
                Standing::Lost(_) => ACCEPTED,
                _ => self.config.lose_below,
            };
            let held = refined.as_ref().and_then(|refined| tracked.track.held_verdict(&refined.followed));
            let seen = refined.as_ref().zip(held.or(verdict)).filter(|(_, (score, _))| *score >= least);
            let shown = seen.and_then(|(refined, verdict)| {
                output(&tracked.track, refined, verdict, size).map(|shown| (refined, shown))
            });
            match shown {
                Some((refined, shown)) => tracked.follow(&detector, &refined.followed, number, captured, shown),
                None => tracked.lose(captured),
            }
        }
        for ((track, refined), verdict) in arrived.into_iter().zip(&newcomers).zip(of_newcomers) {
            let verdict = refined.as_ref().zip(verdict);
            let seen = verdict
                .map(|(refined, judged)| (refined, self.verdict_on_arrived(&track, &refined.followed, judged)))
                .filter(|(_, (score, _))| *score >= ACCEPTED);
            let shown = seen.and_then(|(refined, verdict)| Some((refined, output(&track, refined, verdict, size)?)));
            if let Some((refined, shown)) = shown {
                self.enter(track, &refined.followed, number, captured, shown);
            }
        }
    }

    /// Makes an arrived track a followed one: it corrects a track, continues a lost one, or is new.
    fn enter(&mut self, mut track: Track, followed: &Followed, number: u64, captured: Duration, shown: Shown) {
        track.accept(&self.detector, followed, number, captured);
        let lost_nearest = || {
            let apart = |tracked: &Tracked| (tracked.part.detection.grasp.center() - shown.0.grasp.center()).norm();
            let lost = self.tracks.iter().enumerate();
            let lost = lost.filter(|(_, tracked)| matches!(tracked.track.standing, Standing::Lost(_)));
            lost.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1))).map(|(idx, _)| idx)
        };
        let is_double = |tracked: &Tracked, id: Option<u64>| {
            tracked.part.is_followed()
                && Some(tracked.track.id) != id
                && are_of_same_part(&tracked.part.detection, &shown.0)
        };
        let replaced = track.replaces();
        if self.tracks.iter().any(|tracked| is_double(tracked, replaced)) {
            return;
        }
        let replaced = replaced.and_then(|id| self.tracks.iter().position(|tracked| tracked.track.id == id));
        if let Some(idx) = replaced.or_else(lost_nearest) {
            self.tracks[idx].go_on_as(track, captured, shown);
        } else if self.tracks.len() < self.config.max_parts {
            track.id = self.next_id;
            self.next_id += 1;
            track.standing = Standing::Followed;
            let (detection, pose) = shown;
            let age = captured.saturating_sub(track.first_seen);
            let unseen_for = Duration::ZERO;
            let part = TrackedPart { id: track.id, state: TrackState::Followed, age, unseen_for, detection, pose };
            self.tracks.push(Tracked { track, part, was_lost: false, is_in_search: true });
        }
    }

    /// Keeps the older of two tracks on one part.
    fn drop_doubled(&mut self) {
        let mut idx = 1;
        while idx < self.tracks.len() {
            let (before, here) = self.tracks.split_at(idx);
            let here = &here[0].part;
            let is_double = here.is_followed()
                && before
                    .iter()
                    .any(|other| other.part.is_followed() && are_of_same_part(&other.part.detection, &here.detection));
            if is_double {
                self.tracks.remove(idx);
            } else {
                idx += 1;
            }
        }
    }
}

/// Converts a detection in the searched image, which has this size, to its reported form; `None` if the camera does not
/// show the grasp point or the part lies outside the searched region of the picture.
fn shown_within(detector: &PartDetector, mut detection: GraspDetection, size: [u32; 2]) -> Option<Shown> {
    detection.bbox = detection.bbox.clip(f64::from(size[0]), f64::from(size[1]));
    let picture = detector.picture_size(size);
    detector.output(detection).filter(|shown| shown.0.lies_within(detector.region(), picture))
}

impl Tracked {
    fn follow(&mut self, detector: &PartDetector, followed: &Followed, number: u64, captured: Duration, shown: Shown) {
        self.track.accept(detector, followed, number, captured);
        self.track.standing = Standing::Followed;
        self.show(captured, shown);
    }

    /// Reports the part where it is followed.
    fn show(&mut self, captured: Duration, (detection, pose): Shown) {
        self.part.state = if self.was_lost { TrackState::FoundAgain } else { TrackState::Followed };
        self.part.age = captured.saturating_sub(self.track.first_seen);
        self.part.unseen_for = Duration::ZERO;
        (self.part.detection, self.part.pose) = (detection, pose);
    }

    fn lose(&mut self, captured: Duration) {
        if !matches!(self.track.standing, Standing::Lost(_)) {
            self.track.standing = Standing::Lost(captured);
        }
        self.part.state = TrackState::Lost;
        self.part.age = captured.saturating_sub(self.track.first_seen);
        self.part.unseen_for = captured.saturating_sub(self.track.time);
    }

    /// Whether the part was lost in the frame captured at this time.
    fn was_just_lost(&self, captured: Duration) -> bool {
        self.track.standing == Standing::Lost(captured)
    }

    /// Continues from another track's pose of the same part.
    fn go_on_as(&mut self, other: Track, captured: Duration, shown: Shown) {
        self.track.replace_by(other);
        self.is_in_search = true;
        self.show(captured, shown);
    }
}
