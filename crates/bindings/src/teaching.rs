//! Teaching from a photo and marks.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use sdg_evaluation::TaughtFile;
use sdg_grasp::{AcceptedNegative, SearchRegion, TeachOptions, TeachingEvent};
use sdg_inputs::TeachingFiles;

use crate::fault::{Fault, FaultKind, Result};
use crate::model::Model;
use crate::threads::check_thread_per_core;

/// The calibrated camera that took the photo.
#[derive(Debug, Clone)]
pub struct CameraTeaching {
    /// The camera file.
    pub file: PathBuf,
    /// Height of the marks above the table, in metres.
    pub mark_height_m: f64,
    /// Height at which the gripper closes, in metres.
    pub grasp_height_m: f64,
}

/// The inputs of a teaching run.
#[derive(Debug, Clone)]
pub struct Teaching {
    /// Photo and marks of each demonstration.
    pub demonstrations: Vec<(PathBuf, PathBuf)>,
    /// Pictures without the part.
    pub negatives: Vec<PathBuf>,
    /// The camera, for grasps in metres.
    pub camera: Option<CameraTeaching>,
}

/// Teaches like `sdg teach`; `observe` may end teaching early. The returned model is read back from its file's bytes,
/// so its weights are rounded. Pictures without the part in which the model still accepts something are returned with
/// it.
///
/// # Errors
/// Files cannot be read, photos or marks are unsuitable for teaching, the region is empty, the process was forked from
/// one with threads of this library, or teaching was ended before there was a model.
pub fn teach(
    from: &Teaching,
    mut options: TeachOptions,
    observe: &mut dyn FnMut(&TeachingEvent) -> ControlFlow<()>,
) -> Result<(Model, Vec<AcceptedNegative>)> {
    let heights = |camera: &CameraTeaching| [camera.mark_height_m, camera.grasp_height_m];
    let files = TeachingFiles {
        demonstrations: &from.demonstrations,
        negatives: &from.negatives,
        camera: from.camera.as_ref().map(|camera| (Path::new(&camera.file), heights(camera))),
    };
    if let Some(SearchRegion { width: 0, .. } | SearchRegion { height: 0, .. }) = options.region {
        return Err(Fault::new(FaultKind::Region, "expected a region of at least 1 × 1 pixels"));
    }
    check_thread_per_core()?;
    let demonstrations = files.read(&mut options).map_err(Fault::of_kind_or(FaultKind::Teaching))?;
    let TaughtFile { taught, model, .. } = TaughtFile::teach(&demonstrations, &options, observe)?;
    Ok((model.into(), taught.accepted_negatives))
}
