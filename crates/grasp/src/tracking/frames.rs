//! The newest frame, and older frames while one of them is searched or its detections are carried forward.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use image::RgbImage;

/// Maximum time between frames through which a detection is carried: a part at 0.5 m/s moves by 20 mm, 20 pixels at 1
/// px per mm, which is within a capture's range. Derived from this range.
const MAX_STRIDE: Duration = Duration::from_millis(40);
/// Maximum number of frames kept for a running search; beyond it, only every second frame is kept. Chosen by hand: 44
/// MB with 640×480 pixels.
const MAX_BUFFERED: usize = 48;
/// A frame that may still be needed.
#[derive(Debug, Clone)]
pub(super) struct BufferedFrame {
    pub(super) number: u64,
    pub(super) picture: Arc<RgbImage>,
    pub(super) time: Duration,
}

/// The newest frame, and the frames since the searched one.
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

    /// Drops the frames older than `oldest`, except the newest.
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

    /// The frame to which a result of frame `number` is carried next; `None` if the newest frame is not much later,
    /// because every track is followed into the newest frame anyway.
    pub(super) fn next_after(&self, number: u64, time: Duration) -> Option<&BufferedFrame> {
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
