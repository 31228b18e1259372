//! Files at the edge: read with a bound, named in every error, written whole or not at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_demonstration::{ImageLimits, PixelFrame, decode_image_in, is_turned_by_exif};
use sdg_grasp::{Device, GraspModel, summarize};
use sdg_report::write_atomically;

/// Larger photos than any camera makes.
const MAX_IMAGE_BYTES: u64 = 256 << 20;
/// Larger annotations than any tool writes, embedded image included.
pub const MAX_ANNOTATION_BYTES: u64 = 512 << 20;
/// Larger grasp models than any preset gives.
const MAX_MODEL_BYTES: u64 = 2 << 30;

/// The bytes that tell a picture's format.
const MAX_SIGNATURE: u64 = 64;

/// Reads a whole file, unless it is larger than `max_bytes`.
pub fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let (file, length) = open(path)?;
    if length > max_bytes {
        bail!("{}: expected at most {max_bytes} bytes, found {length}", path.display());
    }
    read_bounded(file, path, max_bytes)
}

/// Whether a file can be opened.
///
/// # Errors
/// Its name and what the system says; a folder.
pub fn check_readable(path: &Path) -> Result<()> {
    open(path).map(drop)
}

/// What this command has opened to read: [`write`] replaces none of it.
static INPUTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Whether two paths lead to one file that is there, whatever links they go through.
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

/// Makes sure that no input of this command would be replaced, but for `own`.
///
/// # Errors
/// A path that leads to one.
fn check_is_no_input(path: &Path, own: Option<&Path>) -> Result<()> {
    let is_input = |path: PathBuf| INPUTS.lock().unwrap_or_else(PoisonError::into_inner).contains(&path);
    if !own.is_some_and(|own| is_same_file(path, own)) && path.canonicalize().is_ok_and(is_input) {
        bail!("{}: expected a name of its own for what is written, found an input of this command", path.display());
    }
    Ok(())
}

/// Makes sure that no input of this command is replaced by what it will write, before it writes the first.
///
/// # Errors
/// A path that leads to one.
pub fn check_are_no_inputs(paths: impl IntoIterator<Item = PathBuf>) -> Result<()> {
    paths.into_iter().try_for_each(|path| check_is_no_input(&path, None))
}

/// Keeps [`write`] from replacing a file, or the files of a folder, that others than this module read.
pub fn keep(path: &Path) {
    let entries = fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let kept = entries.chain([path.to_owned()]).filter_map(|path| path.canonicalize().ok());
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner).extend(kept);
}

/// Writes a file whole or not at all, and never over an input of this command, or over a file of another kind.
///
/// # Errors
/// A path that leads to such a file; the system's reason.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    extend(path, None, bytes)
}

/// The same for a file that may be `own`, which the command read to keep what stands in it.
///
/// # Errors
/// As [`write`].
pub fn extend(path: &Path, own: Option<&Path>, bytes: &[u8]) -> Result<()> {
    check_is_no_input(path, own)?;
    check_replaces_its_kind(path, bytes)?;
    Ok(write_atomically(path, bytes)?)
}

/// Makes sure that a file is replaced by one of its kind: no photo by a report, no marks by a camera.
fn check_replaces_its_kind(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut start = Vec::new();
    let _ = File::open(path).and_then(|file| file.take(MAX_SIGNATURE).read_to_end(&mut start));
    let (found, written) = (kind_of(&start), kind_of(&bytes[..bytes.len().min(MAX_SIGNATURE as usize)]));
    if found.is_some() && found != written {
        let [found, written] = [found, written].map(Option::unwrap_or_default);
        bail!("{}: expected a new name, or {written} to replace, found {found}", path.display());
    }
    Ok(())
}

/// The kind of a file by its first bytes, in words; `None` for an empty one.
fn kind_of(start: &[u8]) -> Option<String> {
    let first = start.iter().find(|byte| !byte.is_ascii_whitespace())?;
    let kind = match (image::guess_format(start), first) {
        (Ok(format), _) => return Some(format!("a picture ({format:?})")),
        _ if start.starts_with(b"%PDF") => "a PDF",
        _ if start.get(8) == Some(&b'{') && start[4..8] == [0; 4] => "a model",
        (_, b'<') => "XML or HTML",
        (_, b'{' | b'[') => "JSON",
        _ if start.contains(&0) => "another file",
        _ => "text",
    };
    Some(kind.to_owned())
}

/// The file and its length.
fn open(path: &Path) -> Result<(File, u64)> {
    let named = || format!("{}: cannot read", path.display());
    let file = File::open(path).with_context(named)?;
    let metadata = file.metadata().with_context(named)?;
    if metadata.is_dir() {
        bail!("{}: expected a file, found a folder", path.display());
    }
    if let Ok(path) = path.canonicalize() {
        INPUTS.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
    }
    Ok((file, metadata.len()))
}

/// Reads to the end, unless that is further than `max_bytes`; a pipe has no length to check beforehand.
fn read_bounded(input: impl Read, name: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(max_bytes + 1).read_to_end(&mut bytes).with_context(|| format!("{}: cannot read", name.display()))?;
    if bytes.len() as u64 > max_bytes {
        bail!("{}: expected at most {max_bytes} bytes, found more", name.display());
    }
    Ok(bytes)
}

/// Reads a picture of any format that [`decode_image_in`] knows, upright.
pub fn read_image(path: &Path) -> Result<RgbImage> {
    read_image_in(path, PixelFrame::Upright)
}

