//! Folders for series of numbered pictures, which replace no pictures of an earlier series.

use std::path::Path;

use anyhow::{Context, Result};

use crate::exit::Usage;

/// Creates the folder given with `option` if it is missing.
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
