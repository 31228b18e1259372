//! Pictures by an outside camera at regular intervals of simulated time, for an animation.

use std::sync::Arc;

use image::RgbImage;

use crate::data::Data;
use crate::error::{Result, SimulationError};
use crate::model::{Camera, Id, Model};
use crate::render::{RenderConfig, Renderer, Tessellation};

/// Settings of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordConfig {
    /// Simulated time between two pictures, in seconds.
    pub period_secs: f64,
    /// Size and quality of the pictures.
    pub render: RenderConfig,
}

impl Default for RecordConfig {
    /// Six pictures per second, of the size of a report's animation, which shows twelve at twice the speed.
    fn default() -> Self {
        let tessellation = Tessellation::Coarse;
        let render = RenderConfig { width: 320, height: 240, tessellation, ..RenderConfig::default() };
        Self { period_secs: 1.0 / 6.0, render }
    }
}

/// Collects the pictures.
pub(crate) struct Recorder {
    renderer: Renderer,
    camera: Id<Camera>,
    period_secs: f64,
    next_secs: f64,
    frames: Vec<RgbImage>,
}

impl Recorder {
    pub(crate) fn new(model: &Arc<Model>, camera: Id<Camera>, config: &RecordConfig) -> Result<Self> {
        if !(config.period_secs.is_finite() && config.period_secs > 0.0) {
            return Err(SimulationError::Configuration {
                field: "record period",
                expected: "a positive number of seconds".into(),
                found: config.period_secs.to_string(),
            });
        }
        let renderer = Renderer::new(model, config.render)?;
        Ok(Self { renderer, camera, period_secs: config.period_secs, next_secs: 0.0, frames: Vec::new() })
    }

    /// Takes a picture if one is due.
    pub(crate) fn look(&mut self, data: &mut Data) -> Result<()> {
        if data.time_secs() + 1e-9 >= self.next_secs {
            self.frames.push(self.renderer.image(data, self.camera)?);
            self.next_secs = data.time_secs() + self.period_secs;
        }
        Ok(())
    }

    pub(crate) fn into_frames(self) -> Vec<RgbImage> {
        self.frames
    }
}