/// The same with its pixels that way up: for a calibration, the sensor's.
pub fn read_image_in(path: &Path, frame: PixelFrame) -> Result<RgbImage> {
    let bytes = read(path, MAX_IMAGE_BYTES)?;
    decode_image_in(&bytes, &ImageLimits::default(), frame).with_context(|| path.display().to_string())
}

/// The pixels of a photo as they are stored, where an Exif orientation turns it.
pub fn read_sensor_pixels_if_turned(photo: &Path) -> Result<Option<RgbImage>> {
    let is_turned = is_turned_by_exif(&read(photo, MAX_IMAGE_BYTES)?);
    is_turned.then(|| read_image_in(photo, PixelFrame::Sensor)).transpose()
}

/// Makes sure that no Exif orientation turns a photo whose marks are to be in the pixels of a calibrated camera: nothing says in which
/// of the two frames they were made.
///
/// # Errors
/// A photo that is turned.
pub fn check_is_not_turned(photo: &Path) -> Result<()> {
    if is_turned_by_exif(&read(photo, MAX_IMAGE_BYTES)?) {
        bail!(
            "{}: expected a photo of the calibrated camera that no Exif orientation turns, found one: a calibration knows the \
             sensor's pixels; take the tag out (exiftool -Orientation= FILE), look whether the marks still fit, and mark it anew if not",
            photo.display()
        );
    }
    Ok(())
}

/// Pictures that are not read, and whose error says what to do instead.
pub const UNREADABLE_EXTENSIONS: [&str; 4] = ["heic", "heif", "avif", "gif"];

/// What stands for standard input among file names.
pub const STANDARD_INPUT: &str = "-";

/// Reads a picture from standard input, to its end.
pub fn read_standard_input_image(frame: PixelFrame) -> Result<RgbImage> {
    let name = Path::new("standard input");
    let bytes = read_bounded(std::io::stdin().lock(), name, MAX_IMAGE_BYTES)?;
    decode_image_in(&bytes, &ImageLimits::default(), frame).with_context(|| name.display().to_string())
}

/// Whether a file's name ends like one of these; case does not count.
pub fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension()
        .and_then(|extension| extension.to_str())
        .is_some_and(|extension| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known)))
}

/// What stands in a folder, sorted by name; hidden entries are left out.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let named = || format!("{}: cannot read this folder", folder.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).with_context(named)? {
        let entry = entry.with_context(named)?;
        if !entry.file_name().as_encoded_bytes().starts_with(b".") {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}

/// Reads a grasp model onto a device.
pub fn read_model(path: &Path, device: &Device) -> Result<GraspModel> {
    let bytes = read(path, MAX_MODEL_BYTES)?;
    GraspModel::from_bytes(&bytes, device).with_context(|| path.display().to_string())
}

/// Makes sure, before minutes of work, that a file can be written at `path` later, and that it is no input.
pub fn check_writable(path: &Path) -> Result<()> {
    check_extendable(path, None)
}

/// The same of a file that may be `own`, as for [`extend`].
///
/// # Errors
/// As [`check_writable`].
pub fn check_extendable(path: &Path, own: Option<&Path>) -> Result<()> {
    check_is_no_input(path, own)?;
    if path.is_dir() {
        bail!("{}: expected a file to write, found a folder", path.display());
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    check_folder_writable(folder)
}

/// Makes sure that a model file to be written replaces a model file or nothing.
///
/// # Errors
/// Another file of that name.
pub fn check_replaces_a_model(path: &Path) -> Result<()> {
    let bytes = match File::open(path) {
        Ok(file) => read_bounded(file, path, MAX_MODEL_BYTES)?,
        Err(_) => return Ok(()),
    };
    if !bytes.is_empty() {
        summarize(&bytes)
            .with_context(|| format!("{}: expected a new name, or a grasp model to replace", path.display()))?;
    }
    Ok(())
}

/// Makes sure that files can be written into an existing folder.
fn check_folder_writable(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".sdg-probe-{}.tmp", std::process::id()));
    File::create_new(&probe).with_context(|| format!("{}: cannot write into this folder", folder.display()))?;
    fs::remove_file(&probe).with_context(|| format!("{}: cannot remove a file of ours", probe.display()))
}

/// Makes a folder (and those above it) if it is missing, and makes sure that files can be written into it.
pub fn prepare_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot make this folder", folder.display()))?;
    check_folder_writable(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("/nowhere/at/all.png"), 10).unwrap_err();
        assert!(crate::exit::one_line(&error).starts_with("/nowhere/at/all.png: cannot read: No such file"));
    }

    #[test]
    fn a_folder_that_is_not_there_cannot_be_written() {
        let error = check_writable(Path::new("/nowhere/at/all.sdg")).unwrap_err();
        assert!(crate::exit::one_line(&error).starts_with("/nowhere/at: cannot write into this folder"));
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
            let error = write(path, b"<svg/>").unwrap_err().to_string();
            assert!(error.contains("or XML or HTML to replace") && error.contains(found), "{error}");
            assert_eq!(fs::read(path).unwrap(), before);
            write(path, &before).unwrap();
        }
        fs::write(&camera, "").unwrap();
        write(&camera, b"<svg/>").unwrap();
    }

    #[test]
    fn larger_than_allowed_is_refused() {
        let error = read(Path::new(env!("CARGO_MANIFEST_PATH")), 3).unwrap_err();
        assert!(error.to_string().contains("expected at most 3 bytes"));
    }
}
