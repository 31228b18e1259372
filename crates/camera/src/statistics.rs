//! Counts of a camera's frames and faults over a period.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::fault::Fault;
use crate::frame::{Frame, mean_brightness};

/// Frames and faults since the beginning of a period.
#[derive(Debug, Clone)]
pub struct FrameStatistics {
    start: Instant,
    /// Number of frames.
    pub num_frames: u64,
    /// Number of frames that were not delivered, by the gaps in the frames' numbers.
    pub num_missed: u64,
    last_number: Option<u64>,
    /// Width and height of the last frame.
    pub size: (u32, u32),
    brightness_sum: f64,
    /// For each fault's name: the count and the text of the last fault.
    pub faults: BTreeMap<&'static str, (u64, String)>,
}

impl FrameStatistics {
    /// Begins a period now.
    pub fn begin() -> Self {
        Self {
            start: Instant::now(),
            num_frames: 0,
            num_missed: 0,
            last_number: None,
            size: (0, 0),
            brightness_sum: 0.0,
            faults: BTreeMap::new(),
        }
    }

    /// Begins the period after this one. Frames missed between the two are counted in the new one.
    pub fn begin_next(&self) -> Self {
        Self { last_number: self.last_number, ..Self::begin() }
    }

    /// Whether there was neither a frame nor a fault.
    pub fn is_empty(&self) -> bool {
        self.num_frames == 0 && self.faults.is_empty()
    }

    /// Counts a frame and its faults.
    pub fn add_frame(&mut self, frame: &Frame) {
        self.num_frames += 1;
        self.num_missed += self.last_number.map_or(0, |last| frame.number.saturating_sub(last + 1));
        self.last_number = Some(frame.number);
        self.size = frame.picture.dimensions();
        self.brightness_sum += mean_brightness(&frame.picture);
        for fault in &frame.faults {
            self.add_fault(fault);
        }
    }

    /// Counts a fault.
    pub fn add_fault(&mut self, fault: &Fault) {
        let entry = self.faults.entry(fault.name()).or_default();
        *entry = (entry.0 + 1, fault.to_string());
    }

    /// Time since the beginning.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Frames per second.
    pub fn fps(&self) -> f64 {
        self.num_frames as f64 / self.elapsed().as_secs_f64()
    }

    /// Mean brightness of all frames, from 0 to 255; `None` without frames.
    pub fn brightness(&self) -> Option<f64> {
        (self.num_frames > 0).then(|| self.brightness_sum / self.num_frames as f64)
    }
}
