//! Creates and lists folders.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;

/// Creates an empty folder in place of an existing one.
///
/// # Errors
/// The errors of the file system.
pub fn fresh(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    fs::create_dir_all(folder)?;
    Ok(())
}

/// All files under a folder, with paths relative to it.
///
/// # Errors
/// The errors of the file system.
pub fn files_under(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(folder.join(&next))? {
            let entry = entry?;
            let path = next.join(entry.file_name());
            if entry.file_type()?.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    Ok(files)
}

/// All files under a folder, with paths relative to it, and their contents.
///
/// # Errors
/// The errors of the file system.
pub fn contents_under(folder: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    files_under(folder)?.into_iter().map(|file| Ok((file.clone(), fs::read(folder.join(file))?))).collect()
}
