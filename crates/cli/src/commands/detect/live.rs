//! `sdg detect --from`: parts in live pictures, frame by frame.
//!
//! ```text
//! camera ─ frame ─┬─ LiveTracker: tracked, and searched on a second thread ─┬─ line on standard output
//!                 └─ --every-frame, --no-verify: each frame searched alone ─┴─ picture on 127.0.0.1 (--draw)
//! ```

use std::io::Write;
use std::sync::Arc;
use std::time::{Instant, UNIX_EPOCH};

use anyhow::{Result, anyhow, bail};
use image::RgbImage;
use sdg_camera::{Address, Frame, MjpegServer};
use sdg_cell::{FoundRecord, FrameDetector, Frames, Next, Part, Perception, drawing};
use sdg_grasp::{GraspDetection, TrackState, TrackerConfig, Verification};
use serde::Serialize;

use super::args::DetectArgs;
use super::region_record::RegionRecord;
use crate::exit::{Outcome, Usage, one_line};
use crate::found_text::Wording;
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::live_pictures;
use crate::paint::{Paint, Tone};

/// Reads frames until the camera ends, `--frames` are read or Ctrl-C is pressed.
pub fn run(args: &DetectArgs, address: &Address, detector: Perception) -> Result<Outcome> {
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
    let verification = if args.no_verify { Verification::Off } else { Verification::ByShape };
    let mut tracking = TrackerConfig::DEFAULT;
    tracking.max_parts = args.max as usize;
    let tracking = (!args.every_frame && !args.no_verify).then_some(tracking);
    let mut finder = FrameDetector::new(detector, verification, tracking, address, frames.wait())?;
    let interrupt = Interrupt::watch();
    let mut stdout = std::io::stdout().lock();
    let mut found_any = false;
    let [mut num_searched, mut num_failed] = [0_u64; 2];
    let mut left = args.frames.unwrap_or(u64::MAX);
    let mut sizes = Sizes::default();
    while left > 0 && !interrupt.is_requested() {
        let mut frame = match frames.take() {
            Next::Frame(frame) => frame,
            Next::None => continue,
            Next::End => break,
            Next::Error(error) if error.is_passing() => {
                write_error(&mut stdout, args, address, &error.into())?;
                continue;
            }
            Next::Error(error) => return Err(error.into()),
        };
        left -= 1;
        let began = Instant::now();
        let picture = Arc::new(std::mem::take(&mut frame.picture));
        // In a folder, every picture of a wrong size is reported, like every other unusable picture.
        if !matches!(address, Address::Folder { .. })
            && let Some(error) = sizes.check(finder.perception(), &picture)?
        {
            if let Some(error) = error {
                write_error(&mut stdout, args, address, &error.context(format!("frame {}", frame.number)))?;
            }
            continue;
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

/// Skips frames of a wrong size: after a camera is switched to another size, neither the region nor the calibration
/// applies.
#[derive(Default)]
struct Sizes {
    /// Whether a frame of the right size has arrived.
    is_any_right: bool,
    /// The last reported wrong size; `None` after a frame of the right size.
    told: Option<(u32, u32)>,
}

impl Sizes {
    /// `None` if the picture can be searched. A picture of a wrong size is skipped; the first one of its size in a
    /// row returns the error to report.
    ///
    /// # Errors
    /// The first picture of the stream has a wrong size: the following pictures would have it as well, and all would be
    /// skipped.
    fn check(&mut self, detector: &Perception, picture: &RgbImage) -> Result<Option<Option<anyhow::Error>>> {
        let Err(error) = detector.check_picture(picture) else {
            *self = Self { is_any_right: true, told: None };
            return Ok(None);
        };
        if !self.is_any_right {
            return Err(anyhow::Error::from(error).context("the camera's pictures"));
        }
        let is_told = self.told.replace(picture.dimensions()) == Some(picture.dimensions());
        let skipped = || anyhow!("frames of this size are skipped: {}", one_line(&error.into()));
        Ok(Some((!is_told).then(skipped)))
    }
}

/// Opens the camera with the size of its calibration, or of the model's region.
fn open(args: &DetectArgs, address: &Address, detector: &Perception) -> Result<Frames> {
    let mut options = args.request.options();
    options.frame = detector.pixel_frame();
    let of_region = detector.region().and_then(|region| region.picture);
    if let Some([width, height]) = detector.picture_size().or(of_region) {
        if let Some(asked) = args.request.size.filter(|&asked| asked != (width, height)) {
            let whose = if detector.picture_size().is_some() { "of the calibration" } else { "of the region" };
            return Err(Usage(format!(
                "--size: expected {width}x{height}, the size {whose}, found {}x{}",
                asked.0, asked.1
            ))
            .into());
        }
        (options.width, options.height) = (width, height);
    }
    Ok(Frames::of(live_pictures::open(address, &options)?, address))
}

fn state_name(state: TrackState) -> &'static str {
    match state {
        TrackState::Followed => "followed",
        TrackState::FoundAgain => "found_again",
        TrackState::Lost => "lost",
    }
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
    let shown: Vec<&Part> = parts.iter().filter(|part| args.all || part.is_seen(args.min_score)).collect();
    let wording =
        Wording { detector, picture_size: [width, height], min_score: args.min_score, paint: Paint::stdout() };
    let detections: Vec<&GraspDetection> = shown.iter().map(|part| &part.found.detection).collect();
    let touched = wording.touched(&detections);
    if args.json {
        let record = |(part, touched): (&&Part, Vec<usize>)| PartLine {
            found: FoundRecord::new(&part.found, detector),
            jaws_touch: touched,
            track: part.track.map(|(id, ..)| id),
            state: part.track.map(|(_, state, _)| state_name(state)),
            age_s: part.track.map(|(.., age)| age.as_secs_f64()),
        };
        let fault = |fault: &sdg_camera::Fault| FaultLine { fault: fault.name(), why: fault.to_string() };
        let line = FrameLine {
            camera: &frame.camera,
            object: detector.model().object(),
            frame: frame.number,
            captured: frame.captured.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
            width,
            height,
            seconds,
            region: detector.region().map(RegionRecord::of),
            faults: frame.faults.iter().map(fault).collect(),
            detections: shown.iter().zip(touched).map(record).collect(),
        };
        writeln!(out, "{}", json_line(&line)?)?;
    } else {
        for fault in &frame.faults {
            writeln!(out, "frame {}: {fault}", frame.number)?;
        }
        if shown.is_empty() {
            let nothing = wording.paint.text(Tone::Doubtful, "nothing to grasp");
            writeln!(out, "frame {}: {nothing} ({:.1} ms)", frame.number, 1e3 * seconds)?;
        }
        for (part, touched) in shown.iter().zip(touched) {
            let touched: Vec<&GraspDetection> = touched.into_iter().map(|idx| detections[idx]).collect();
            let of =
                part.track.map(|(id, state, _)| format!("part {} {}, ", id + 1, state_name(state).replace('_', " ")));
            let text = wording.line(&part.found, &touched);
            writeln!(out, "frame {}: {}{text} ({:.1} ms)", frame.number, of.unwrap_or_default(), 1e3 * seconds)?;
        }
    }
    // Flushed, because programs that read the output wait for this frame.
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

/// One line of `--json`: a frame.
#[derive(Serialize)]
struct FrameLine<'a> {
    camera: &'a str,
    /// Name of the part that the model detects.
    object: &'a str,
    frame: u64,
    /// Seconds since 1970.
    captured: f64,
    width: u32,
    height: u32,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<RegionRecord>,
    faults: Vec<FaultLine>,
    detections: Vec<PartLine>,
}

#[derive(Serialize)]
struct FaultLine {
    fault: &'static str,
    why: String,
}

#[derive(Serialize)]
struct PartLine {
    #[serde(flatten)]
    found: FoundRecord,
    /// As in the records of pictures: the indices of the parts that the jaws would touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    jaws_touch: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    track: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    age_s: Option<f64>,
}
