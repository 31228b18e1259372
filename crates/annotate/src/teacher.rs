//! What the page needs of grasp models, which this crate does not depend on: the caller implements these traits.

use std::ops::ControlFlow;
use std::time::Duration;

use image::RgbImage;
use sdg_demonstration::{Demonstration, ModelKind};
use sdg_geometry::{BoundingBox, PlanarGrasp, Polygon};
use serde::{Deserialize, Serialize};

use crate::error::{Error, TeacherError};
use crate::region::Region;

/// More steps than any teaching has.
const MAX_STEPS: usize = 1_000_000;

/// Teaches grasp models.
pub trait GraspTeacher: Send + Sync + 'static {
    /// Teaches a model; half a minute and more for one with a network. `observe` is called with the progress and may end the teaching, which
    /// then keeps what there is.
    ///
    /// # Errors
    /// Whatever teaching complains of, in one line for the person at the page.
    fn teach(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError>;

    /// Teaches a model of those without a network, to see what a further demonstration would change: it takes a second, is not tried on samples
    /// and has no figures.
    ///
    /// # Errors
    /// As [`Self::teach`].
    fn teach_on_trial(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
    ) -> Result<Box<dyn TaughtModel>, TeacherError>;

    /// Says whether the part of these demonstrations can be looked for in a region, before a model is taught of them.
    ///
    /// # Errors
    /// A region that the part does not fit in, or that is not of the camera's pictures.
    fn check_region(&self, region: &Region, demonstrations: &[Demonstration]) -> Result<(), TeacherError>;

    /// Reads a model that was taught before; `summary` is what was said of it then.
    ///
    /// # Errors
    /// Bytes that are no model file.
    fn open(&self, bytes: &[u8], summary: &TaughtSummary) -> Result<Box<dyn TaughtModel>, TeacherError>;
}

/// What a model is taught from.
#[derive(Debug, Clone, Default)]
pub struct TeachingMaterial {
    /// Photos of the part with their marks.
    pub demonstrations: Vec<Demonstration>,
    /// Pictures without it.
    pub negatives: Vec<RgbImage>,
}

/// A model, ready to look for the part.
pub trait TaughtModel: Send + Sync {
    /// What it is and how good it was found to be.
    fn summary(&self) -> TaughtSummary;

    /// The model file.
    ///
    /// # Errors
    /// A model that cannot be written down.
    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError>;

    /// The part of pictures that is searched; all of them where `None`.
    fn region(&self) -> Option<Region>;

    /// Searches this part of pictures alone from now on; all of them with `None`. The model file stays as it is.
    ///
    /// # Errors
    /// A region that the part does not fit in, or that is not of the camera's pictures.
    fn look_in(&self, region: Option<Region>) -> Result<(), TeacherError>;

    /// Finds the part, best score first; those below 0.5 are listed too.
    ///
    /// # Errors
    /// An image that cannot be looked at.
    fn detect(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError>;

    /// The same, with the places where picture and demonstration differ under the best refused ones, which takes longer.
    ///
    /// # Errors
    /// As [`Self::detect`].
    fn detect_explained(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        self.detect(image)
    }
}

/// How to teach, as asked on the page.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TeachRequest {
    /// The grasp model to teach.
    pub model: ModelKind,
    /// Seconds that the training may take at most.
    #[serde(default)]
    pub time_budget_secs: Option<f64>,
    /// Optimiser steps instead of the preset's.
    #[serde(default)]
    pub steps: Option<usize>,
    /// Equal turns in a whole one; 0 for a part whose turn cannot be seen.
    #[serde(default = "one")]
    pub symmetry: u32,
    /// The camera is always as far from the part as it was for the photo, so that parts of another size are refused.
    #[serde(default)]
    pub fixed_height: bool,
    /// Decides every random choice.
    #[serde(default = "one_seed")]
    pub seed: u64,
    /// The part of pictures that the model searches. The session says it, not the page.
    #[serde(skip)]
    pub region: Option<Region>,
}

fn one() -> u32 {
    1
}

fn one_seed() -> u64 {
    1
}

impl TeachRequest {
    /// The time budget, if it is one.
    pub fn time_budget(&self) -> Option<Duration> {
        self.time_budget_secs.and_then(|secs| Duration::try_from_secs_f64(secs).ok())
    }

