//! The two files of a demonstration: a photo and its marks.

use std::path::Path;

use anyhow::{Result, bail};
use sdg_demonstration::Demonstration;

use crate::pictures::read_image;

use crate::annotation_files::AnnotationFile;

/// Reads a photo and its marks.
///
/// # Errors
/// Files cannot be read, or the marks are not of exactly one object.
pub fn read_pair(image_path: &Path, annotation_path: &Path) -> Result<Demonstration> {
    let image = read_image(image_path)?;
    let file = AnnotationFile::read(annotation_path)?;
    let mut objects = file.objects_on(image_path, &image)?;
    // Objects without a grasp are boxes that another tool or person made.
    if objects.iter().filter(|object| object.grasp.is_some()).count() == 1 {
        for other in objects.extract_if(.., |object| object.grasp.is_none()) {
            eprintln!("{}: skipped `{}`, which has no grasp", annotation_path.display(), other.label);
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
