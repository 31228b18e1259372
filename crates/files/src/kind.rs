//! The kind of a file, recognised by its first bytes.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{FileError, Result};

/// Number of bytes that identify a picture's format.
const MAX_SIGNATURE: u64 = 64;

/// Checks that a file is replaced only by one of the same kind: a report does not replace a photo, and a
/// camera file does not replace marks.
///
/// # Errors
/// The existing file is of another kind.
pub(crate) fn check_replaces_its_kind(path: &Path, bytes: &[u8]) -> Result<()> {
    // Opening a pipe would wait for its writer; the writing refuses it.
    if !path.is_file() {
        return Ok(());
    }
    let mut start = Vec::new();
    let _ = File::open(path).and_then(|file| file.take(MAX_SIGNATURE).read_to_end(&mut start));
    let (found, written) = (kind_of(&start), kind_of(&bytes[..bytes.len().min(MAX_SIGNATURE as usize)]));
    if found.is_some() && found != written {
        let [found, written] = [found, written].map(Option::unwrap_or_default);
        return Err(FileError::OtherKind { path: path.to_owned(), written, found });
    }
    Ok(())
}

/// The kind of a file in words; `None` for an empty file.
fn kind_of(start: &[u8]) -> Option<String> {
    let first = start.iter().find(|byte| !byte.is_ascii_whitespace())?;
    let kind = match (image::guess_format(start), first) {
        // First, because the length of its header can have the bytes with which a picture begins: 12624 is "P1".
        _ if start.get(8) == Some(&b'{') && start[4..8] == [0; 4] => "a model",
        (Ok(format), _) => return Some(format!("a picture ({format:?})")),
        _ if start.starts_with(b"%PDF") => "a PDF",
        (_, b'<') => "XML or HTML",
        (_, b'{' | b'[') => "JSON",
        _ if start.contains(&0) => "another file",
        _ => "text",
    };
    Some(kind.to_owned())
}
