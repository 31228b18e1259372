//! The input files of this process, which its outputs must not replace.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::atomic::{AtomicFile, write_atomically};
use crate::error::{FileError, Result};
use crate::kind::check_replaces_its_kind;

/// Files opened for reading by this process: [`write`] does not replace them.
static INPUTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Opens a file and returns it with its length.
pub(crate) fn open(path: &Path) -> Result<(File, u64)> {
    let file = File::open(path).map_err(FileError::at(path, "read"))?;
    let metadata = file.metadata().map_err(FileError::at(path, "read"))?;
    if metadata.is_dir() {
        return Err(FileError::Folder { path: path.to_owned(), expected: "file" });
    }
    if let Ok(path) = path.canonicalize() {
        INPUTS.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
    }
    Ok((file, metadata.len()))
}

/// Checks that a file can be opened, and registers it as an input.
///
/// # Errors
/// The file cannot be opened (its name and the system's error), or is a folder.
pub fn check_readable(path: &Path) -> Result<()> {
    open(path).map(drop)
}

/// Whether two paths lead to the same existing file, through any links.
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

/// Checks that the path is not an input of this process other than `own`.
///
/// # Errors
/// The path leads to an input.
fn check_is_no_input(path: &Path, own: Option<&Path>) -> Result<()> {
    let is_input = |path: PathBuf| INPUTS.lock().unwrap_or_else(PoisonError::into_inner).contains(&path);
    if !own.is_some_and(|own| is_same_file(path, own)) && path.canonicalize().is_ok_and(is_input) {
        return Err(FileError::Input { path: path.to_owned() });
    }
    Ok(())
}

/// Registers a file, or a folder and its files, read by code outside this crate: [`write`] does not replace them.
pub fn keep(path: &Path) {
    let entries = fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let kept = entries.chain([path.to_owned()]).filter_map(|path| path.canonicalize().ok());
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner).extend(kept);
}

/// Writes a file atomically, never over an input of this process or over a file of another kind.
///
/// # Errors
/// The path leads to such a file, or the system does not allow it.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    extend(path, None, bytes)
}

/// Like [`write`], but it may replace `own`, a file that this process has read in order to keep its contents.
///
/// # Errors
/// The errors of [`write`].
pub fn extend(path: &Path, own: Option<&Path>, bytes: &[u8]) -> Result<()> {
    check_is_no_input(path, own)?;
    check_replaces_its_kind(path, bytes)?;
    write_atomically(path, bytes)
}

/// Starts a file whose contents begin with `start`; like [`write`], it replaces no input and no file of another kind.
///
/// # Errors
/// The path leads to such a file, or the errors of [`AtomicFile::create`].
pub fn create(path: &Path, start: &[u8]) -> Result<AtomicFile> {
    check_is_no_input(path, None)?;
    let file = AtomicFile::create(path)?;
    check_replaces_its_kind(path, start)?;
    Ok(file)
}

/// Checks, before minutes of work, that a file can be written at `path` later, and that it is not an input.
///
/// # Errors
/// `path` is a folder, a device, a pipe or an input, or its folder (that of the file to which a link leads) cannot be
/// written.
pub fn check_writable(path: &Path) -> Result<()> {
    check_extendable(path, None)
}

/// Like [`check_writable`], but `path` may be the file `own`, as in [`extend`].
///
/// # Errors
/// The errors of [`check_writable`].
pub fn check_extendable(path: &Path, own: Option<&Path>) -> Result<()> {
    check_is_no_input(path, own)?;
    if path.is_dir() {
        return Err(FileError::Folder { path: path.to_owned(), expected: "file to write" });
    }
    AtomicFile::create(path).map(drop)
}

/// Like [`check_extendable`], for contents that begin with `start`: an existing file must be of the same kind.
///
/// # Errors
/// The errors of [`check_writable`]; a file of another kind.
pub fn check_replaceable(path: &Path, own: Option<&Path>, start: &[u8]) -> Result<()> {
    check_extendable(path, own)?;
    check_replaces_its_kind(path, start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounded::read;
    use image::RgbImage;

    #[test]
    fn a_folder_that_is_not_there_cannot_be_written() {
        let error = check_writable(Path::new("/nowhere/at/all.sdg")).unwrap_err().to_string();
        assert!(error.starts_with("cannot write /nowhere/at/all.sdg: creating a temporary file"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn paths_that_a_later_write_refuses_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let [link, pipe] = ["link.sdg", "pipe.sdg"].map(|name| folder.path().join(name));
        // Not even root may create files in this folder.
        std::os::unix::fs::symlink("/proc/version", &link).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [link.as_path(), &pipe, Path::new("/dev/null"), folder.path()] {
            check_writable(path).unwrap_err();
            write(path, b"model").unwrap_err();
        }
        let free = folder.path().join("free.sdg");
        check_writable(&free).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left");
    }

    #[test]
    fn an_input_is_not_replaced_whatever_path_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let [photo, other] = ["photo.png", "other.png"].map(|name| folder.path().join(name));
        fs::write(&photo, "photo").unwrap();
        read(&photo, 10).unwrap();
        let by_detour = folder.path().join(".").join("photo.png");
        for path in [&photo, &by_detour] {
            let error = write(path, b"drawing").unwrap_err().to_string();
            assert!(error.contains("found an input of this command"), "{error}");
            assert!(check_writable(path).is_err());
        }
        assert_eq!(fs::read(&photo).unwrap(), b"photo");
        assert!(extend(&photo, Some(&other), b"more").is_err());
        extend(&photo, Some(&by_detour), b"photo").unwrap();
        write(&other, b"drawing").unwrap();
        assert_eq!(fs::read(&other).unwrap(), b"drawing");
    }

    #[test]
    fn a_file_is_replaced_by_its_own_kind_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [photo, marks, camera] = ["photo.png", "photo.json", "camera.yaml"].map(|name| folder.path().join(name));
        RgbImage::new(4, 3).save(&photo).unwrap();
        fs::write(&marks, "{\"shapes\": []}").unwrap();
        fs::write(&camera, "image_width: 4\n").unwrap();
        for (path, found) in [(&photo, "found a picture (Png)"), (&marks, "found JSON"), (&camera, "found text")] {
            let before = fs::read(path).unwrap();
            assert!(
                check_replaceable(path, None, b"<svg/>").is_err() && check_replaceable(path, None, &before).is_ok()
            );
            let error = write(path, b"<svg/>").unwrap_err().to_string();
            assert!(error.contains("or XML or HTML to replace") && error.contains(found), "{error}");
            assert_eq!(fs::read(path).unwrap(), before);
            write(path, &before).unwrap();
        }
        fs::write(&camera, "").unwrap();
        write(&camera, b"<svg/>").unwrap();
    }

    #[test]
    fn a_model_whose_header_length_begins_like_a_picture_is_replaced_by_a_model() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.sdg");
        let model = |header_len: u64| [header_len.to_le_bytes().as_slice(), b"{}"].concat();
        // "P1" and "P2" as in PBM and PGM, and the beginning of an icon.
        for header_len in [0x3150, 0x3250, 0x1_0000] {
            fs::write(&path, model(header_len)).unwrap();
            write(&path, &model(640)).unwrap();
            write(&path, &model(header_len)).unwrap();
        }
    }
}
