//! One page at a time writes a file of marks.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// Held while the page is served. The system gives the lock back when the process ends, however it ends; its file may then stay, and the
/// next holder takes it over.
pub(super) struct Lock {
    path: PathBuf,
    /// Locked as long as it is open.
    _file: File,
}

impl Lock {
    /// Locks the file that the page will write, by a hidden file beside it that says who holds it; `None` where nothing can be written.
    ///
    /// # Errors
    /// Another process holds it.
    pub(super) fn of(written: &Path) -> Result<Option<Self>> {
        let name = written.file_name().unwrap_or_default().to_string_lossy();
        let path = written.with_file_name(format!(".{name}.lock"));
        loop {
            let file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(&path);
            let Ok(mut file) = file else { return Ok(None) };
            match file.try_lock() {
                // A file system without locks does not keep anyone from working alone.
                Ok(()) | Err(TryLockError::Error(_)) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    // It may hold it since a moment ago alone, without its name.
                    let _ = file.read_to_string(&mut holder);
                    bail!(
                        "{}: another `sdg annotate` ({}) writes these marks; go on in its page, or end it first",
                        written.display(),
                        if holder.is_empty() { "process unknown" } else { holder.trim() }
                    )
                }
            }
            // The holder before may have removed the file after it was opened here.
            if is_at(&file, &path) {
                let named = file
                    .set_len(0)
                    .and_then(|()| file.rewind())
                    .and_then(|()| writeln!(file, "process {}", std::process::id()));
                named.with_context(|| format!("{}: cannot write", path.display()))?;
                return Ok(Some(Self { path, _file: file }));
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // What stays is taken over.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(file), Ok(path)) if id(file.clone()) == id(path.clone()))
}

/// Elsewhere an open file is not removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_at_a_time_and_one_that_died_is_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let marks = folder.path().join("part.json");
        let file = folder.path().join(".part.json.lock");
        let held = Lock::of(&marks).unwrap();
        let error = Lock::of(&marks).err().unwrap().to_string();
        assert!(error.contains(&format!("process {}", std::process::id())) && error.contains("part.json"), "{error}");
        assert!(Lock::of(&folder.path().join("other.json")).unwrap().is_some());
        assert!(Lock::of(&folder.path().join("no/folder.json")).unwrap().is_none());
        drop(held);
        assert!(!file.exists());
        // Of a process that ended without removing it.
        fs::write(&file, "process 1\n").unwrap();
        let taken = Lock::of(&marks).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), format!("process {}\n", std::process::id()));
        drop(taken);
    }
}
