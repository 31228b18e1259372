//! A grasp model, and its detections in a picture.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use image::RgbImage;
use sdg_cell::{DEFAULT_MIN_SCORE, Found, FoundRecord, Perception};
use sdg_grasp::{Device, GraspModel, SearchRegion, Verification};
use sdg_inputs::check_replaces_a_model;
use serde::Serialize;

use crate::camera::Camera;
use crate::fault::{Fault, FaultKind, Result};
use crate::threads::{check_reader, on_threads};

/// The searched region of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RegionChoice {
    /// The region that the model was taught with; the whole picture if it has none.
    #[default]
    OfModel,
    /// The whole picture.
    All,
    /// Left edge, upper edge, width and height, in pixels.
    Part([u32; 4]),
}

/// Options for the search of a picture.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// The calibrated camera that took the picture.
    pub camera: Option<Camera>,
    /// The searched region.
    pub region: RegionChoice,
    /// Number of threads; `None` for one per core.
    pub threads: Option<usize>,
}

/// A grasp model and its last perception; can be used by several threads.
#[derive(Debug)]
pub struct Model {
    model: GraspModel,
    /// Cached, because plan views take milliseconds to set up.
    last: Mutex<Option<LastPerception>>,
}

/// A perception and the inputs it was made for.
#[derive(Debug)]
struct LastPerception {
    camera: Option<Camera>,
    region: RegionChoice,
    perception: Arc<Perception>,
}

impl LastPerception {
    fn is_for(&self, camera: Option<&Camera>, region: RegionChoice) -> bool {
        let is_same_camera = match (&self.camera, camera) {
            (Some(one), Some(other)) => one.is_same(other),
            (one, other) => one.is_none() && other.is_none(),
        };
        is_same_camera && self.region == region
    }
}

/// The detections in a picture, best score first, including refused ones.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub struct Detections {
    records: Vec<Record>,
}

/// A record of `sdg detect --json`, without the advice, whose text is for the command line.
#[derive(Debug, Clone, Serialize)]
pub struct Record {
    /// The detection, in pixels, and with a camera also in metres.
    #[serde(flatten)]
    pub found: FoundRecord,
    /// The part's size relative to its nominal size; absent with a camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Indices, in the list of all detections, of accepted parts that the jaws of this detection would touch; empty if
    /// this detection is refused.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jaws_touch: Vec<usize>,
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// The file cannot be read, is not a grasp model, is damaged, or has another version; the process was forked from
    /// one with threads of this library.
    pub fn read(path: &Path) -> Result<Self> {
        // Reading computes the search's data on several threads.
        check_reader()?;
        sdg_inputs::read_model(path, &Device::flex()).map(Self::from).map_err(|error| {
            let fault = Fault::from(error);
            // A damaged photo in the file counts as a damaged model.
            if fault.kind == FaultKind::File { fault } else { Fault { kind: FaultKind::ModelFile, ..fault } }
        })
    }

    /// Writes the model file atomically. An existing file is replaced only if it is a grasp model.
    ///
    /// # Errors
    /// The path is a file of another kind, or cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        check_replaces_a_model(path).map_err(Fault::of_kind(FaultKind::File))?;
        // A program that keeps running may replace a model that it has read.
        Ok(sdg_files::extend(path, Some(path), &self.model.to_bytes()?)?)
    }

    /// The grasp model.
    pub fn grasp_model(&self) -> &GraspModel {
        &self.model
    }

    /// Detects the part in a picture. Detections with a score of at least `min_score` are accepted.
    ///
    /// # Errors
    /// The errors of [`Self::perception`]; the picture's size differs from the camera's, or the region is not inside
    /// the picture; the number of threads is invalid, or the system refuses them; the process was forked from one with
    /// threads of this library.
    pub fn detect(&self, picture: &RgbImage, view: &View, min_score: f64) -> Result<Detections> {
        on_threads(view.threads, || {
            let perception = self.perception(view.camera.as_ref(), view.region)?;
            let found = perception.detect(picture, Verification::ByShape)?;
            let size = picture.dimensions().into();
            let detections: Vec<_> = found.iter().map(|found| &found.detection).collect();
            let touched = perception.touched_among_accepted(&detections, |idx| detections[idx].score >= min_score);
            let record = |(found, jaws_touch): (&Found, Vec<usize>)| Record {
                found: FoundRecord::new(found, &perception),
                size: perception.size_of(&found.detection, size),
                jaws_touch,
            };
            Ok(Detections { records: found.iter().zip(touched).map(record).collect() })
        })?
    }

    /// The model's perception with a camera, or for pictures of any camera.
    ///
    /// # Errors
    /// The region is empty, lies outside the camera's pictures, or is too small for the part. With a camera: the
    /// camera's pictures do not show the plane of the marks, or the model was taught without a camera.
    pub fn perception(&self, camera: Option<&Camera>, region: RegionChoice) -> Result<Arc<Perception>> {
        let last = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(last) = last().as_ref().filter(|last| last.is_for(camera, region)) {
            return Ok(Arc::clone(&last.perception));
        }
        let mut model = GraspModel::clone(&self.model);
        if region != RegionChoice::OfModel {
            // The model's region, which is replaced, may not fit this camera's pictures.
            model = model.with_region(None)?;
        }
        let mut perception = match camera {
            Some(camera) => Perception::calibrated(model, camera.calibrated())?,
            None => Perception::of_any_camera(model),
        };
        match region {
            RegionChoice::OfModel => {}
            RegionChoice::All => perception.look_in(None)?,
            RegionChoice::Part(bounds) => perception.look_in(Some(SearchRegion::new(bounds)))?,
        }
        let perception = Arc::new(perception);
        *last() = Some(LastPerception { camera: camera.cloned(), region, perception: Arc::clone(&perception) });
        Ok(perception)
    }
}

impl From<GraspModel> for Model {
    fn from(model: GraspModel) -> Self {
        Self { model, last: Mutex::new(None) }
    }
}

impl Detections {
    /// All detections as JSON with all digits.
    pub fn to_json(&self) -> String {
        // The records contain only numbers and names, so serialisation cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The detection with this index; 0 is the best.
    pub fn get(&self, idx: usize) -> Option<&Record> {
        self.records.get(idx)
    }

    /// The best accepted detection.
    ///
    /// # Errors
    /// There is no detection, or none is accepted.
    pub fn best(&self) -> Result<&Record> {
        let nothing = |text: String| Err(Fault::new(FaultKind::NothingToGrasp, text));
        let Some(first) = self.get(0) else {
            return nothing("expected a part to grasp, found nothing that resembles it".to_owned());
        };
        let detection = &first.found.detection;
        if detection.score >= DEFAULT_MIN_SCORE {
            return Ok(first);
        }
        let why = detection.refused.map(|why| format!(": {why}")).unwrap_or_default();
        nothing(format!("expected a part to grasp, found none: the best place scores {:.2}{why}", detection.score))
    }

    /// Number of detections.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there are no detections.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }
}
