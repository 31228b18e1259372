//! Files that are written atomically.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{FileError, Result};
use crate::folder::folder_of;

/// Writes `bytes` to `path` so that a reader sees either the old or the new contents, never a part.
///
/// # Errors
/// The errors of [`AtomicFile`]. In each case the file at `path` is unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.as_file().write_all(bytes).map_err(failed(path, "writing"))?;
    file.commit()
}

/// A file that gets its name when it is complete; if it is dropped before that, nothing remains.
///
/// The bytes are written to a hidden temporary file in the same folder, flushed to the disk, and the file is renamed in
/// one step. A symbolic link at the path is followed, so the link is kept. The folder must exist.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    target: PathBuf,
    file: NamedTempFile,
}

impl AtomicFile {
    /// Starts a file at this path.
    ///
    /// # Errors
    /// [`FileError::NotAFile`] when `path` cannot name a file, [`FileError::Write`] when the folder is missing or read-only.
    pub fn create(path: &Path) -> Result<Self> {
        // The permissions that other programs request; the umask removes the rest.
        Self::with_mode(path, 0o666)
    }

    /// As [`Self::create`], for a file that on Unix only its owner may read.
    ///
    /// # Errors
    /// As for [`Self::create`].
    pub fn create_private(path: &Path) -> Result<Self> {
        Self::with_mode(path, 0o600)
    }

    fn with_mode(path: &Path, mode: u32) -> Result<Self> {
        let not_a_file = |found| FileError::NotAFile { path: path.to_owned(), found };
        if path.file_name().is_none() {
            return Err(not_a_file("no file name"));
        }
        if path.is_dir() {
            return Err(not_a_file("a folder"));
        }
        // A dangling link cannot be resolved; it is replaced.
        let is_link = path.is_symlink();
        let target = if is_link { fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()) } else { path.to_owned() };
        if target.exists() && !target.is_file() {
            return Err(not_a_file("a device or a pipe"));
        }
        let file = temporary_beside(&target, mode).map_err(failed(path, "creating a temporary file in its folder"))?;
        Ok(Self { path: path.to_owned(), target, file })
    }

    /// The temporary file, to write and seek in.
    pub fn as_file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`FileError::Write`] when the disk is full or the rename is refused.
    pub fn commit(self) -> Result<()> {
        let Self { path, target, file } = self;
        file.as_file().sync_all().map_err(failed(&path, "flushing to the disk"))?;
        file.persist(&target).map_err(|refused| failed(&path, "renaming the temporary file")(refused.error))?;
        sync_folder_of(&target);
        Ok(())
    }
}

fn failed(path: &Path, step: &'static str) -> impl FnOnce(io::Error) -> FileError {
    let path = path.to_owned();
    move |source| FileError::Write { path, step, source }
}

/// A file in the folder of `target`, with the permissions `mode` on Unix; deleted when it goes out of scope.
#[cfg_attr(not(unix), allow(unused_variables, reason = "other systems have no such permissions"))]
fn temporary_beside(target: &Path, mode: u32) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sdg-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    builder.tempfile_in(folder_of(target))
}

/// Makes the rename survive a power failure. The file is complete in any case, so a file system that cannot sync a
/// folder is not an error.
fn sync_folder_of(target: &Path) {
    if let Ok(folder) = File::open(folder_of(target)) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn writes_and_overwrites_and_leaves_only_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, b"first and long").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names_in(folder.path()), ["a.txt"]);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_it_as_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_atomically(&ours, b"x").unwrap();
        fs::write(&plain, b"x").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn a_missing_folder_is_named_and_not_created() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("a.txt");
        let message = write_atomically(&path, b"x").unwrap_err().to_string();
        assert!(message.contains("missing") && message.contains("creating"), "{message}");
        assert!(names_in(folder.path()).is_empty());
    }

    #[test]
    fn a_folder_in_the_way_stays_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir(&path).unwrap();
        let error = write_atomically(&path, b"x").unwrap_err();
        assert!(matches!(error, FileError::NotAFile { found: "a folder", .. }), "{error}");
        assert_eq!(names_in(folder.path()), ["taken"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused_and_a_link_is_followed() {
        let error = write_atomically(Path::new("/dev/null"), b"x").unwrap_err();
        assert!(matches!(error, FileError::NotAFile { .. }), "{error}");

        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }

    /// Runs only as the child process of [`a_write_cut_short_leaves_the_old_file_and_nothing_else`], with a limited
    /// file size: the kernel cuts the write as on a full disk.
    #[cfg(unix)]
    #[test]
    #[ignore = "needs a limited file size; another test runs it in a child process"]
    fn child_that_may_not_write_much() {
        let path = std::env::var_os("SDG_LIMITED_FILE").unwrap();
        let error = write_atomically(Path::new(&path), &vec![7; 1 << 20]).unwrap_err();
        assert!(matches!(error, FileError::Write { step: "writing", .. }), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_write_cut_short_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model");
        fs::write(&path, b"old").unwrap();
        let output = std::process::Command::new("sh")
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
            .arg(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "atomic::tests::child_that_may_not_write_much"])
            .env("SDG_LIMITED_FILE", &path)
            .output()
            .unwrap();
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && printed.contains("1 passed"), "{printed}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names_in(folder.path()), ["model"]);
    }

    /// Runs only as the child of [`a_file_is_flushed_before_it_takes_its_name_and_its_folder_after`].
    #[cfg(target_os = "linux")]
    #[test]
    #[ignore = "another test runs it under strace"]
    fn child_that_writes() {
        write_atomically(Path::new(&std::env::var_os("SDG_TRACED_FILE").unwrap()), b"new").unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    #[ignore = "needs strace, which `make hardening` installs"]
    fn a_file_is_flushed_before_it_takes_its_name_and_its_folder_after() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model");
        let output = std::process::Command::new("strace")
            .args(["-f", "-y", "-e", "trace=fsync,fdatasync,/rename"])
            .arg(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "atomic::tests::child_that_writes"])
            .env("SDG_TRACED_FILE", &path)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        // The calls as strace prints them: `fsync(3</tmp/…/.sdg-x.tmp>)`, `rename("/tmp/…", "/tmp/…/model")`.
        let printed = String::from_utf8_lossy(&output.stderr);
        let calls: Vec<&str> = printed.lines().filter(|line| line.contains(" = 0")).collect();
        let folder = folder.path().display().to_string();
        let at = |wanted: &dyn Fn(&str) -> bool| calls.iter().position(|call| wanted(call));
        let file = at(&|call| call.contains("sync(") && call.contains(".tmp>"));
        let name = at(&|call| call.contains("rename") && call.contains("/model\""));
        let after = at(&|call| call.contains("sync(") && call.contains(&format!("<{folder}>")));
        assert!(file.is_some() && file < name && name < after, "{printed}");
    }
}
