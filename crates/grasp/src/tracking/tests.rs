//! A drawn part moves, is removed and returns; a search ends some frames after its frame.

use std::sync::Arc;
use std::time::Duration;

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{GraspLine, PlanarSimilarity, Polygon};

use super::*;
use crate::drawn_part::{self, at, line};
use crate::model::{GraspModel, Verification};
use crate::region::SearchRegion;

const SIZE: [u32; 2] = [320, 240];
/// Time between two frames.
const PERIOD: Duration = Duration::from_millis(10);
/// Duration of a search, in frames.
const SEARCH_FRAMES: u64 = 7;
/// Maximum error of position: the drawn part is flat and its picture without noise, so that only the raster causes
/// errors.
const MAX_ERROR_PX: f64 = 0.5;
/// Maximum error of the angle, for the same reason.
const MAX_ERROR_RAD: f64 = 0.01;

fn picture(parts: &[PlanarSimilarity]) -> RgbImage {
    drawn_part::picture(SIZE, parts)
}

fn tracker() -> Tracker {
    Tracker::new(drawn_part::model(SIZE).into(), TrackerConfig::default())
}

/// Feeds pictures of parts at `poses` in each frame; returns the tracks of each frame.
fn run(tracker: &mut Tracker, count: u64, poses: impl Fn(u64) -> Vec<PlanarSimilarity>) -> Vec<Vec<TrackedPart>> {
    let pictures = (0..count).map(|number| Arc::new(picture(&poses(number))));
    run_with_searches(tracker, pictures, std::iter::repeat(SEARCH_FRAMES))
}

/// As [`run`]; each search ends this number of frames after its frame.
fn run_with_searches(
    tracker: &mut Tracker,
    pictures: impl Iterator<Item = Arc<RgbImage>>,
    mut search_frames: impl Iterator<Item = u64>,
) -> Vec<Vec<TrackedPart>> {
    let mut pending: Option<(SearchOutcome, u64)> = None;
    pictures
        .zip(0u64..)
        .map(|(picture, number)| {
            if let Some((outcome, _)) = pending.take_if(|(_, due)| *due == number) {
                tracker.take_outcome(outcome).unwrap();
            }
            let parts = tracker.frame(picture, PERIOD * number as u32);
            if let Some(search) = tracker.search_due() {
                assert!(tracker.search_due().is_none(), "one search at a time");
                pending = Some((search.run(), number + search_frames.next().unwrap()));
            }
            parts
        })
        .collect()
}

fn assert_at(part: &TrackedPart, pose: &PlanarSimilarity, about: &str) {
    let expected = line().transformed(pose);
    let grasp = part.detection.grasp;
    let off = (grasp.center() - expected.center()).norm();
    assert!(off < MAX_ERROR_PX, "{about}: {off} px");
    assert!(grasp.angle.distance(expected.angle()) < MAX_ERROR_RAD, "{about}: {:?}", grasp.angle);
}

#[test]
fn a_part_is_carried_to_the_newest_frame_followed_lost_and_found_again() {
    // The part moves to the right and rotates, is absent from frame 30 to 44, then appears elsewhere and moves down.
    let pose = |number: u64| {
        let k = number as f64;
        match number {
            0..30 => vec![at(80.0 + 1.5 * k, 90.0, 0.4 * k)],
            30..45 => Vec::new(),
            _ => vec![at(230.0, 60.0 + 1.5 * (k - 45.0), 200.0)],
        }
    };
    let mut tracker = tracker();
    let all = run(&mut tracker, 75, pose);
    let first = all.iter().position(|parts| !parts.is_empty()).unwrap();
    assert_eq!(first as u64, SEARCH_FRAMES);
    for (number, parts) in all.iter().enumerate().take(30).skip(first) {
        assert_eq!((parts.len(), parts[0].state), (1, TrackState::Followed), "{number}");
        assert_at(&parts[0], &pose(number as u64)[0], &format!("frame {number}"));
    }
    assert_eq!(all[29][0].age, PERIOD * 29);
    for parts in &all[30..45] {
        assert_eq!((parts[0].state, parts[0].id), (TrackState::Lost, 0));
    }
    assert_eq!(all[34][0].unseen_for, PERIOD * 5);
    let again: Vec<_> =
        all.iter().enumerate().filter(|(_, parts)| parts.iter().any(|p| p.state == TrackState::FoundAgain)).collect();
    let [(number, parts)] = again[..] else { panic!("found again {} times", again.len()) };
    assert!(number <= 45 + 2 * SEARCH_FRAMES as usize, "{number}");
    assert_eq!((parts.len(), parts[0].id, parts[0].unseen_for), (1, 0, Duration::ZERO));
    for (number, parts) in all.iter().enumerate().skip(number) {
        assert_at(&parts[0], &pose(number as u64)[0], &format!("frame {number}"));
    }
}

