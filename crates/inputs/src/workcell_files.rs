//! Workcell files.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_robot::workcell::Workcell;

/// Maximum size of a workcell file.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a workcell file. Returns the workcell and the path of its camera file. The workcell file states this path
/// relative to its own folder.
///
/// # Errors
/// The file is invalid (with the line), or cannot be read.
pub fn read_workcell(path: &Path) -> Result<(Workcell, Option<PathBuf>)> {
    let Ok(text) = String::from_utf8(sdg_files::read(path, MAX_BYTES)?) else {
        bail!("{}: expected TOML, found bytes that are not text", path.display());
    };
    let workcell = Workcell::from_toml(&text).with_context(|| path.display().to_string())?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let camera_file = workcell.camera_file.as_ref().map(|file| folder.join(file));
    Ok((workcell, camera_file))
}
