//! Tracks parts in rendered frames with the real threads: `tracking ADDRESS FRAMES [MODEL_FILE]`, such as `tracking
//! 'pendulum?speed=50&noise=2&beside=mirrored' 500`.
//!
//! Frames are rendered first, then tracked twice: as fast as possible, and at the camera's frame rate. Prints the
//! frames per second, the time to track a frame, the processor time of all threads, and the errors relative to the
//! ground truth; for comparison also those of detections in single frames. Without a model file, model S is taught from
//! the shipped photo.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use image::RgbImage;
use sdg_cell::{LiveTracker, Perception, SearchTime};
use sdg_evaluation::shipped;
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{
    Device, GraspDetection, GraspModel, ModelKind, TeachOptions, TrackedPart, TrackerConfig, Verification, teach,
};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::table_camera::{MovingTruth, TableCamera};

/// Number of frames between two detections without tracking.
const DETECT_EVERY: usize = 20;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

struct Shown {
    picture: Arc<RgbImage>,
    time: Duration,
    truths: Vec<MovingTruth>,
}

/// Processor time of all threads of this process.
fn process_time() -> Result<Duration> {
    let mut total = Duration::ZERO;
    for task in std::fs::read_dir("/proc/self/task")? {
        let stat = std::fs::read_to_string(task?.path().join("schedstat"))?;
        total += Duration::from_nanos(stat.split(' ').next().and_then(|nanos| nanos.parse().ok()).unwrap_or(0));
    }
    Ok(total)
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, address, count, model_file @ ..] = &arguments[..] else {
        return Err("usage: tracking ADDRESS FRAMES [MODEL_FILE]".into());
    };
    let mut camera = TableCamera::new(&address.parse()?)?;
    let part = ObjectSpec::by_name(&camera.config().part)?;
    let model = match model_file {
        [file, ..] => GraspModel::from_bytes(&std::fs::read(file)?, &Device::flex())?,
        [] => {
            let mut options = TeachOptions::new(1);
            options.kind = ModelKind::S;
            options.symmetry = part.symmetry;
            teach(&[shipped::demonstration(&part.name)?], &options, &mut |_| ControlFlow::Continue(()))?.model
        }
    };
    let mut shown = Vec::new();
    for _ in 0..count.parse()? {
        let Some(view) = camera.next_view()? else { break };
        shown.push(Shown { picture: view.picture.into(), time: view.time, truths: view.truths });
    }
    println!("{address}: {} frames", shown.len());
    for is_paced in [false, true] {
        track(&model, &shown, part.symmetry, is_paced)?;
    }
    detect(&model, &shown, part.symmetry)
}

/// The errors of detections in single frames.
fn detect(model: &GraspModel, shown: &[Shown], symmetry: RotationalSymmetry) -> Result<()> {
    let (mut pixels, mut degrees, mut walls, mut missed) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for frame in shown.iter().step_by(DETECT_EVERY) {
        let began = Instant::now();
        let found = model.detect(&frame.picture, Verification::ByShape)?;
        walls.push(began.elapsed().as_secs_f64() * 1e3);
        for truth in frame.truths.iter().filter(|truth| truth.is_shown) {
            let expected = truth.grasp.planar;
            let apart = |found: &&GraspDetection| (found.grasp.center() - expected.center()).norm();
            let accepted = found.iter().filter(|found| found.is_accepted());
            match accepted.min_by(|a, b| apart(a).total_cmp(&apart(b))).filter(|found| apart(found) < 25.0) {
                Some(found) => {
                    pixels.push(apart(&found));
                    degrees.push(symmetry.distance(found.grasp.angle, expected.angle).to_degrees());
                }
                None => missed += 1,
            }
        }
    }
    println!("detect in every {DETECT_EVERY}th frame: {missed} missed, ms a frame: {}", spread(&mut walls));
    if !pixels.is_empty() {
        println!("  px: {}\n  °: {}", spread(&mut pixels), spread(&mut degrees));
    }
    Ok(())
}