/// The search thread and the caller share only the results of searches, so that their orders differ only in the number
/// of frames that each search takes.
#[test]
fn however_long_searches_take_a_part_is_reported_only_where_it_is() {
    const SEARCH_FRAMES: [u64; 3] = [1, 4, 9];
    const FRAMES: u64 = 44;
    let pose = |number: u64| {
        let k = number as f64;
        match number {
            0..15 => Some(at(80.0 + 1.5 * k, 90.0, 0.4 * k)),
            15..21 => None,
            _ => Some(at(230.0, 60.0 + 1.5 * (k - 21.0), 200.0)),
        }
    };
    let pictures: Vec<_> = (0..FRAMES).map(|number| Arc::new(picture(pose(number).as_slice()))).collect();
    for schedule in 0..27usize {
        let taken = [1, 3, 9].map(|place| SEARCH_FRAMES[schedule / place % 3]);
        let mut tracker = tracker();
        // One search follows another, so that some end after their part has disappeared.
        tracker.config.search_every = PERIOD;
        let all = run_with_searches(&mut tracker, pictures.iter().cloned(), taken.into_iter().cycle());
        for (number, parts) in all.iter().enumerate() {
            let about = format!("searches of {taken:?} frames, frame {number}");
            assert!(parts.len() <= 1 && parts.iter().all(|part| part.id == 0), "{about}: {parts:?}");
            if let Some(part) = parts.iter().find(|part| part.is_followed()) {
                let pose = pose(number as u64).unwrap_or_else(|| panic!("{about}: {part:?}"));
                assert_at(part, &pose, &about);
            }
        }
        let is_followed = |number: u64| all[number as usize].iter().any(TrackedPart::is_followed);
        assert!((taken[0]..15).all(is_followed), "{taken:?}");
        // A search of a frame without the part may have to end first.
        assert!((21 + 2 * 9..FRAMES).all(is_followed), "{taken:?}");
    }
}

/// A photo of a wire frame whose upper left corner is at whole pixels (x, y). Its arms are parallel to the picture's
/// axes and so thin that no point of a grid of 16 × 16 over its box lies on them.
fn wire_frame(x: f64, y: f64) -> Demonstration {
    let arms = [(0.0, 0.0), (5.0, 0.0), (5.0, 175.0), (175.0, 175.0), (175.0, 60.0), (180.0, 60.0), (180.0, 180.0)];
    let corners = arms.into_iter().chain([(0.0, 180.0)]).map(|(right, down)| Point2::new(x + right, y + down));
    let outline = Polygon { vertices: corners.collect() };
    let mask = outline.rasterize(SIZE[0], SIZE[1]);
    let image =
        RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| Rgb(if mask.get(x, y) { [50, 50, 55] } else { [190, 185, 175] }));
    let grasp = Some(GraspLine::new(Point2::new(x + 90.0, y + 175.0), Point2::new(x + 90.0, y + 180.0)));
    let annotation =
        Annotation { label: "wire".into(), bbox: outline.bounds(), grasp, jaw_width: None, outline: Some(outline) };
    Demonstration { image, annotation }
}

#[test]
fn a_still_part_of_thin_arms_is_one_track() {
    let model = drawn_part::taught(&[wire_frame(60.0, 40.0)]);
    let still = Arc::new(wire_frame(75.0, 50.0).image);
    let mut tracker = Tracker::new(model.into(), TrackerConfig::default());
    // One search follows another.
    tracker.config.search_every = PERIOD;
    let all = run_with_searches(&mut tracker, (0..10).map(|_| Arc::clone(&still)), std::iter::repeat(1));
    for (number, parts) in all.iter().enumerate().skip(1) {
        assert_eq!(parts.len(), 1, "frame {number}: {parts:?}");
        assert!((parts[0].detection.grasp.center() - Point2::new(165.0, 227.5)).norm() < 1.0, "frame {number}");
    }
}

