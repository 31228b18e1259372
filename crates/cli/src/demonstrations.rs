//! `--demo IMAGE:ANNOTATION`, or `--demo IMAGE` with the marks beside it: a photo and the marks on it.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_demonstration::Demonstration;

use crate::annotation_files::{AnnotationFile, beside_photo};
use crate::exit::Usage;
use crate::files;

/// Makes sure that the photos of the arguments are a calibrated camera's.
///
/// # Errors
/// A photo that an Exif orientation turns.
pub fn check_are_not_turned(arguments: &[String]) -> Result<()> {
    arguments.iter().try_for_each(|argument| files::check_is_not_turned(&photo_and_marks(argument)?.0))
}

/// Reads one demonstration from each argument.
pub fn read_all(arguments: &[String]) -> Result<Vec<Demonstration>> {
    arguments.iter().map(|argument| read(argument)).collect()
}

fn read(argument: &str) -> Result<Demonstration> {
    let (image_path, annotation_path) = photo_and_marks(argument)?;
    read_pair(&image_path, &annotation_path)
}

/// Reads a photo and the marks on it.
///
/// # Errors
/// Files that cannot be read; other than one marked object.
pub fn read_pair(image_path: &Path, annotation_path: &Path) -> Result<Demonstration> {
    let image = files::read_image(image_path)?;
    let file = AnnotationFile::read(annotation_path)?;
    let mut objects = file.objects_on(image_path, &image)?;
    // Boxes of other things, which another tool or another person marked as well.
    if objects.iter().filter(|object| object.grasp.is_some()).count() == 1 {
        for other in objects.extract_if(.., |object| object.grasp.is_none()) {
            eprintln!("{}: passed over `{}`, which has no grasp", annotation_path.display(), other.label);
        }
    }
    if objects.len() != 1 {
        let labels: Vec<&str> = objects.iter().map(|object| object.label.as_str()).collect();
        bail!(
            "{}: expected one marked object, found {} ({}): a demonstration shows one part",
            annotation_path.display(),
            objects.len(),
            labels.join(", ")
        );
    }
    Ok(Demonstration { image, annotation: objects.remove(0) })
}

/// The two files of an argument; a photo alone has its marks beside it.
fn photo_and_marks(argument: &str) -> Result<(PathBuf, PathBuf)> {
    let photo = Path::new(argument);
    if argument.contains(':') && !photo.exists() {
        return split(argument);
    }
    if argument.is_empty() {
        return Err(Usage("--demo: expected IMAGE or IMAGE:ANNOTATION, found nothing".to_owned()).into());
    }
    // A missing photo is reported as missing, not as one without marks.
    files::check_readable(photo)?;
    Ok((photo.to_owned(), beside_photo(photo)?))
}

/// Splits at a colon. Paths may have colons of their own: of several, the one between two files that exist.
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
