//! `dir:` and `file:`: pictures in files.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use sdg_picture::PixelFrame;

use crate::address::Playback;
use crate::decode::{MAX_ENCODED_BYTES, decode};
use crate::error::CameraError;
use crate::source::{Missing, Source, Taken};

/// Interval between checks for new files.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time for which the length of an undecodable file must be constant; before that, the file is assumed to be
/// incomplete.
const UNCHANGED_TIME: Duration = Duration::from_millis(500);
/// Extensions of files that are read as pictures.
const EXTENSIONS: [&str; 8] = ["png", "jpg", "jpeg", "ppm", "webp", "bmp", "tif", "tiff"];

/// The pictures of a folder in the order of their names, or one file.
pub(crate) struct Folder {
    place: Place,
    playback: Playback,
    /// Names that were already played. With `follow`, a name that appears later is played whatever its order.
    played: BTreeSet<OsString>,
    num_played: u64,
    next_at: Instant,
    frame: PixelFrame,
    /// Length of the next file, which could not be decoded yet, and the time since which its length has been constant.
    unchanged: Option<(u64, Instant)>,
}

enum Place {
    Folder(PathBuf),
    File(PathBuf),
}

impl Folder {
    /// The pictures of a folder.
    ///
    /// # Errors
    /// [`CameraError::Open`] if the path is not a folder, or has no pictures and is not followed.
    pub(crate) fn open(path: &Path, playback: Playback, address: &str) -> Result<Self, CameraError> {
        let refused = |why: String| CameraError::Open { address: address.to_owned(), why };
        let names = names(path).map_err(|error| refused(format!("expected a folder, found: {error}")))?;
        if names.is_empty() && !playback.is_followed {
            return Err(refused(format!("expected pictures ({}) in the folder, found none", EXTENSIONS.join(", "))));
        }
        Ok(Self::at(Place::Folder(path.to_owned()), playback))
    }

    /// A single picture.
    ///
    /// # Errors
    /// [`CameraError::Open`] if the path is not a file.
    pub(crate) fn open_file(path: &Path, playback: Playback, address: &str) -> Result<Self, CameraError> {
        let refused = |found: String| CameraError::Open {
            address: address.to_owned(),
            why: format!("expected a picture, found: {found}"),
        };
        let metadata = fs::metadata(path).map_err(|error| refused(error.to_string()))?;
        if metadata.is_dir() {
            return Err(refused(format!("a folder; use dir:{}", path.display())));
        }
        Ok(Self::at(Place::File(path.to_owned()), playback))
    }

    fn at(place: Place, playback: Playback) -> Self {
        Self {
            place,
            playback,
            played: BTreeSet::new(),
            num_played: 0,
            next_at: Instant::now(),
            frame: PixelFrame::Upright,
            unchanged: None,
        }
    }

    /// Sets the orientation of the pictures.
    pub(crate) fn in_frame(self, frame: PixelFrame) -> Self {
        Self { frame, ..self }
    }

    /// The next file; `None` after the last.
    fn next_path(&mut self) -> Result<Option<PathBuf>, Missing> {
        match &self.place {
            Place::File(path) => Ok((self.num_played == 0 || self.playback.is_looped).then(|| path.clone())),
            Place::Folder(folder) => {
                // The folder is listed again for each picture, because files may appear and disappear.
                let names =
                    names(folder).map_err(|error| Missing::Gone(format!("the folder cannot be read: {error}")))?;
                let mut next = names.iter().find(|name| !self.played.contains(*name));
                if next.is_none() && self.playback.is_looped {
                    self.played.clear();
                    next = names.first();
                }
                Ok(next.map(|name| folder.join(name)))
            }
        }
    }

    fn mark_played(&mut self, path: &Path) {
        self.num_played += 1;
        self.unchanged = None;
        if let (Place::Folder(_), Some(name)) = (&self.place, path.file_name()) {
            self.played.insert(name.to_owned());
        }
    }
}