/// Feeds pictures; only frames that do not continue the last one are searched, before they are answered.
fn run_searching_before_answers(
    tracker: &mut Tracker,
    period: Duration,
    frames: &[Vec<PlanarSimilarity>],
) -> Vec<(bool, Vec<TrackedPart>)> {
    frames
        .iter()
        .zip(0..)
        .map(|(poses, number)| {
            let parts = tracker.frame(Arc::new(picture(poses)), period * number);
            match tracker.search_before_answer() {
                Some(search) => (true, tracker.answer(search.run()).unwrap()),
                None => (false, parts),
            }
        })
        .collect()
}

#[test]
fn a_frame_that_does_not_follow_is_answered_by_its_own_search() {
    let [here, there, elsewhere] = [at(80.0, 90.0, 0.0), at(230.0, 160.0, 90.0), at(240.0, 70.0, 200.0)];
    let frames = [vec![here], vec![here], vec![there], vec![], vec![elsewhere], vec![here, elsewhere], vec![elsewhere]];
    // At 10 pictures per second, every change of the parts makes the frame discontinuous.
    let answers = run_searching_before_answers(&mut tracker(), Duration::from_millis(100), &frames);
    let was_searched: Vec<bool> = answers.iter().map(|(was_searched, _)| *was_searched).collect();
    assert_eq!(was_searched, [true, false, true, true, true, true, true]);
    for (number, ((_, parts), poses)) in answers.iter().zip(&frames).enumerate() {
        let followed: Vec<_> = parts.iter().filter(|part| part.is_followed()).collect();
        assert_eq!(followed.len(), poses.len(), "frame {number}");
        for pose in poses {
            let expected = line().transformed(pose).center();
            let off = |part: &&&TrackedPart| (part.detection.grasp.center() - expected).norm();
            let nearest = followed.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            assert_at(nearest, pose, &format!("frame {number}"));
        }
    }
    // At 100 frames per second, these changes count as movements.
    let answers = run_searching_before_answers(&mut tracker(), PERIOD, &frames);
    let was_searched: Vec<bool> = answers.iter().map(|(was_searched, _)| *was_searched).collect();
    assert_eq!(was_searched, [true, false, false, false, false, false, false]);
}

/// A frame may be followed, then searched, and is reported once; what was reported before decides.
#[test]
fn a_part_is_found_again_if_it_was_reported_lost() {
    use TrackState::{Followed, FoundAgain, Lost};
    let [here, there, elsewhere] = [at(80.0, 90.0, 0.0), at(230.0, 160.0, 90.0), at(240.0, 70.0, 200.0)];
    let states = |frames: &[Vec<PlanarSimilarity>]| {
        let answers = run_searching_before_answers(&mut tracker(), Duration::from_millis(100), frames);
        answers.iter().map(|(was_searched, parts)| (*was_searched, parts[0].state)).collect::<Vec<_>>()
    };
    // The lost part is followed where it was, before the new part beside it causes a search.
    let returns = states(&[vec![here], vec![], vec![here, elsewhere]]);
    assert_eq!(returns, [(true, Followed), (true, Lost), (true, FoundAgain)]);
    // The moved part is lost only until the same frame is searched.
    assert_eq!(states(&[vec![here], vec![there]]), [(true, Followed), (true, Followed)]);
}

#[test]
fn a_part_that_lies_still_stays_where_the_search_has_it() {
    let frames = vec![vec![at(100.3, 90.8, 17.0)]; 12];
    let mut tracker = tracker();
    let answers = run_searching_before_answers(&mut tracker, Duration::from_millis(100), &frames);
    let found = &answers[0].1[0].detection;
    for (was_searched, parts) in &answers[1..] {
        let mut followed = parts[0].detection.clone();
        // A window of the picture has other coordinates, so that sums in single precision differ in their last bits.
        let [seen, searched] = [&followed, found].map(|detection| [detection.agreement.unwrap(), detection.light]);
        assert!((0..2).all(|k| (seen[k] - searched[k]).abs() < 1e-6), "{seen:?} instead of {searched:?}");
        (followed.agreement, followed.light) = (found.agreement, found.light);
        assert_eq!((*was_searched, &followed), (false, found));
    }
    // A movement of one pixel is followed.
    let moved = tracker.frame(Arc::new(picture(&[at(101.3, 90.8, 17.0)])), Duration::from_millis(1200));
    assert_at(&moved[0], &at(101.3, 90.8, 17.0), "moved");
}

/// The log-odds of a score.
fn log_odds(score: f64) -> f64 {
    (score / (1.0 - score)).ln()
}

