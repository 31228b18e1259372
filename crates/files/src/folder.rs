//! Folders and the names in them.

use std::fs;
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

/// The absolute path of a folder without links and `..`, for comparisons; these remain in that of a missing folder.
/// That of an empty path is the current folder.
pub fn absolute_folder(folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let spelled = || std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    // A folder is the same with a slash at its end.
    folder.canonicalize().unwrap_or_else(|_| spelled().components().collect())
}

/// The absolute path of a file, for comparisons: its name in [`absolute_folder`]. A link to a file is another file.
pub fn absolute(file: &Path) -> PathBuf {
    match file.file_name() {
        Some(name) => absolute_folder(folder_of(file)).join(name),
        None => absolute_folder(file),
    }
}

/// Whether two paths name the same file, which need not exist. Different names are told apart without a system call.
pub fn is_same_path(one: &Path, other: &Path) -> bool {
    one.file_name() == other.file_name() && absolute(one) == absolute(other)
}

/// Creates a folder (and its parents) if missing, and checks that files can be written to it.
///
/// # Errors
/// The folder cannot be created or written.
pub fn prepare_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(FileError::at(folder, "make this folder"))?;
    // Its name is random: processes in two containers may have one id.
    let probe = tempfile::Builder::new().prefix(".sdg-").suffix(".tmp").tempfile_in(folder);
    probe.map(drop).map_err(FileError::at(folder, "write into this folder"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_without_hidden_ones() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("made/here");
        prepare_folder(&inner).unwrap();
        assert!(fs::read_dir(&inner).unwrap().next().is_none());
        for name in ["b.PNG", ".hidden", "a.png"] {
            fs::write(inner.join(name), "").unwrap();
        }
        let found = entries(&inner).unwrap();
        assert_eq!(found, ["a.png", "b.PNG"].map(|name| inner.join(name)));
        assert!(found.iter().all(|path| has_extension(path, &["png"])));
    }

    #[test]
    fn a_file_left_by_a_process_of_the_same_number_does_not_disturb() {
        let folder = tempfile::tempdir().unwrap();
        let left = folder.path().join(format!(".sdg-probe-{}.tmp", std::process::id()));
        fs::write(&left, "").unwrap();
        prepare_folder(folder.path()).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
