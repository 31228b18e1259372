//! Grasp models on disk.

use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result};
use sdg_files::{read, read_bounded};
use sdg_grasp::{Device, GraspModel, summarize};

/// Maximum size of a model file.
const MAX_MODEL_BYTES: u64 = 2 << 30;

/// Reads a grasp model and loads it onto a device.
pub fn read_model(path: &Path, device: &Device) -> Result<GraspModel> {
    let bytes = read(path, MAX_MODEL_BYTES)?;
    GraspModel::from_bytes(&bytes, device).with_context(|| path.display().to_string())
}

/// Checks that only an existing model is replaced by a model file.
///
/// # Errors
/// A file of another kind has that name.
pub fn check_replaces_a_model(path: &Path) -> Result<()> {
    let bytes = match File::open(path) {
        Ok(file) => read_bounded(file, path, MAX_MODEL_BYTES)?,
        Err(_) => return Ok(()),
    };
    if !bytes.is_empty() {
        summarize(&bytes)
            .with_context(|| format!("{}: expected a new name, or a grasp model to replace", path.display()))?;
    }
    Ok(())
}