impl Source for Folder {
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing> {
        let wait = self.next_at.saturating_duration_since(Instant::now());
        sleep(wait);
        // Waiting for the requested interval is not a stall.
        let deadline = deadline + wait;
        let path = loop {
            match self.next_path()? {
                Some(path) => break path,
                None if !self.playback.is_followed => return Ok(None),
                None if Instant::now() >= deadline => return Err(Missing::Late),
                None => sleep(POLL_INTERVAL),
            }
        };
        self.next_at = Instant::now() + self.playback.interval.unwrap_or_default();
        let read = read_finished(&path, self.frame, deadline, &mut self.unchanged);
        if !matches!(read, Err(Missing::Late)) {
            self.mark_played(&path);
        }
        let (picture, captured) = read?;
        Ok(Some(Taken { picture, captured, num_skipped: 0 }))
    }

    fn is_on_request(&self) -> bool {
        true
    }

    fn has_connection(&self) -> bool {
        false
    }
}

/// The sorted names of the pictures in a folder, without hidden files: programs often write a file under a hidden name
/// first.
fn names(folder: &Path) -> std::io::Result<Vec<OsString>> {
    let is_picture = |name: &OsString| {
        let path = Path::new(name);
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        !name.as_encoded_bytes().starts_with(b".")
            && EXTENSIONS.iter().any(|known| extension.as_deref().is_some_and(|e| e == *known))
    };
    let mut names: Vec<_> =
        fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.file_name())).filter(is_picture).collect();
    names.sort();
    Ok(names)
}