    /// # Errors
    /// A time limit or a number of steps or turns that no teaching can have.
    pub(crate) fn check(&self) -> crate::error::Result<()> {
        let refuse =
            |what, expected: &str, found: String| Err(Error::Request { what, expected: expected.into(), found });
        if let Some(secs) = self.time_budget_secs
            && (self.time_budget().is_none() || secs <= 0.0)
        {
            return refuse("time limit", "a positive number of seconds", secs.to_string());
        }
        if let Some(steps) = self.steps
            && !(1..=MAX_STEPS).contains(&steps)
        {
            return refuse("steps", "1 to 1000000", steps.to_string());
        }
        if self.symmetry > 360 {
            return refuse("symmetry", "0 to 360 equal turns", self.symmetry.to_string());
        }
        Ok(())
    }
}

/// One piece of news from a teaching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TeachingStep {
    /// An optimiser step was done.
    Step {
        /// What is being taught: `the network`, `its angles`.
        of: &'static str,
        /// Whether no other network is to be taught after it.
        is_last: bool,
        /// Steps done.
        done: usize,
        /// Steps that there will be, as known now.
        planned: usize,
        /// The loss before the step.
        loss: f64,
    },
    /// The model was tried on held-back samples.
    Validated {
        /// Steps done before it.
        done: usize,
        /// Share of the parts that were found, in `[0, 1]`.
        hit_rate: f64,
    },
}

/// A taught model and its measured quality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaughtSummary {
    /// The grasp model.
    pub model: ModelKind,
    /// The object's name.
    pub object: String,
    /// Wall-clock time of the teaching, with that of trying the model on held-back samples.
    pub seconds: f64,
    /// What the finished model made of held-back samples; `None` where it was not tried on any.
    pub figures: Option<Figures>,
    /// What came of the pictures without the part.
    pub negatives: Option<NegativesRefused>,
}

/// What a finished model made of held-back samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Parts found, and out of how many.
    pub found: [usize; 2],
    /// Between which shares the true one lies, with 95 % confidence.
    pub found_interval: [f64; 2],
    /// Detections beside the part.
    pub wrong: usize,
    /// Samples without the part in which something was accepted, and out of how many.
    pub false_alarms: [usize; 2],
    /// Their share, likewise.
    pub false_alarms_interval: [f64; 2],
    /// Median error of the place, and its unit: px of the photo, or mm.
    pub error: Option<(f64, String)>,
    /// Median error of the turn.
    pub error_degrees: Option<f64>,
    /// Parts that it finds in the photos beside those that are marked; they were taken out of the samples.
    #[serde(default)]
    pub others_in_photo: usize,
}

/// How many of the person's pictures without the part are refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NegativesRefused {
    /// Pictures in which nothing is accepted.
    pub refused: usize,
    /// All of them.
    pub pictures: usize,
}

/// Why a grasp is refused, for the person at the page.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Refusal {
    /// The strongest reasons.
    pub reason: String,
    /// What would help.
    pub remedy: Option<String>,
    /// Places of the picture where edges differ from the photo's, in pixels.
    pub edges: Vec<[f64; 2]>,
    /// Places where the surface differs.
    pub surface: Vec<[f64; 2]>,
}

/// One grasp that a model found, in pixels of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundGrasp {
    /// Calibrated, in `[0, 1]`: at least 0.5 is accepted.
    pub score: f64,
    /// Whether the part is there.
    pub is_accepted: bool,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// Its outline as the demonstration lies in the image.
    pub outline: Option<Polygon>,
    /// Grasp point, direction and width, in pixels.
    pub grasp: PlanarGrasp,
    /// Length of the marked line in this image.
    pub line_length: f64,
    /// Where that is over the table, if the camera is calibrated.
    pub pose: Option<GraspPose>,
    /// Why it is not accepted; `None` for what is.
    pub refusal: Option<Refusal>,
    /// Numbers, in the picture's list, of those whose parts its jaws touch, found ones or not.
    pub touches: Vec<usize>,
}

/// A grasp in millimetres and degrees, for people.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GraspPose {
    /// What positions are given in: `table`, `base`.
    pub frame: &'static str,
    /// The middle between the jaws.
    pub position_mm: [f64; 3],
    /// The turn about the frame's z.
    pub yaw_deg: f64,
    /// Opening of the jaws, mm.
    pub opening_mm: f64,
    /// One standard deviation of the position.
    pub sigma_mm: f64,
    /// One standard deviation of the turn.
    pub sigma_deg: f64,
}
