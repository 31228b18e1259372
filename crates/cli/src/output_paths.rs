//! Checks of the paths that results are written to.

use std::path::Path;

use anyhow::{Context, Result};

use crate::exit::Usage;

/// Checks the ending of the file given with `option`, which is written in one format only.
///
/// # Errors
/// [`Usage`] for another ending.
pub fn check_ending(option: &str, file: &Path, extension: &str) -> Result<(), Usage> {
    if sdg_files::has_extension(file, &[extension]) {
        return Ok(());
    }
    Err(Usage(format!("{option}: expected a file that ends in .{extension}, found {}", file.display())))
}

/// Creates the folder given with `option` for numbered pictures, which must not replace those of an earlier run.
///
/// # Errors
/// [`Usage`] if it is not empty; or it cannot be created.
pub fn prepare_new_folder(option: &str, folder: &Path) -> Result<()> {
    sdg_files::prepare_folder(folder)?;
    let found = folder.display();
    if std::fs::read_dir(folder).with_context(|| found.to_string())?.next().is_some() {
        return Err(Usage(format!("{option}: expected a new or an empty folder, found files in {found}")).into());
    }
    Ok(())
}
