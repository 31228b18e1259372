//! `--demo IMAGE:ANNOTATION`, or `--demo IMAGE` with the marks beside it: a photo and the marks on it.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_demonstration::{Annotation, Demonstration, ImageFacts};

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
    let path = std::path::absolute(image_path).unwrap_or_else(|_| image_path.to_owned());
    let facts =
        |image: &RgbImage| ImageFacts { width: image.width(), height: image.height(), file_name: path.to_str() };
    let file = AnnotationFile::read(annotation_path)?;
    let objects = file.objects(&facts(&image));
    if let Some(sensor) = files::read_sensor_pixels_if_turned(image_path)? {
        let of_sensor = file.objects(&facts(&sensor)).unwrap_or_default();
        let fits =
            |image: &RgbImage, objects: &[Annotation]| objects.iter().map(|one| contrast(image, one)).sum::<f64>();
        let fit_of_sensor = fits(&sensor, &of_sensor);
        let fit_as_shown = objects.as_ref().map_or(0.0, |objects| fits(&image, objects));
        if fit_as_shown <= MIN_GAIN * fit_of_sensor {
            let found = if fit_of_sensor > MIN_GAIN * fit_as_shown {
                "marks that fit its pixels as they are stored"
            } else {
                "marks that fit its pixels as they are stored just as well"
            };
            bail!(
                "{}: expected marks on the photo as viewers show it, found {found}: an Exif orientation turns {}, which tools of marks may \
                 ignore; save the photo upright without the tag and mark it anew",
                annotation_path.display(),
                image_path.display()
            );
        }
        eprintln!(
            "{}: turned as its Exif orientation says; the marks are read on the turned photo",
            image_path.display()
        );
    }
    let mut objects = objects?;
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

/// Marks that fit one of the two so much better were made on it. Chosen by hand.
const MIN_GAIN: f64 = 1.25;

/// How much colours change across the border of the marked region, in grey values: more where the border is the part's.
fn contrast(image: &RgbImage, marked: &Annotation) -> f64 {
    let region = marked.region();
    let corners = &region.vertices;
    let reach = 0.01 * (marked.bbox.width() + marked.bbox.height());
    let color = |at: Point2<f64>| {
        let inside = |value: f64, end: u32| (value.max(0.0) as u32).min(end - 1);
        image.get_pixel(inside(at.x, image.width()), inside(at.y, image.height())).0.map(f64::from)
    };
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for (start, end) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let side = end - start;
        let across = Vector2::new(-side.y, side.x).try_normalize(f64::EPSILON).unwrap_or_default() * reach.max(2.0);
        let num_steps = side.norm().ceil() as u32;
        for step in 0..num_steps {
            let at = start + side * (f64::from(step) / f64::from(num_steps));
            let (one, other) = (color(at + across), color(at - across));
            sum += (0..3).map(|channel| (one[channel] - other[channel]).abs()).sum::<f64>() / 3.0;
            count += 1.0;
        }
    }
    sum / count.max(1.0)
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
