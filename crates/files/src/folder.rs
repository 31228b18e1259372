//! Folders and the names in them.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use crate::error::{FileError, Result};

/// Whether a file's name has one of these extensions, ignoring case.
pub fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension()
        .and_then(|extension| extension.to_str())
        .is_some_and(|extension| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known)))
}

/// The entries of a folder, sorted by name, without hidden ones.
///
/// # Errors
/// The folder cannot be read.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = || FileError::at(folder, "read this folder");
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed())? {
        let entry = entry.map_err(failed())?;
        if !entry.file_name().as_encoded_bytes().starts_with(b".") {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}

/// The folder that contains a file.
pub(crate) fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Checks that files can be written to an existing folder.
pub(crate) fn check_folder_writable(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".sdg-probe-{}.tmp", std::process::id()));
    File::create_new(&probe).map_err(FileError::at(folder, "write into this folder"))?;
    fs::remove_file(&probe).map_err(FileError::at(&probe, "remove a temporary file"))
}

/// Creates a folder (and its parents) if missing, and checks that files can be written to it.
///
/// # Errors
/// The folder cannot be created or written.
pub fn prepare_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(FileError::at(folder, "make this folder"))?;
    check_folder_writable(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_without_hidden_ones() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("made/here");
        prepare_folder(&inner).unwrap();
        for name in ["b.PNG", ".hidden", "a.png"] {
            fs::write(inner.join(name), "").unwrap();
        }
        let found = entries(&inner).unwrap();
        assert_eq!(found, ["a.png", "b.PNG"].map(|name| inner.join(name)));
        assert!(found.iter().all(|path| has_extension(path, &["png"])));
    }
}