/// The drawn part's model with all scores changed by these log-odds.
fn model_with_bias(log_odds: f64) -> GraspModel {
    drawn_part::model(SIZE).with_check(|check| check.score.bias += log_odds).unwrap()
}

/// Under a slanted camera, a search rectifies the picture and accepts a part, although the part has too little evidence
/// in the picture itself.
#[test]
fn a_part_that_only_the_search_accepts_is_followed() {
    let pose = at(150.0, 110.0, 30.0);
    let [empty, with_part] = [vec![], vec![pose]].map(|parts| Arc::new(picture(&parts)));
    let seen = drawn_part::model(SIZE).detect(&with_part, Verification::ByShape).unwrap();
    // In the picture itself, the score is 0.12.
    let model = model_with_bias(-2.0 - log_odds(seen[0].score));
    // The search as if in the rectified picture, where the score is 0.95.
    let searched = |search: PartSearch| {
        let mut outcome = search.run();
        let best = &mut outcome.found.as_mut().unwrap()[0].detection;
        assert!(!best.is_accepted());
        best.score = 0.95;
        best.evidence.as_mut().unwrap().likeness += 2.0 + log_odds(0.95);
        outcome
    };
    let new_tracker = || Tracker::new(model.clone().into(), TrackerConfig::default());
    // Searched before the answer, because the picture has changed.
    let mut tracker = new_tracker();
    tracker.frame(Arc::clone(&empty), Duration::ZERO);
    let search = tracker.search_before_answer().unwrap();
    assert!(tracker.answer(search.run()).unwrap().is_empty());
    tracker.frame(Arc::clone(&with_part), Duration::from_millis(100));
    let search = tracker.search_before_answer().unwrap();
    let parts = tracker.answer(searched(search)).unwrap();
    assert_eq!((parts.len(), parts[0].detection.score), (1, 0.95));
    // Searched while further frames arrive.
    let mut tracker = new_tracker();
    tracker.frame(Arc::clone(&with_part), Duration::ZERO);
    let search = tracker.search_due().unwrap();
    tracker.take_outcome(searched(search)).unwrap();
    for number in 1..4 {
        let parts = tracker.frame(Arc::clone(&with_part), PERIOD * number);
        assert_eq!((parts.len(), parts[0].detection.score), (1, 0.95), "frame {number}");
        assert_at(&parts[0], &pose, &format!("frame {number}"));
    }
}

/// A search finds a part with another photo than its track, from which its pose differs by the difference of the photos.
#[test]
fn a_part_found_with_another_photo_stays_where_it_is() {
    let photos = [drawn_part::demonstration(SIZE), drawn_part::demonstration_at(SIZE, &at(90.0, 70.0, 5.0))];
    let of = |photos: &[Demonstration]| Tracker::new(drawn_part::taught(photos).into(), TrackerConfig::default());
    let (mut tracker, mut with_first, mut with_second) = (of(&photos), of(&photos[..1]), of(&photos[1..]));
    let pose = at(150.0, 110.0, 30.0);
    let picture = Arc::new(picture(&[pose]));
    // The search of a tracker with one photo, as if the tracker with both photos had found the part with this photo.
    let searched = |single: &mut Tracker, demonstration_idx: usize| {
        let mut outcome = single.search_due().unwrap().run();
        for found in outcome.found.as_mut().unwrap() {
            found.detection.demonstration_idx = demonstration_idx;
            found.placement.as_mut().unwrap().demonstration_idx = demonstration_idx;
        }
        outcome
    };
    let mut found = Vec::new();
    // Two searches are due in this time.
    for number in 0..45u32 {
        let time = PERIOD * number;
        let parts = tracker.frame(Arc::clone(&picture), time);
        with_first.frame(Arc::clone(&picture), time);
        with_second.frame(Arc::clone(&picture), time);
        for part in &parts {
            assert_at(part, &pose, &format!("frame {number}"));
        }
        found.push(parts.len());
        if tracker.search_due().is_some() {
            let outcome = if number == 0 { searched(&mut with_first, 0) } else { searched(&mut with_second, 1) };
            tracker.take_outcome(outcome).unwrap();
        }
    }
    assert_eq!(found[1..], [1; 44]);
}

