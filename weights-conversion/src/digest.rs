//! The SHA-256 digest of a checkpoint.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::{Result, WeightsError};

/// Bytes hashed at once.
const PIECE: usize = 1 << 20;

/// SHA-256 of a file, in hexadecimal.
///
/// # Errors
/// A file that cannot be read.
pub fn sha256_of(path: &Path) -> Result<String> {
    let mut file = File::open(path).map_err(WeightsError::io("open the checkpoint"))?;
    let mut hasher = Sha256::new();
    let mut piece = vec![0; PIECE];
    loop {
        let len = file.read(&mut piece).map_err(WeightsError::io("read the checkpoint"))?;
        if len == 0 {
            break;
        }
        hasher.update(&piece[..len]);
    }
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
