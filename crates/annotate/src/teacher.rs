//! Interface to grasp models, which this crate does not depend on: the caller implements these traits.

use std::ops::ControlFlow;
use std::time::Duration;

use image::RgbImage;
use sdg_demonstration::{Demonstration, ModelKind};
use sdg_geometry::{BoundingBox, PlanarGrasp, Polygon};
use serde::{Deserialize, Serialize};

use crate::error::{Error, TeacherError};
use crate::region::{Region, Searched};

/// Maximum number of steps of a teaching run.
const MAX_STEPS: usize = 1_000_000;

/// Teaches grasp models.
pub trait GraspTeacher: Send + Sync + 'static {
    /// Teaches a model; with a network this takes half a minute or more. `observe` receives the progress and may end
    /// the teaching run, which then keeps its current result.
    ///
    /// # Errors
    /// Any error of teaching, as one line for the user.
    fn teach(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError>;

    /// Teaches a model without a network, to see the effect of an additional demonstration. This takes a second; the
    /// model is not tested on samples and has no figures.
    ///
    /// # Errors
    /// As [`Self::teach`].
    fn teach_on_trial(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
    ) -> Result<Box<dyn TaughtModel>, TeacherError>;

    /// Checks, before a model is taught from these demonstrations, whether their part can be detected in a region.
    ///
    /// # Errors
    /// The part does not fit into the region, or the region exceeds the camera's pictures.
    fn check_region(&self, region: &Region, demonstrations: &[Demonstration]) -> Result<(), TeacherError>;

    /// Reads a model that was taught before, with its summary. If `searched` is given, it replaces the region in the
    /// model's file, which is then not checked.
    ///
    /// # Errors
    /// The bytes are not a model file, or the model cannot search the region.
    fn open(
        &self,
        bytes: &[u8],
        summary: &TaughtSummary,
        searched: Option<Searched>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError>;
}

/// The inputs of a teaching run.
#[derive(Debug, Clone, Default)]
pub struct TeachingMaterial {
    /// Photos of the part with their marks.
    pub demonstrations: Vec<Demonstration>,
    /// Pictures without the part.
    pub negatives: Vec<RgbImage>,
    /// The names of these pictures, for errors.
    pub negative_names: Vec<String>,
}

/// A model that detects the part.
pub trait TaughtModel: Send + Sync {
    /// The model's facts and measured quality.
    fn summary(&self) -> TaughtSummary;

    /// The model file.
    ///
    /// # Errors
    /// The model cannot be serialised.
    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError>;

    /// The searched region; `None` for the whole picture.
    fn region(&self) -> Option<Region>;

    /// Restricts the search to a region; `None` for the whole picture. The model's file is not changed.
    ///
    /// # Errors
    /// The part does not fit into the region, or the region exceeds the camera's pictures.
    fn look_in(&self, region: Option<Region>) -> Result<(), TeacherError>;

    /// Detects the part, best score first; detections below 0.5 are included.
    ///
    /// # Errors
    /// The image cannot be searched.
    fn detect(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError>;

    /// Like [`Self::detect`], and may add to the best refused detections the positions at which picture and
    /// demonstration differ, which takes longer.
    ///
    /// # Errors
    /// As [`Self::detect`].
    fn detect_explained(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        self.detect(image)
    }
}

/// Settings of a teaching run, as given on the page.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TeachRequest {
    /// The grasp model to teach.
    pub model: ModelKind,
    /// Maximum seconds of training.
    #[serde(default)]
    pub time_budget_secs: Option<f64>,
    /// Number of optimiser steps, in place of the preset's.
    #[serde(default)]
    pub steps: Option<usize>,
    /// Number of equivalent turns in a full rotation; 0 for a part whose rotation is not visible.
    #[serde(default = "one")]
    pub symmetry: u32,
    /// The camera's distance to the part is always that of the photo, so parts of another size are refused.
    #[serde(default)]
    pub fixed_height: bool,
    /// Seed of all random choices.
    #[serde(default = "one_seed")]
    pub seed: u64,
    /// The region that the model searches. It is set by the session, not by the page.
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
    /// The time budget, if it is valid.
    pub fn time_budget(&self) -> Option<Duration> {
        self.time_budget_secs.and_then(|secs| Duration::try_from_secs_f64(secs).ok())
    }

    /// Checks that the numbers are in range.
    ///
    /// # Errors
    /// The time limit, the number of steps or the number of turns is out of range.
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

/// A progress report of a teaching run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TeachingStep {
    /// An optimiser step was done.
    Step {
        /// The network being trained: `the network`, `the angles`.
        of: &'static str,
        /// Whether it is the last network of this teaching run.
        is_last: bool,
        /// Number of finished steps.
        done: usize,
        /// Number of planned steps, as far as known.
        planned: usize,
        /// The loss before the step.
        loss: f64,
    },
    /// The model was tested on held-out samples.
    Validated {
        /// Steps done before the test.
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
    /// Wall-clock time of teaching and of the test on held-out samples.
    pub seconds: f64,
    /// Results of the finished model on held-out samples; `None` if it was not tested.
    pub figures: Option<Figures>,
    /// Results on the pictures without the part.
    pub negatives: Option<NegativesRefused>,
}

/// Results of a finished model on held-out samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Number of detected parts, and of all parts.
    pub found: [usize; 2],
    /// 95 % confidence interval of their share.
    pub found_interval: [f64; 2],
    /// Detections beside the part.
    pub wrong: usize,
    /// Number of samples without the part in which something was accepted, and of all such samples.
    pub false_alarms: [usize; 2],
    /// 95 % confidence interval of their share.
    pub false_alarms_interval: [f64; 2],
    /// Median error of the position, and its unit: px of the photo, or mm.
    pub error: Option<(f64, String)>,
    /// Median error of the turn.
    pub error_degrees: Option<f64>,
    /// Number of unmarked parts detected in the photos; they were removed from the samples.
    #[serde(default)]
    pub others_in_photo: usize,
    /// Numbers of the photos whose grasp points in another direction than that of photo 1.
    #[serde(default)]
    pub turned_photos: Vec<usize>,
}

/// Number of the user's pictures without the part that are refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NegativesRefused {
    /// Pictures in which nothing is accepted.
    pub refused: usize,
    /// Number of all pictures without the part.
    pub pictures: usize,
}

