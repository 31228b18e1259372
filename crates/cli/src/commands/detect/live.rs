//! `sdg detect --from`: parts in live pictures, a line for each frame.
//!
//! ```text
//! camera ─ frame ─┬─ LiveTracker: followed from frame to frame, searches beside ─┬─ line on standard output
//!                 └─ --every-frame: each frame searched on its own ──────────────┴─ picture on 127.0.0.1 (--draw)
//! ```

use std::io::Write;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Result;
use image::RgbImage;
use sdg_camera::{Address, Camera, CameraError, Frame, LatestFrame, MjpegServer};
use sdg_cell::FoundRecord;
use sdg_cell::drawing;
use sdg_cell::{Found, LiveTracker, Perception, SearchTime};
use sdg_grasp::{TrackState, TrackerConfig, Verification};
use serde::Serialize;

use super::args::DetectArgs;
use crate::exit::{Outcome, Usage, one_line};
use crate::found_text::Wording;
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::live_pictures;

/// How long the newest frame is waited for before Ctrl-C is looked at again.
const MAX_WAIT: Duration = Duration::from_millis(200);

/// Reads frames until the camera ends, `--frames` are read or Ctrl-C is pressed.
pub fn run(args: &DetectArgs, address: &Address, detector: Perception) -> Result<Outcome> {
    let server = match &args.draw {
        None => None,
        Some(port) => {
            let port = port.to_str().and_then(|port| port.parse().ok());
            let port = port.ok_or_else(|| {
                Usage(format!("--draw: with --from expected a port of 127.0.0.1 (0 for any), found {:?}", args.draw))
            })?;
            let server = MjpegServer::start(port)?;
            eprintln!("pictures at {}", server.url());
            Some(server)
        }
    };
    let mut frames = Frames::open(address, args, &detector)?;
    let mut finder = FrameDetector::new(args, address, frames.wait(), detector)?;
    let interrupt = Interrupt::watch();
    let mut stdout = std::io::stdout().lock();
    let mut found_any = false;
    let mut left = args.frames.unwrap_or(u64::MAX);
    while left > 0 && !interrupt.is_requested() {
        let mut frame = match frames.next() {
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
        let parts = match finder.find(&picture, &frame) {
            Ok(parts) => parts,
            // One picture of a folder says nothing of the others.
            Err(error) if matches!(address, Address::Folder { .. }) => {
                let error = error.context(format!("frame {} of {address}", frame.number));
                write_error(&mut stdout, args, address, &error)?;
                continue;
            }
            Err(error) => return Err(error),
        };
        let seconds = began.elapsed().as_secs_f64();
        found_any |= parts.iter().any(|part| part.is_seen(args.min_score));
        write_line(&mut stdout, args, &finder.detector, &frame, picture.dimensions(), seconds, &parts)?;
        if let Some(server) = &server {
            let seen = parts.iter().filter(|part| part.is_seen(args.min_score)).map(|part| &part.found.detection);
            let mut drawn = RgbImage::clone(&picture);
            drawing::draw_detections(&mut drawn, seen, args.min_score, &[]);
            server.publish(drawn);
        }
    }
    Ok(if found_any { Outcome::Done } else { Outcome::NothingToGrasp })
}

/// The frames of a camera: of a stream the newest, of stored and rendered pictures and of those on request each.
enum Frames {
    Newest(LatestFrame),
    Each(Box<dyn Camera>),
}

enum Next {
    Frame(Frame),
    /// None yet.
    None,
    End,
    Error(CameraError),
}

impl Frames {
    /// A calibrated camera is asked for the size that it was calibrated with.
    fn open(address: &Address, args: &DetectArgs, detector: &Perception) -> Result<Self> {
        let mut options = args.request.options();
        options.frame = detector.pixel_frame();
        if let Some([width, height]) = detector.picture_size() {
            (options.width, options.height) = (width, height);
        }
        let camera = live_pictures::open(address, &options)?;
        Ok(match address {
            Address::Sim(_) => Self::Each(camera),
            _ if camera.is_on_request() => Self::Each(camera),
            _ => Self::Newest(LatestFrame::spawn(camera)),
        })
    }

    /// Whether none comes before it is asked for.
    fn wait(&self) -> bool {
        matches!(self, Self::Each(camera) if camera.is_on_request())
    }

    fn next(&mut self) -> Next {
        match self {
            Self::Newest(newest) => match newest.take(MAX_WAIT) {
                Ok(Some(frame)) => Next::Frame(frame),
                Ok(None) if newest.has_ended() => Next::End,
                Ok(None) => Next::None,
                Err(error) => Next::Error(error),
            },
            Self::Each(camera) => match camera.next_frame() {
                Ok(Some(frame)) => Next::Frame(frame),
                Ok(None) => Next::End,
                Err(error) => Next::Error(error),
            },
        }
    }
}

/// A part in a frame, and which track it is of.
struct Part {
    found: Found,
    track: Option<(u64, TrackState, Duration)>,
}

impl Part {
    /// Whether it is there in this frame.
    fn is_seen(&self, min_score: f64) -> bool {
        match self.track {
            Some((_, state, _)) => state != TrackState::Lost,
            None => self.found.detection.score >= min_score,
        }
    }
}

/// Parts of a frame, with or without those of the frames before.
struct FrameDetector {
    detector: Perception,
    verification: Verification,
    tracker: Option<LiveTracker>,
    /// The time from one stored picture to the next; `None` where frames have times of their own.
    interval: Option<Duration>,
    /// What frame times are counted from.
    first: Option<SystemTime>,
}

/// Between stored pictures that are played without a rate: nothing says that one follows from the other.
const UNRELATED: Duration = Duration::from_secs(1);

impl FrameDetector {
    fn new(args: &DetectArgs, address: &Address, frames_wait: bool, detector: Perception) -> Result<Self> {
        // The time of a file's last change is not that of its picture.
        let interval = match address {
            Address::Folder { playback, .. } | Address::File { playback, .. } => {
                Some(playback.interval.unwrap_or(UNRELATED))
            }
            _ => None,
        };
        let verification = if args.no_verify { Verification::Off } else { Verification::ByShape };
        let tracker = match args.every_frame || args.no_verify {
            true => None,
            false => {
                let mut config = TrackerConfig::DEFAULT;
                config.max_parts = args.max as usize;
                if frames_wait {
                    config.moves_within = Duration::ZERO;
                }
                Some(LiveTracker::new(&detector, config, SearchTime::AsItTakes)?)
            }
        };
        Ok(Self { detector, verification, tracker, interval, first: None })
    }

    fn find(&mut self, picture: &Arc<RgbImage>, frame: &Frame) -> Result<Vec<Part>> {
        self.detector.check_picture(picture)?;
        let Some(tracker) = &mut self.tracker else {
            let found = self.detector.detect(picture, self.verification)?;
            return Ok(found.into_iter().map(|found| Part { found, track: None }).collect());
        };
        let first = *self.first.get_or_insert(frame.captured);
        let since = match self.interval {
            Some(interval) => interval.mul_f64(frame.number as f64),
            None => frame.captured.duration_since(first).unwrap_or_default(),
        };
        let parts = tracker.frame(Arc::clone(picture), since)?;
        let part = |part: sdg_grasp::TrackedPart| Part {
            track: Some((part.id, part.state, part.age)),
            found: Found { detection: part.detection, pose: part.pose },
        };
        Ok(parts.into_iter().map(part).collect())
    }
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
    let shown = || parts.iter().filter(|part| args.all || part.is_seen(args.min_score));
    if args.json {
        let record = |part: &Part| PartLine {
            found: FoundRecord::new(&part.found, detector),
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
            faults: frame.faults.iter().map(fault).collect(),
            detections: shown().map(record).collect(),
        };
        writeln!(out, "{}", json_line(&line)?)?;
    } else {
        for fault in &frame.faults {
            writeln!(out, "frame {}: {fault}", frame.number)?;
        }
        if shown().next().is_none() {
            writeln!(out, "frame {}: nothing to grasp ({:.1} ms)", frame.number, 1e3 * seconds)?;
        }
        let wording = Wording { detector, picture_size: [width, height], min_score: args.min_score };
        for part in shown() {
            let of = part.track.map(|(id, state, _)| format!("part {id} {}, ", state_name(state).replace('_', " ")));
            let text = wording.line(&part.found);
            writeln!(out, "frame {}: {}{text} ({:.1} ms)", frame.number, of.unwrap_or_default(), 1e3 * seconds)?;
        }
    }
    // Whoever reads the stream waits for this frame.
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

/// A line of `--json` for a frame.
#[derive(Serialize)]
struct FrameLine<'a> {
    camera: &'a str,
    /// The part that the model looks for.
    object: &'a str,
    frame: u64,
    /// Seconds since 1970.
    captured: f64,
    width: u32,
    height: u32,
    seconds: f64,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    track: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    age_s: Option<f64>,
}
