//! `sdg detect --from`: parts in live pictures, frame by frame.
//!
//! ```text
//! camera ─ frame ─┬─ LiveTracker: tracked, and searched on a second thread ─┬─ line on standard output
//!                 └─ --every-frame, --no-verify: each frame searched alone ─┴─ picture on 127.0.0.1 (--draw)
//! ```

use std::io::Write;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use image::RgbImage;
use sdg_camera::{Address, Fault, Frame, MjpegServer};
use sdg_cell::{
    DetectionWords, FrameDetector, FrameRecord, FrameSize, FrameSizes, Frames, Next, Part, Perception, drawing,
};
use sdg_grasp::{GraspDetection, TrackerConfig, Verification};

use super::args::DetectArgs;
use crate::exit::{Outcome, Usage, one_line};
use crate::found_text::FoundText;
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::live_pictures;
use crate::paint::{Paint, Tone};

/// Reads frames until the camera ends, `--frames` are read or Ctrl-C is pressed.
pub fn run(args: &DetectArgs, address: &Address, detector: Perception, verification: Verification) -> Result<Outcome> {
    let server = match &args.draw {
        None => None,
        Some(port) => {
            let number = port.to_str().and_then(|port| port.parse().ok());
            let port = number.ok_or_else(|| {
                let found = port.display();
                Usage(format!("--draw: with --from expected a port of 127.0.0.1 (0 for any), found \"{found}\""))
            })?;
            let server = MjpegServer::start(port)?;
            eprintln!("pictures at {}", server.url());
            Some(server)
        }
    };
    let mut frames = open(args, address, &detector)?;
    let mut tracking = TrackerConfig::DEFAULT;
    tracking.max_parts = args.max as usize;
    let tracking = (!args.every_frame && verification != Verification::Off).then_some(tracking);
    let mut finder = FrameDetector::new(detector, verification, tracking, address, frames.wait())?;
    let interrupt = Interrupt::watch();
    let mut stdout = std::io::stdout().lock();
    let mut found_any = false;
    let [mut num_searched, mut num_failed] = [0_u64; 2];
    let mut left = args.frames.unwrap_or(u64::MAX);
    let mut sizes = FrameSizes::default();
    while left > 0 && !interrupt.is_requested() {
        let mut frame = match frames.take() {
            Next::Frame(frame) => frame,
            Next::None => continue,
            Next::End => break,
            Next::Error(error) if error.is_passing() => {
                // A torn frame of a stream is replaced by the next one, a broken file is a picture that cannot be used.
                num_failed += u64::from(!address.is_live() && matches!(error.fault(), Some(Fault::Torn { .. })));
                write_error(&mut stdout, args, address, &error.into())?;
                continue;
            }
            Next::Error(error) => return Err(error.into()),
        };
        left -= 1;
        let began = Instant::now();
        let picture = Arc::new(std::mem::take(&mut frame.picture));
        // In a folder, every picture of a wrong size is reported, like every other unusable picture.
        if !matches!(address, Address::Folder { .. }) {
            match sizes.check(finder.perception(), &picture).context("the camera's pictures")? {
                FrameSize::Right => {}
                FrameSize::WrongAgain => continue,
                FrameSize::Wrong(error) => {
                    let skipped = anyhow!("frames of this size are skipped: {}", one_line(&error.into()));
                    write_error(&mut stdout, args, address, &skipped.context(format!("frame {}", frame.number)))?;
                    continue;
                }
            }
        }
        let parts = match finder.find(&picture, &frame) {
            Ok(parts) => parts,
            // In a folder, an error in one picture does not affect other pictures.
            Err(error) if matches!(address, Address::Folder { .. }) => {
                let error = anyhow::Error::from(error).context(format!("frame {} of {address}", frame.number));
                write_error(&mut stdout, args, address, &error)?;
                num_failed += 1;
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        num_searched += 1;
        let seconds = began.elapsed().as_secs_f64();
        found_any |= parts.iter().any(|part| part.is_seen(args.min_score));
        write_line(&mut stdout, args, finder.perception(), &frame, picture.dimensions(), seconds, &parts)?;
        if let Some(server) = &server {
            let mut drawn = RgbImage::clone(&picture);
            drawing::draw_region(&mut drawn, finder.perception().region());
            drawing::draw_parts(&mut drawn, &parts, args.min_score);
            let num_seen = parts.iter().filter(|part| part.is_seen(args.min_score)).count();
            let parts_word = if num_seen == 1 { "part" } else { "parts" };
            server.publish(drawn, format!("{num_seen} {parts_word} to grasp"));
        }
    }
    if num_searched == 0 && num_failed > 0 {
        bail!("{num_failed} of {num_failed} pictures could not be used");
    }
    Ok(if found_any { Outcome::Done } else { Outcome::NothingToGrasp })
}

/// Opens the camera with the size of its calibration, or of the model's region.
fn open(args: &DetectArgs, address: &Address, detector: &Perception) -> Result<Frames> {
    let of_region = detector.region().and_then(|region| region.picture);
    let size = detector.picture_size().or(of_region);
    if let Some(size) = size {
        let whose = if detector.picture_size().is_some() { "of the calibration" } else { "of the region" };
        args.request.check_size(size, whose)?;
    }
    let mut options = args.request.options(address)?;
    options.frame = detector.pixel_frame();
    if let Some([width, height]) = size {
        (options.width, options.height) = (width, height);
    }
    Ok(Frames::of(live_pictures::open(address, &options)?, address))
}

fn write_line(
    out: &mut impl Write,
    args: &DetectArgs,
    detector: &Perception,
    frame: &Frame,
    (width, height): (u32, u32),
    seconds: f64,
    parts: &[Part],
) -> Result<()> {
    let mut shown: Vec<&Part> = parts.iter().filter(|part| args.all || part.is_seen(args.min_score)).collect();
    shown.sort_by(|one, other| one.by_score(other));
    let words = DetectionWords { detector, picture_size: [width, height], min_score: args.min_score };
    let text = FoundText { words, paint: Paint::stdout() };
    let detections: Vec<&GraspDetection> = shown.iter().map(|part| &part.found.detection).collect();
    let touched = detector.touched_among_accepted(&detections, |idx| shown[idx].is_seen(args.min_score));
    if args.json {
        let line = FrameRecord::new(frame, (width, height), detector, seconds, &shown, touched);
        writeln!(out, "{}", json_line(&line)?)?;
    } else {
        for fault in &frame.faults {
            writeln!(out, "frame {}: {fault}", frame.number)?;
        }
        if shown.is_empty() {
            let nothing = text.paint.text(Tone::Doubtful, "nothing to grasp");
            writeln!(out, "frame {}: {nothing} ({:.1} ms)", frame.number, 1e3 * seconds)?;
        }
        for (part, touched) in shown.iter().zip(touched) {
            let touched: Vec<&GraspDetection> = touched.into_iter().map(|idx| detections[idx]).collect();
            let line = text.part_line(part, &touched);
            writeln!(out, "frame {}: {line} ({:.1} ms)", frame.number, 1e3 * seconds)?;
        }
    }
    // Flushed, because programs that read the output wait for the lines of this frame.
    Ok(out.flush()?)
}

fn write_error(out: &mut impl Write, args: &DetectArgs, address: &Address, error: &anyhow::Error) -> Result<()> {
    let error = one_line(error);
    if args.json {
        let line = serde_json::json!({ "camera": address.to_string(), "error": error });
        writeln!(out, "{line}")?;
        out.flush()?;
    } else {
        eprintln!("{error}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::time::Duration;

    use clap::Parser;
    use nalgebra::Vector2;
    use sdg_demonstration::Demonstration;
    use sdg_grasp::{ModelKind, TeachOptions, TrackState, teach};
    use serde_json::Value;

    use super::*;
    use crate::args::{Args, Command};

    #[test]
    fn a_tracked_part_is_accepted_while_it_is_followed() {
        // The program without the simulation has no demonstrations in it.
        let photo = include_bytes!("../../../../../datasets/demonstrations/pendulum/image.png");
        let marks = include_bytes!("../../../../../datasets/demonstrations/pendulum/annotation.json");
        let photo = Demonstration::decode(photo, marks, None).unwrap();
        let picture = photo.image.clone();
        let mut options = TeachOptions::new(1);
        options.kind = ModelKind::S;
        let model = teach(&[photo], &options, &mut |_| ControlFlow::Continue(())).unwrap().model;
        let perception = Perception::of_any_camera(model);
        let found = perception.detect(&picture, Verification::ByShape).unwrap().remove(0);
        // The jaws at the first part would touch the second one.
        let part = |id: u64, beside_px: [f64; 2], score: f64, state: TrackState| {
            let mut found = found.clone();
            let detection = &mut found.detection;
            detection.score = score;
            detection.grasp.x += beside_px[0];
            detection.grasp.y += beside_px[1];
            let corners = &mut detection.outline.as_mut().unwrap().vertices;
            corners.iter_mut().for_each(|corner| *corner += Vector2::from(beside_px));
            Part { found, track: Some((id, state, Duration::ZERO)) }
        };
        let printed = |state: TrackState, form: &str| {
            let line = ["sdg", "detect", "--grasp-model", "m", "--from", "v4l:", "--all", form];
            let Command::Detect(args) = Args::try_parse_from(line).unwrap().command else { panic!("another command") };
            let parts = [part(1, [59.0, -6.0], 0.4, TrackState::Followed), part(0, [0.0, 0.0], 0.9, state)];
            let frame = Frame::new(RgbImage::new(1, 1), 0, "v4l:".into());
            let mut out = Vec::new();
            write_line(&mut out, &args, &perception, &frame, picture.dimensions(), 0.0, &parts).unwrap();
            String::from_utf8(out).unwrap()
        };
        let touched = |state: TrackState| {
            let line: Value = serde_json::from_str(&printed(state, "--json")).unwrap();
            // The best part comes first, whatever the number of its track.
            assert_eq!([0_usize, 1].map(|idx| line["detections"][idx]["track"].clone()), [0, 1]);
            [0_usize, 1].map(|idx| line["detections"][idx]["jaws_touch"].clone())
        };
        assert_eq!(touched(TrackState::Followed)[0], serde_json::json!([1]));
        assert_eq!(touched(TrackState::Lost), [Value::Null, Value::Null]);
        let told = printed(TrackState::Lost, "--every-frame");
        assert!(told.contains("part 1 lost, ") && told.contains("part 2 followed, "), "{told}");
        assert!(!told.contains("refused") && !told.contains("warning"), "{told}");
    }
}