/// Why a grasp is refused, for display.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Refusal {
    /// The strongest reasons.
    pub reason: String,
    /// Advice.
    pub remedy: Option<String>,
    /// Positions at which edges differ from the photo's, in pixels of the picture.
    pub edges: Vec<[f64; 2]>,
    /// Positions at which the surface differs.
    pub surface: Vec<[f64; 2]>,
}

/// A detected grasp, in pixels of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundGrasp {
    /// Calibrated, in `[0, 1]`: at least 0.5 is accepted.
    pub score: f64,
    /// Whether it is accepted.
    pub is_accepted: bool,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// The demonstration's outline, placed in the image.
    pub outline: Option<Polygon>,
    /// Grasp point, direction and width, in pixels.
    pub grasp: PlanarGrasp,
    /// Length of the marked line, transformed to this image.
    pub line_length: f64,
    /// The grasp's pose over the table, if the camera is calibrated.
    pub pose: Option<GraspPose>,
    /// Why it is refused; `None` if it is accepted.
    pub refusal: Option<Refusal>,
    /// Indices, in the picture's list, of detections whose parts the jaws touch, accepted or not.
    pub touches: Vec<usize>,
}

/// A grasp in millimetres and degrees, for display.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GraspPose {
    /// Frame of the position: `table`, `base`.
    pub frame: &'static str,
    /// The middle between the jaws.
    pub position_mm: [f64; 3],
    /// Rotation about the frame's z.
    pub yaw_deg: f64,
    /// Opening of the jaws, mm.
    pub opening_mm: f64,
    /// Radius in mm that contains the position's error in 68 % of cases.
    pub sigma_mm: f64,
    /// Bound in degrees of the rotation's error in 68 % of cases.
    pub sigma_deg: f64,
}
