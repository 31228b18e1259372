//! Locks between processes. The system releases a lock when its process ends, however it ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::error::{FileError, Result};
use crate::folder::is_same_path;

/// Access of a lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Exclusive.
    Alone,
    /// Shared with other processes that request shared access.
    Shared,
}

/// The lock of a file, held until it is dropped. On a file system without locks, every process gets the lock, so a
/// single process can always work.
#[derive(Debug)]
pub struct Lock(#[allow(dead_code, reason = "the system keeps the lock as long as the file is open")] File);

impl Lock {
    /// Takes the lock of the file at `path`, which is created if missing; `None` if another process
    /// holds a lock that excludes this access.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn take(path: &Path, access: Access) -> Result<Option<Self>> {
        let file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path);
        let (file, is_taken) = try_lock(file.map_err(FileError::at(path, "write"))?, access);
        Ok(is_taken.then_some(Self(file)))
    }

    /// Whether no process holds the exclusive lock of a file; false if the file or the file system's locks are missing.
    pub fn is_free(path: &Path) -> bool {
        File::open(path).is_ok_and(|file| file.try_lock_shared().is_ok())
    }
}

/// Tries to lock a file; returns the file, and whether the lock was taken.
fn try_lock(file: File, access: Access) -> (File, bool) {
    let locked = match access {
        Access::Alone => file.try_lock(),
        Access::Shared => file.try_lock_shared(),
    };
    (file, !matches!(locked, Err(TryLockError::WouldBlock)))
}

/// Errors of a folder in which no lock file can be made; too many open files are none of them.
const NOT_WRITABLE: [ErrorKind; 6] = [
    ErrorKind::NotFound,
    ErrorKind::PermissionDenied,
    ErrorKind::ReadOnlyFilesystem,
    ErrorKind::InvalidFilename,
    ErrorKind::StorageFull,
    ErrorKind::QuotaExceeded,
];

/// An exclusive lock for writing a file. A hidden file beside it carries the lock and names the holder. The hidden file
/// is removed at the end; if it remains, the next holder takes it over.
#[derive(Debug)]
pub struct WriterLock {
    path: PathBuf,
    _lock: Lock,
}

impl WriterLock {
    /// Takes the lock for a file that will be written; `None` if the folder is not writable.
    ///
    /// # Errors
    /// [`FileError::Held`] if another process holds the lock, [`FileError::System`] if too many files are open.
    pub fn take(written: &Path) -> Result<Option<Self>> {
        let path = lock_file_of(written);
        loop {
            let file = match OpenOptions::new().create(true).truncate(false).read(true).write(true).open(&path) {
                Ok(file) => file,
                Err(error) if NOT_WRITABLE.contains(&error.kind()) => return Ok(None),
                Err(error) => return Err(FileError::at(&path, "write")(error)),
            };
            let (mut file, is_taken) = try_lock(file, Access::Alone);
            if !is_taken {
                let mut holder = String::new();
                // The other process may have taken the lock a moment ago, without having written its name.
                let _ = file.read_to_string(&mut holder);
                let holder = if holder.is_empty() { "an unknown process" } else { holder.trim() }.to_owned();
                return Err(FileError::Held { path: written.to_owned(), holder });
            }
            // The previous holder may have removed the file after it was opened here.
            if is_at(&file, &path) {
                // The lock also holds on a full disk, where it cannot name its holder.
                let _ = file
                    .set_len(0)
                    .and_then(|()| file.rewind())
                    .and_then(|()| writeln!(file, "process {}", std::process::id()));
                return Ok(Some(Self { path, _lock: Lock(file) }));
            }
        }
    }

    /// Whether this is the lock of a file, in any spelling of its path.
    pub fn is_of(&self, written: &Path) -> bool {
        is_same_path(&self.path, &lock_file_of(written))
    }
}

/// The hidden file beside a file that carries its lock.
fn lock_file_of(written: &Path) -> PathBuf {
    let name = written.file_name().unwrap_or_default().to_string_lossy();
    written.with_file_name(format!(".{name}.lock"))
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // If the file cannot be removed, the next holder takes it over.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(file), Ok(path)) if id(file.clone()) == id(path.clone()))
}

/// Other systems do not remove an open file.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_alone_or_shared() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert!(!Lock::is_free(&path));
        let shared = [1, 2].map(|_| Lock::take(&path, Access::Shared).unwrap().unwrap());
        assert!(Lock::take(&path, Access::Alone).unwrap().is_none());
        drop(shared);
        assert!(Lock::is_free(&path));
        let alone = Lock::take(&path, Access::Alone).unwrap();
        assert!(!Lock::is_free(&path) && Lock::take(&path, Access::Shared).unwrap().is_none());
        drop(alone);
        assert!(Lock::take(&path, Access::Alone).unwrap().is_some());
        let error = Lock::take(&folder.path().join("no/folder"), Access::Alone).unwrap_err().to_string();
        assert!(error.ends_with("no/folder: cannot write"), "{error}");
    }

    #[test]
    fn one_writer_at_a_time_and_one_that_died_is_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let marks = folder.path().join("part.json");
        let file = folder.path().join(".part.json.lock");
        let held = WriterLock::take(&marks).unwrap();
        let is_held = |name: &str| held.as_ref().unwrap().is_of(&folder.path().join(name));
        assert!(is_held("part.json") && !is_held("b.json"));
        fs::create_dir(folder.path().join("sub")).unwrap();
        assert!(is_held("sub/../part.json") && !is_held("sub/part.json"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(folder.path(), folder.path().join("link")).unwrap();
            assert!(is_held("link/part.json"));
        }
        let error = WriterLock::take(&marks).err().unwrap();
        let process = format!("process {}", std::process::id());
        assert!(matches!(&error, FileError::Held { path, holder } if *path == marks && *holder == process), "{error}");
        assert!(WriterLock::take(&folder.path().join("other.json")).unwrap().is_some());
        assert!(WriterLock::take(&folder.path().join("no/folder.json")).unwrap().is_none());
        drop(held);
        assert!(!file.exists());
        // The lock file of a process that ended without removing it.
        fs::write(&file, "process 1\n").unwrap();
        let taken = WriterLock::take(&marks).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), format!("{process}\n"));
        drop(taken);
    }

    /// A holder removes the lock file after another process has opened it, and a third process creates a new one: only
    /// one of the two files counts.
    #[cfg(unix)]
    #[test]
    fn a_lock_of_a_file_that_was_removed_counts_for_nothing() {
        use std::sync::atomic::{AtomicBool, Ordering};
        const TAKEN_BY_EACH: u32 = 150;
        let folder = tempfile::tempdir().unwrap();
        let marks = folder.path().join("part.json");
        let is_held = AtomicBool::new(false);
        let take_and_give_back = || {
            let mut num_taken = 0;
            while num_taken < TAKEN_BY_EACH {
                let Ok(Some(lock)) = WriterLock::take(&marks) else {
                    std::thread::yield_now();
                    continue;
                };
                assert!(!is_held.swap(true, Ordering::SeqCst), "expected one holder, found two");
                num_taken += 1;
                std::thread::yield_now();
                is_held.store(false, Ordering::SeqCst);
                drop(lock);
            }
        };
        std::thread::scope(|scope| {
            let threads = [(); 3].map(|()| scope.spawn(take_and_give_back));
            threads.into_iter().for_each(|thread| thread.join().unwrap());
        });
    }
}