/// Reads a picture and its modification time. A file that cannot be decoded is read again while it may still grow; one
/// that grows is not read before the deadline. A file that may still grow at the deadline is late; `unchanged` is kept
/// for the next call.
fn read_finished(
    path: &Path,
    frame: PixelFrame,
    deadline: Instant,
    unchanged: &mut Option<(u64, Instant)>,
) -> Result<(image::RgbImage, SystemTime), Missing> {
    let torn = |found: String| Missing::Torn(format!("{}: {found}", path.display()));
    let failed = |error: std::io::Error| torn(error.to_string());
    loop {
        let file = File::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        let (length, changed) = (metadata.len(), metadata.modified());
        let is_growing = unchanged.is_some_and(|(before, _)| before != length);
        if !is_growing || Instant::now() >= deadline {
            let mut bytes = Vec::new();
            file.take(MAX_ENCODED_BYTES as u64 * 8 + 1).read_to_end(&mut bytes).map_err(failed)?;
            let found = match decode(&bytes, frame) {
                Ok(picture) => return Ok((picture, changed.unwrap_or_else(|_| SystemTime::now()))),
                Err(found) => found,
            };
            // A file that was modified long ago is complete.
            let age = changed.ok().and_then(|changed| changed.elapsed().ok());
            let is_old = age.is_some_and(|age| age > UNCHANGED_TIME * 4);
            let is_constant = unchanged.is_some_and(|(_, since)| since.elapsed() >= UNCHANGED_TIME);
            if !is_growing && (is_old || is_constant) {
                return Err(torn(found));
            }
        }
        if is_growing || unchanged.is_none() {
            *unchanged = Some((length, Instant::now()));
        }
        if Instant::now() >= deadline {
            return Err(Missing::Late);
        }
        sleep(POLL_INTERVAL);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgb, RgbImage};
    use std::io::{Cursor, Write};

    fn png(level: u8) -> Vec<u8> {
        let mut bytes = Vec::new();
        let picture = RgbImage::from_fn(32, 32, |x, y| Rgb([level, (x * y) as u8, x as u8]));
        picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) {
        fs::write(folder.path().join(name), bytes).unwrap();
    }

    fn open(folder: &tempfile::TempDir, playback: Playback) -> Folder {
        Folder::open(folder.path(), playback, "dir:test").unwrap()
    }

    fn soon() -> Instant {
        Instant::now() + Duration::from_millis(100)
    }

    fn level(folder: &mut Folder) -> Option<u8> {
        let later = Instant::now() + Duration::from_secs(2);
        folder.take(later).unwrap().map(|taken| taken.picture.get_pixel(0, 0)[0])
    }

    #[test]
    fn names_give_the_order_and_the_last_is_the_end_or_the_beginning() {
        let files = tempfile::tempdir().unwrap();
        for (name, level) in [("b.PNG", 2), ("a.png", 1), ("c.png", 3), (".d.png", 4), ("notes.txt", 5)] {
            write(&files, name, &png(level));
        }
        let mut once = open(&files, Playback::default());
        let levels: Vec<_> = std::iter::from_fn(|| level(&mut once)).collect();
        assert_eq!(levels, [1, 2, 3]);
        let mut looped = open(&files, Playback { is_looped: true, ..Playback::default() });
        let levels: Vec<_> = (0..7).map(|_| level(&mut looped).unwrap()).collect();
        assert_eq!(levels, [1, 2, 3, 1, 2, 3, 1]);
    }

    #[test]
    fn a_followed_folder_waits_for_new_files_and_for_files_that_are_being_written() {
        let files = tempfile::tempdir().unwrap();
        let mut followed = open(&files, Playback { is_followed: true, ..Playback::default() });
        assert!(matches!(followed.take(soon()), Err(Missing::Late)));
        write(&files, "b.png", &png(2));
        assert_eq!(level(&mut followed), Some(2));
        // A name that sorts earlier appears later; at first, only half of the file exists.
        let bytes = png(1);
        let (half, rest) = bytes.split_at(bytes.len() / 2);
        write(&files, "a.png", half);
        let path = files.path().join("a.png");
        let rest = rest.to_vec();
        let writer = std::thread::spawn(move || {
            sleep(Duration::from_millis(100));
            fs::OpenOptions::new().append(true).open(path).unwrap().write_all(&rest).unwrap();
        });
        assert_eq!(level(&mut followed), Some(1));
        writer.join().unwrap();
        assert!(matches!(followed.take(soon()), Err(Missing::Late)));
    }

    #[test]
    fn a_torn_file_is_named_and_the_next_one_gets_its_turn() {
        let files = tempfile::tempdir().unwrap();
        write(&files, "a.png", &png(1)[..40]);
        write(&files, "b.png", &png(2));
        let mut folder = open(&files, Playback::default());
        // Until its length has been constant for long enough, it may still grow.
        assert!(matches!(folder.take(soon()), Err(Missing::Late)));
        let torn = std::iter::repeat_with(|| folder.take(soon())).find(|taken| !matches!(taken, Err(Missing::Late)));
        assert!(matches!(torn, Some(Err(Missing::Torn(found))) if found.contains("a.png")));
        assert_eq!(level(&mut folder), Some(2));
    }

    #[test]
    fn a_file_that_keeps_growing_is_late_and_read_when_it_is_complete() {
        let files = tempfile::tempdir().unwrap();
        let bytes = png(1);
        write(&files, "a.png", &bytes[..40]);
        let path = files.path().join("a.png");
        // In about 60 parts, within 0.3 s.
        let writer = std::thread::spawn(move || {
            let mut file = fs::OpenOptions::new().append(true).open(path).unwrap();
            for part in bytes[40..].chunks(bytes.len().div_ceil(60)) {
                sleep(Duration::from_millis(5));
                file.write_all(part).unwrap();
            }
        });
        let mut folder = open(&files, Playback::default());
        assert!(matches!(folder.take(soon()), Err(Missing::Late)));
        writer.join().unwrap();
        assert_eq!(level(&mut folder), Some(1));
    }

    #[test]
    fn one_file_is_given_once_or_in_step() {
        let files = tempfile::tempdir().unwrap();
        write(&files, "a.png", &png(1));
        let path = files.path().join("a.png");
        let mut once = Folder::open_file(&path, Playback::default(), "file:a.png").unwrap();
        assert_eq!((level(&mut once), level(&mut once)), (Some(1), None));
        let interval = Duration::from_millis(150);
        let playback = Playback { interval: Some(interval), is_looped: true, is_followed: false };
        let mut looped = Folder::open_file(&path, playback, "file:a.png").unwrap();
        let start = Instant::now();
        assert_eq!([level(&mut looped), level(&mut looped), level(&mut looped)], [Some(1); 3]);
        assert!(start.elapsed() >= interval * 2);
    }

    #[test]
    fn what_is_not_there_is_refused_when_it_is_opened() {
        let files = tempfile::tempdir().unwrap();
        let refused = |result: Result<Folder, CameraError>| result.err().unwrap().to_string();
        let empty = refused(Folder::open(files.path(), Playback::default(), "dir:x"));
        assert!(empty.contains("dir:x") && empty.contains("found none"), "{empty}");
        assert!(
            refused(Folder::open(&files.path().join("no"), Playback::default(), "dir:x")).contains("expected a folder")
        );
        assert!(refused(Folder::open_file(files.path(), Playback::default(), "file:x")).contains("a folder; use dir:"));
    }
}
