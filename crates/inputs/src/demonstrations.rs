//! The two files of a demonstration: a photo and its marks.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_demonstration::{Annotation, Demonstration};

use crate::annotation_files::{AnnotationFile, beside_photo};
use crate::error::NotAPair;
use crate::pictures::read_image;

/// Reads a photo and its marks.
///
/// # Errors
/// Files cannot be read, or the marks are not of exactly one object.
pub fn read_pair(image_path: &Path, annotation_path: &Path) -> Result<Demonstration> {
    let image = read_image(image_path)?;
    let file = AnnotationFile::read(annotation_path)?;
    let instances = file.objects_on(image_path, &image)?;
    let mut objects: Vec<Annotation> = instances.into_iter().map(|instance| instance.annotation).collect();
    // Objects without a grasp are boxes that another tool or person made.
    if objects.iter().filter(|object| object.grasp.is_some()).count() == 1 {
        for other in objects.extract_if(.., |object| object.grasp.is_none()) {
            let path = annotation_path.display();
            sdg_files::print_stderr(format_args!("{path}: skipped `{}`, which has no grasp\n", other.label));
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

/// The photo and the annotation file of `IMAGE:ANNOTATION`, or of `IMAGE` with the annotation beside it.
///
/// # Errors
/// The photo does not exist or has no marks beside it; [`NotAPair`] for a malformed text.
pub fn photo_and_marks(text: &str) -> Result<(PathBuf, PathBuf)> {
    let photo = Path::new(text);
    if text.contains(':') && !photo.exists() {
        return Ok(split(text)?);
    }
    if text.is_empty() {
        return Err(NotAPair { found: "nothing".to_owned() }.into());
    }
    // Checked first, so that a missing photo is not reported as a photo without marks.
    sdg_files::check_readable(photo)?;
    Ok((photo.to_owned(), beside_photo(photo)?))
}

/// Splits `IMAGE:ANNOTATION` at a colon. Paths may contain colons as well: of several colons, the one between two
/// existing files is used.
///
/// # Errors
/// There is no colon between two names.
pub fn split(text: &str) -> std::result::Result<(PathBuf, PathBuf), NotAPair> {
    let splits: Vec<(PathBuf, PathBuf)> = text
        .match_indices(':')
        .map(|(at, _)| (text[..at].into(), text[at + 1..].into()))
        .filter(|(image, annotation): &(PathBuf, PathBuf)| {
            !image.as_os_str().is_empty() && !annotation.as_os_str().is_empty()
        })
        .collect();
    let exist = |(image, annotation): &&(PathBuf, PathBuf)| Path::exists(image) && Path::exists(annotation);
    let best = splits.iter().find(exist).or(splits.last());
    best.cloned().ok_or_else(|| NotAPair { found: format!("\"{text}\"") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error_line::one_line;

    #[test]
    fn splits_at_the_colon() {
        assert_eq!(split("a.png:b.json").unwrap(), ("a.png".into(), "b.json".into()));
        assert_eq!(split("C:/a.png:b.json").unwrap(), ("C:/a.png".into(), "b.json".into()));
    }

    #[test]
    fn a_photo_that_is_not_there_is_told_as_that() {
        let error = photo_and_marks("/nowhere/photo.png").unwrap_err();
        assert!(one_line(&error).starts_with("/nowhere/photo.png: cannot read: No such file"));
    }
}