fn track(model: &GraspModel, shown: &[Shown], symmetry: RotationalSymmetry, is_paced: bool) -> Result<()> {
    let perception = Perception::of_any_camera(model.clone());
    let search_time = SearchTime::AsItTakes { threads: None };
    let mut tracker = LiveTracker::new(&perception, TrackerConfig::default(), search_time)?;
    let (mut walls, mut all) = (Vec::new(), Vec::new());
    let (mut start, mut cpu_before) = (Instant::now(), process_time()?);
    for (idx, frame) in shown.iter().enumerate() {
        if is_paced {
            std::thread::sleep(frame.time.saturating_sub(start.elapsed()));
        }
        // The first search is not measured.
        if idx == 0 && !is_paced {
            while !tracker.frame(frame.picture.clone(), frame.time)?.iter().any(TrackedPart::is_followed) {
                if start.elapsed() > Duration::from_secs(10) {
                    return Err("the part was not found in the first frame".into());
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            (start, cpu_before) = (Instant::now(), process_time()?);
        }
        let began = Instant::now();
        let parts = tracker.frame(frame.picture.clone(), frame.time)?;
        walls.push(began.elapsed().as_secs_f64() * 1e3);
        all.push(parts);
    }
    let (wall, cpu) = (start.elapsed(), process_time()? - cpu_before);
    let pace = if is_paced { "at the camera's pace" } else { "as fast as it goes" };
    println!(
        "{pace}: {:.0} frames a second; processor {:.2} ms a frame in all threads",
        shown.len() as f64 / wall.as_secs_f64(),
        cpu.as_secs_f64() * 1e3 / shown.len() as f64
    );
    println!("  following, ms a frame: {}", spread(&mut walls));
    report_errors(shown, &all, symmetry);
    Ok(())
}

fn spread(values: &mut [f64]) -> String {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    format!("mean {mean:.2}, median {:.2}, 95 % {:.2}, most {:.2}", at(0.5), at(0.95), at(1.0))
}

/// Prints the errors of tracked parts, and how many parts were shown, followed, within 2 px and 2°, and elsewhere.
fn report_errors(shown: &[Shown], all: &[Vec<TrackedPart>], symmetry: RotationalSymmetry) {
    let (mut pixels, mut degrees, mut scores) = (Vec::new(), Vec::new(), Vec::new());
    let (mut num_shown, mut within, mut wrong, mut first) = (0, 0, 0, None);
    for (idx, (frame, parts)) in shown.iter().zip(all).enumerate() {
        let followed: Vec<_> = parts.iter().filter(|part| part.is_followed()).collect();
        for truth in frame.truths.iter().filter(|truth| truth.is_shown) {
            num_shown += 1;
            let expected = truth.grasp.planar;
            let error = |part: &TrackedPart| {
                let grasp = part.detection.grasp;
                let turn = symmetry.distance(grasp.angle, expected.angle).to_degrees();
                ((grasp.center() - expected.center()).norm(), turn)
            };
            let nearest = followed.iter().min_by(|a, b| error(a).0.total_cmp(&error(b).0));
            if let Some((px, deg)) = nearest.map(|part| error(part)).filter(|(px, _)| *px < 25.0) {
                first = first.or(Some(idx));
                pixels.push(px);
                degrees.push(deg);
                scores.push(nearest.map_or(0.0, |part| part.detection.score));
                within += usize::from(px <= 2.0 && deg <= 2.0);
            }
        }
        let is_on_part = |part: &TrackedPart| {
            let center = part.detection.grasp.center();
            frame.truths.iter().any(|truth| truth.is_shown && (truth.grasp.planar.center() - center).norm() < 25.0)
        };
        wrong += followed.iter().filter(|part| !is_on_part(part)).count();
    }
    println!(
        "  first after {first:?} frames; {num_shown} shown, {} followed, {within} within 2 px and 2°, {wrong} elsewhere",
        pixels.len()
    );
    if !pixels.is_empty() {
        println!("  px: {}\n  °: {}\n  score: {}", spread(&mut pixels), spread(&mut degrees), spread(&mut scores));
    }
    let ids: std::collections::BTreeSet<_> = all.iter().flatten().map(|part| part.id).collect();
    println!("  ids {ids:?}");
}
