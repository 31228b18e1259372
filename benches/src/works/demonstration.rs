//! Reads a shipped demonstration.

use std::path::Path;

use anyhow::{Context, Result};

/// The photo and its marks in a folder of `datasets/demonstrations`.
pub fn read_demonstration(folder: &Path) -> Result<sdg_demonstration::Demonstration> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).with_context(|| path.display().to_string())
    };
    let demonstration =
        sdg_demonstration::Demonstration::decode(&read("image.png")?, &read("annotation.json")?, Some("image.png"));
    demonstration.with_context(|| folder.display().to_string())
}
