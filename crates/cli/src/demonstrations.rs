//! `--demo IMAGE:ANNOTATION`, or `--demo IMAGE` with the marks beside it: a photo and the marks on it.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_inputs::annotation_files::beside_photo;
use sdg_inputs::demonstrations::read_pair;

use crate::exit::Usage;

/// Reads a demonstration from each argument.
pub fn read_all(arguments: &[String]) -> Result<Vec<Demonstration>> {
    pairs(arguments)?.iter().map(|(photo, marks)| read_pair(photo, marks)).collect()
}

/// The photo and the annotation file of each argument.
///
/// # Errors
/// A photo does not exist or has no marks beside it; [`Usage`] for a malformed argument.
pub fn pairs(arguments: &[String]) -> Result<Vec<(PathBuf, PathBuf)>> {
    arguments.iter().map(|argument| photo_and_marks(argument)).collect()
}

/// The photo and the annotation file of an argument; for a photo alone, the annotation beside it.
pub fn photo_and_marks(argument: &str) -> Result<(PathBuf, PathBuf)> {
    let photo = Path::new(argument);
    if argument.contains(':') && !photo.exists() {
        return split(argument);
    }
    if argument.is_empty() {
        return Err(Usage("--demo: expected IMAGE or IMAGE:ANNOTATION, found nothing".to_owned()).into());
    }
    // Checked first, so that a missing photo is not reported as a photo without marks.
    sdg_files::check_readable(photo)?;
    Ok((photo.to_owned(), beside_photo(photo)?))
}

/// Splits at a colon. Paths may contain colons as well: of several colons, the one between two existing files is used.
pub fn split(argument: &str) -> Result<(PathBuf, PathBuf)> {
    let splits: Vec<(PathBuf, PathBuf)> = argument
        .match_indices(':')
        .map(|(at, _)| (argument[..at].into(), argument[at + 1..].into()))
        .filter(|(image, annotation): &(PathBuf, PathBuf)| {
            !image.as_os_str().is_empty() && !annotation.as_os_str().is_empty()
        })
        .collect();
    let exist = |(image, annotation): &&(PathBuf, PathBuf)| Path::exists(image) && Path::exists(annotation);
    match splits.iter().find(exist).or(splits.last()) {
        Some(split) => Ok(split.clone()),
        None => Err(Usage(format!("--demo: expected IMAGE or IMAGE:ANNOTATION, found \"{argument}\"")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_at_the_colon() {
        assert_eq!(split("a.png:b.json").unwrap(), ("a.png".into(), "b.json".into()));
        assert_eq!(split("C:/a.png:b.json").unwrap(), ("C:/a.png".into(), "b.json".into()));
    }

    #[test]
    fn half_an_argument_is_wrong_usage() {
        for argument in ["", "a.png:", ":b.json"] {
            assert!(photo_and_marks(argument).unwrap_err().is::<Usage>(), "{argument}");
        }
    }

    #[test]
    fn a_photo_that_is_not_there_is_told_as_that() {
        let error = photo_and_marks("/nowhere/photo.png").unwrap_err();
        assert!(crate::exit::one_line(&error).starts_with("/nowhere/photo.png: cannot read: No such file"));
    }
}
