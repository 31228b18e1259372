//! A file with the page's token, which stays the same when the program is restarted.

use std::io::Write;
use std::path::Path;

use sdg_files::AtomicFile;

use crate::error::{Error, Result};
use crate::guard::new_token;

/// Reads the page's token; without the file, creates it with a new token, readable by its owner only.
///
/// # Errors
/// The file cannot be read or written, or contains no token; there are no random bytes for a new token.
pub fn token_of_file(path: &Path) -> Result<String> {
    const MAX_BYTES: u64 = 4096;
    if !path.exists() {
        let token = new_token()?;
        let mut file = AtomicFile::create_private(path)?;
        writeln!(file.as_file(), "{token}").map_err(Error::file(path, "cannot write the token of the page"))?;
        file.commit()?;
        return Ok(token);
    }
    let text = String::from_utf8_lossy(&sdg_files::read(path, MAX_BYTES)?).trim().to_owned();
    if text.len() < 16 || !text.chars().all(|c| c.is_ascii_alphanumeric()) {
        return Err(Error::NotAToken { path: path.to_owned(), found: text.chars().count() });
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_made_once_and_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let made = token_of_file(&path).unwrap();
        assert_eq!((made.len(), token_of_file(&path).unwrap()), (32, made));
        #[cfg(unix)]
        assert_eq!(std::os::unix::fs::PermissionsExt::mode(&path.metadata().unwrap().permissions()) & 0o777, 0o600);
        std::fs::write(&path, "short").unwrap();
        assert!(token_of_file(&path).unwrap_err().to_string().contains("16 letters"));
    }
}
