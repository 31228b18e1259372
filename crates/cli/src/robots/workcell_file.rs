//! `--workcell FILE`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_robot::workcell::Workcell;

use crate::files;

/// Larger workcell files than any person writes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a workcell's file; the camera's file is found beside it.
///
/// # Errors
/// A file that cannot be read, with the line.
pub(crate) fn read_workcell(path: &Path) -> Result<(Workcell, Option<PathBuf>)> {
    let Ok(text) = String::from_utf8(files::read(path, MAX_BYTES)?) else {
        bail!("{}: expected TOML, found bytes that are no text", path.display());
    };
    let workcell = Workcell::from_toml(&text).with_context(|| path.display().to_string())?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let camera_file = workcell.camera_file.as_ref().map(|file| folder.join(file));
    Ok((workcell, camera_file))
}

/// Refuses a cell with obstacles, for commands whose motions are not planned around them.
///
/// # Errors
/// The first obstacle.
pub(crate) fn refuse_obstacles(workcell: &Workcell, path: &Path) -> Result<()> {
    match workcell.obstacles.first() {
        None => Ok(()),
        Some(obstacle) => bail!(
            "{}: expected no obstacle, found \"{}\": the motions of this command are not planned around it, so the arm might run into it; \
             take it out of the cell and of this file (sdg plan plans around obstacles)",
            path.display(),
            obstacle.name
        ),
    }
}