#[test]
fn parts_for_which_no_place_is_free_do_not_wait() {
    let poses: Vec<_> = [(60.0, 60.0), (160.0, 60.0), (260.0, 60.0), (60.0, 170.0)].map(|(x, y)| at(x, y, 0.0)).into();
    let still = Arc::new(picture(&poses));
    let mut tracker = tracker();
    tracker.config.max_parts = 2;
    let all = run_with_searches(&mut tracker, (0..90).map(|_| Arc::clone(&still)), std::iter::repeat(12));
    assert_eq!((all[89].len(), tracker.arriving.len()), (2, 0));
}

#[test]
fn two_parts_have_two_ids_and_a_lost_one_is_forgotten() {
    let pose = |number: u64| {
        let k = number as f64;
        let mut parts = vec![at(80.0, 90.0 + k, 0.0)];
        if number < 40 {
            parts.push(at(230.0, 160.0 - k, 90.0));
        }
        parts
    };
    let mut tracker = tracker();
    tracker.config.forget_after = Duration::from_millis(150);
    let all = run(&mut tracker, 70, pose);
    for number in [20, 39] {
        let ids: Vec<_> = all[number].iter().map(|part| part.id).collect();
        assert_eq!(ids, [0, 1], "{number}");
    }
    assert_eq!(all[50].iter().filter(|part| part.is_followed()).count(), 1);
    assert_eq!(all[69].len(), 1);
    assert!(all[69][0].is_followed());
}

#[test]
fn frames_of_another_size_begin_a_new_sequence() {
    let mut tracker = tracker();
    let all = run(&mut tracker, 12, |_| vec![at(100.0, 100.0, 0.0)]);
    assert_eq!(all[11].len(), 1);
    let search = tracker.search_due();
    let other = Arc::new(RgbImage::new(200, 100));
    assert!(tracker.frame(other, PERIOD * 12).is_empty());
    if let Some(search) = search {
        // Results of the old sequence are ignored.
        tracker.take_outcome(search.run()).unwrap();
    }
    assert!(tracker.frame(Arc::new(RgbImage::new(200, 100)), PERIOD * 13).is_empty());
}

#[test]
fn the_same_frames_give_the_same_tracks() {
    let pose = |number: u64| vec![at(90.0 + 1.2 * number as f64, 100.0, 1.0 * number as f64)];
    let [one, again] = [0; 2].map(|_| run(&mut tracker(), 25, pose));
    assert_eq!(one, again);
}

/// A part that leaves the region is lost, although it is still in the picture.
#[test]
fn with_a_region_parts_are_followed_in_it_alone() {
    let region = SearchRegion::new([40, 30, 180, 180]);
    let model = drawn_part::model(SIZE).with_region(Some(region)).unwrap();
    let mut tracker = Tracker::new(model.into(), TrackerConfig::default());
    // The part moves to the right by 2 px per frame, and beyond the region.
    let pose = |number: u64| at(110.0 + 2.0 * number as f64, 120.0, 0.0);
    let told = run(&mut tracker, 80, |number| vec![pose(number)]);
    let mut num_followed = 0;
    for (number, parts) in told.iter().enumerate() {
        let grasp = line().transformed(&pose(number as u64)).center();
        for part in parts.iter().filter(|part| part.is_followed()) {
            assert_at(part, &pose(number as u64), &format!("frame {number}"));
            assert!(grasp.x < 220.0 + MAX_ERROR_PX, "frame {number}: {grasp}");
            num_followed += 1;
        }
    }
    assert!(num_followed > 30, "{num_followed}");
    assert_eq!(told[79][0].state, TrackState::Lost);
    // A change beside the region causes no search before the frame is answered.
    let config = TrackerConfig { moves_within: Duration::ZERO, ..TrackerConfig::default() };
    let model = drawn_part::model(SIZE).with_region(Some(region)).unwrap();
    let mut tracker = Tracker::new(model.into(), config);
    let still = at(110.0, 120.0, 0.0);
    let mut change = |number: u32, picture: RgbImage| {
        tracker.frame(Arc::new(picture), PERIOD * number);
        let search = tracker.search_before_answer();
        let is_searched = search.is_some();
        if let Some(search) = search {
            assert_eq!(tracker.answer(search.run()).unwrap().len(), 1);
        }
        is_searched
    };
    let covered = |left: u32| {
        let mut picture = picture(&[still]);
        (60..90).for_each(|y| (left..left + 40).for_each(|x| picture.put_pixel(x, y, Rgb([250; 3]))));
        picture
    };
    assert!(change(0, picture(&[still])));
    assert!(!change(1, covered(270)));
    assert!(change(2, covered(175)));
}
