//! Files at the edge: read with a bound, named in every error, written whole or not at all.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_demonstration::{ImageLimits, decode_image};
use sdg_grasp::{Device, GraspModel};

/// Larger photos than any camera makes.
const MAX_IMAGE_BYTES: u64 = 256 << 20;
/// Larger annotations than any tool writes, embedded image included.
pub const MAX_ANNOTATION_BYTES: u64 = 512 << 20;
/// Larger grasp models than any preset gives.
const MAX_MODEL_BYTES: u64 = 2 << 30;

/// Reads a whole file, unless it is larger than `max_bytes`.
pub fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let named = || format!("{}: cannot read", path.display());
    let file = File::open(path).with_context(named)?;
    let metadata = file.metadata().with_context(named)?;
    if metadata.is_dir() {
        bail!("{}: expected a file, found a folder", path.display());
    }
    if metadata.len() > max_bytes {
        bail!("{}: expected at most {max_bytes} bytes, found {}", path.display(), metadata.len());
    }
    let mut bytes = Vec::new();
    // A pipe has no length to check beforehand.
    file.take(max_bytes + 1).read_to_end(&mut bytes).with_context(named)?;
    if bytes.len() as u64 > max_bytes {
        bail!("{}: expected at most {max_bytes} bytes, found more", path.display());
    }
    Ok(bytes)
}

/// Reads a PNG or JPEG.
pub fn read_image(path: &Path) -> Result<RgbImage> {
    let bytes = read(path, MAX_IMAGE_BYTES)?;
    decode_image(&bytes, &ImageLimits::default()).with_context(|| path.display().to_string())
}

/// Reads a grasp model onto a device.
pub fn read_model(path: &Path, device: &Device) -> Result<GraspModel> {
    let bytes = read(path, MAX_MODEL_BYTES)?;
    GraspModel::from_bytes(&bytes, device).with_context(|| path.display().to_string())
}

/// Makes sure, before minutes of work, that a file can be written beside `path` later.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        bail!("{}: expected a file to write, found a folder", path.display());
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    check_folder_writable(folder)
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
    fn larger_than_allowed_is_refused() {
        let error = read(Path::new(env!("CARGO_MANIFEST_PATH")), 3).unwrap_err();
        assert!(error.to_string().contains("expected at most 3 bytes"));
    }
}
