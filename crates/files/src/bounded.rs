//! Reading files with a size limit.

use std::io::Read;
use std::path::Path;

use crate::error::{FileError, Result};
use crate::inputs;

/// Reads a whole file, unless it is larger than `max_bytes`.
///
/// # Errors
/// The file cannot be read or is larger, or the path is a folder.
pub fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let (file, length) = inputs::open(path)?;
    if length > max_bytes {
        return Err(FileError::TooLarge { path: path.to_owned(), max_bytes, found: Some(length) });
    }
    read_bounded(file, path, max_bytes)
}

/// Reads to the end, but at most `max_bytes`; a pipe has no length to check beforehand. `name` is used in errors.
///
/// # Errors
/// The input cannot be read or is longer.
pub fn read_bounded(input: impl Read, name: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(max_bytes + 1).read_to_end(&mut bytes).map_err(FileError::at(name, "read"))?;
    if bytes.len() as u64 > max_bytes {
        return Err(FileError::TooLarge { path: name.to_owned(), max_bytes, found: None });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("/nowhere/at/all.png"), 10).unwrap_err();
        assert_eq!(error.to_string(), "/nowhere/at/all.png: cannot read");
        assert!(std::error::Error::source(&error).unwrap().to_string().starts_with("No such file"));
    }

    #[test]
    fn larger_than_allowed_is_refused() {
        let error = read(Path::new(env!("CARGO_MANIFEST_PATH")), 3).unwrap_err();
        assert!(error.to_string().contains("expected at most 3 bytes"));
        // The length is checked before any of the file is read.
        assert!(matches!(error, FileError::TooLarge { found: Some(1..), .. }), "{error}");
        let error = read_bounded([0; 4].as_slice(), Path::new("standard input"), 3).unwrap_err();
        assert_eq!(error.to_string(), "standard input: expected at most 3 bytes, found more");
    }
}
