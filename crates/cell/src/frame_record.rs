//! The JSON record of a camera's frame and its parts, as printed by `sdg detect --from` (docs/command-line.md).

use sdg_camera::{Fault, Frame};
use sdg_grasp::TrackState;
use serde::Serialize;

use crate::live_detection::Part;
use crate::perception::Perception;
use crate::record::FoundRecord;
use crate::region_record::RegionRecord;

/// A frame and its parts.
#[derive(Debug, Clone, Serialize)]
pub struct FrameRecord<'a> {
    /// The camera's address.
    pub camera: &'a str,
    /// Name of the part that the model detects.
    pub object: &'a str,
    /// Number of the frame.
    pub frame: u64,
    /// Seconds since 1970.
    pub captured: f64,
    /// Width of the frame.
    pub width: u32,
    /// Height of the frame.
    pub height: u32,
    /// Duration of the search.
    pub seconds: f64,
    /// The searched region; absent if the whole frame is searched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionRecord>,
    /// Faults of the frame.
    pub faults: Vec<FaultRecord>,
    /// The listed parts.
    pub detections: Vec<PartRecord>,
}

/// A fault of a frame.
#[derive(Debug, Clone, Serialize)]
pub struct FaultRecord {
    /// Its name.
    pub fault: &'static str,
    /// Its text.
    pub why: String,
}

/// A part in a frame.
#[derive(Debug, Clone, Serialize)]
pub struct PartRecord {
    /// The detection.
    #[serde(flatten)]
    pub found: FoundRecord,
    /// Indices, in the list of detections, of the parts that the jaws would touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jaws_touch: Vec<usize>,
    /// Number of the part's track; absent without tracking, like the next two fields.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<u64>,
    /// State of the track.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<&'static str>,
    /// Seconds since the part was first found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_s: Option<f64>,
}

/// The name of a track's state in records.
pub fn track_state_name(state: TrackState) -> &'static str {
    match state {
        TrackState::Followed => "followed",
        TrackState::FoundAgain => "found_again",
        TrackState::Lost => "lost",
    }
}

impl<'a> FrameRecord<'a> {
    /// The record of a frame of this size; `touched` has for each of the `parts` the indices of the parts that the jaws
    /// would touch.
    pub fn new(
        frame: &'a Frame,
        (width, height): (u32, u32),
        detector: &'a Perception,
        seconds: f64,
        parts: &[&Part],
        touched: Vec<Vec<usize>>,
    ) -> Self {
        let record = |(part, jaws_touch): (&&Part, Vec<usize>)| PartRecord {
            found: FoundRecord::new(&part.found, detector),
            jaws_touch,
            track: part.track.map(|(number, ..)| number),
            state: part.track.map(|(_, state, _)| track_state_name(state)),
            age_s: part.track.map(|(.., age)| age.as_secs_f64()),
        };
        let fault = |fault: &Fault| FaultRecord { fault: fault.name(), why: fault.to_string() };
        Self {
            camera: &frame.camera,
            object: detector.model().object(),
            frame: frame.number,
            captured: frame.captured_unix_secs(),
            width,
            height,
            seconds,
            region: detector.region().map(RegionRecord::of),
            faults: frame.faults.iter().map(fault).collect(),
            detections: parts.iter().zip(touched).map(record).collect(),
        }
    }
}
