//! Checks that marks belong to their photo: to its upright pixels, and to no other picture.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::RgbImage;
use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts, marks_fit, other_reading};

use crate::pictures;

/// Minimum ratio of two fits for the better one to be preferred. Chosen by hand.
const MIN_GAIN: f64 = 1.25;
/// Minimum correlation of grey values around the marks for two files to be of the same picture: one of them may be a
/// strongly compressed JPEG, a greyscale copy or a darker one. Chosen by hand.
const MIN_CORRELATION: f64 = 0.9;

/// An upright photo, and the files of photo and marks.
pub struct MarkedPhoto<'a> {
    pub photo: &'a Path,
    pub image: &'a RgbImage,
    /// The file of the marks.
    pub marks: &'a Path,
    /// The contents of that file.
    pub bytes: &'a [u8],
    /// The photo's name or path, which selects the photo's entry in the file of the marks.
    pub file_name: Option<&'a str>,
}

impl MarkedPhoto<'_> {
    /// The marks that `read` returns for the upright photo: one, several, or none if the photo does not show the part.
    ///
    /// # Errors
    /// The errors of `read`; or the marks do not fit the upright pixels clearly better than the stored pixels.
    pub fn upright<T>(
        &self,
        read: impl Fn(&ImageFacts) -> Result<Vec<T>>,
        annotation: impl Fn(&T) -> &Annotation,
    ) -> Result<Vec<T>> {
        let (marked, is_turned) = self.read_upright(read, annotation)?;
        self.report_orientation(is_turned);
        Ok(marked)
    }

    /// Reports an applied orientation. Called after all fallible steps.
    fn report_orientation(&self, is_turned: bool) {
        if is_turned {
            sdg_files::print_stderr(format_args!(
                "{}: rotated as its Exif orientation says; the marks are read on the rotated photo\n",
                self.photo.display()
            ));
        }
    }

    /// The marks, and whether the photo's orientation was applied.
    fn read_upright<T>(
        &self,
        read: impl Fn(&ImageFacts) -> Result<Vec<T>>,
        annotation: impl Fn(&T) -> &Annotation,
    ) -> Result<(Vec<T>, bool)> {
        let read_on = |image: &RgbImage| {
            read(&ImageFacts { width: image.width(), height: image.height(), file_name: self.file_name })
        };
        let fit =
            |image: &RgbImage, marked: &[T]| marked.iter().map(|one| marks_fit(image, annotation(one))).sum::<f64>();
        let marked = read_on(self.image);
        let mut is_turned = false;
        if let Some(sensor) = pictures::read_sensor_pixels_if_turned(self.photo)? {
            let of_sensor = read_on(&sensor).unwrap_or_default();
            let as_shown = marked.as_ref().map_or(0.0, |marked| fit(self.image, marked));
            let as_stored = fit(&sensor, &of_sensor);
            let has_marks = !of_sensor.is_empty() || marked.as_ref().is_ok_and(|marked| !marked.is_empty());
            // Marks that fit neither orientation have another error, which is reported later.
            if as_stored > 0.0 && as_shown <= MIN_GAIN * as_stored {
                let as_well = if as_stored > MIN_GAIN * as_shown { "" } else { " just as well" };
                bail!(
                    "{}: expected marks on the photo as viewers show it, found marks that fit the stored \
                     pixels{as_well}: annotation tools may ignore the Exif orientation that rotates {}; save the photo \
                     upright without the tag and mark it again",
                    self.marks.display(),
                    self.photo.display()
                );
            }
            is_turned = has_marks;
        }
        Ok((marked?, is_turned))
    }

    /// Like [`Self::upright`], for a demonstration, in which the part must be clearly visible.
    ///
    /// # Errors
    /// The errors of [`Self::upright`]; or the marks also fit if their numbers are read in another way; or the file of
    /// the marks contains the name of another existing picture, and the marks fit that picture as well.
    pub fn checked<T>(
        &self,
        read: impl Fn(&ImageFacts) -> Result<Vec<T>>,
        annotation: impl Fn(&T) -> &Annotation,
    ) -> Result<Vec<T>> {
        let (marked, is_turned) = self.read_upright(read, &annotation)?;
        let annotations: Vec<&Annotation> = marked.iter().map(&annotation).collect();
        if let Some(other) = self.other_picture(&annotations) {
            bail!("{}: {other}", self.marks.display());
        }
        // Marks without a grasp are not taught; the missing points are reported elsewhere.
        let grasps: Vec<&Annotation> = annotations.into_iter().filter(|one| one.grasp.is_some()).collect();
        if let Some(reading) = other_reading(self.image, &grasps) {
            bail!(
                "{}: expected marks in pixels of {}, found marks that {}",
                self.marks.display(),
                self.photo.display(),
                reading.in_words()
            );
        }
        self.report_orientation(is_turned);
        Ok(marked)
    }

    /// The text of the error, if the file names another existing picture that the marks fit as well.
    fn other_picture(&self, marked: &[&Annotation]) -> Option<String> {
        let (field, name) = AnnotationFormat::named_picture(self.bytes)?;
        let base_name = name.rsplit(['/', '\\']).next().filter(|name| !name.is_empty())?;
        let beside = |file: &Path| file.parent().map(|folder| folder.join(base_name));
        let relative = self.marks.parent().map(|folder| folder.join(&name));
        let places: [Option<PathBuf>; 3] = [relative, beside(self.marks), beside(self.photo)];
        let places: Vec<PathBuf> = places.into_iter().flatten().filter(|path| path.is_file()).collect();
        if places.is_empty() || places.iter().any(|path| sdg_files::is_same_file(path, self.photo)) {
            return None;
        }
        let other = places.iter().find_map(|path| pictures::read_image(path).ok())?;
        if other.dimensions() != self.image.dimensions() || self.is_same_picture(&other, marked) {
            return None;
        }
        let fit = |image: &RgbImage| marked.iter().map(|one| marks_fit(image, one)).sum::<f64>();
        (fit(self.image) <= MIN_GAIN * fit(&other)).then(|| {
            format!(
                "{field}: expected {}, or a name that no existing picture has, found `{base_name}`, another picture \
                 that the marks fit as well",
                self.photo.display()
            )
        })
    }

    fn is_same_picture(&self, other: &RgbImage, marked: &[&Annotation]) -> bool {
        let grey = |image: &RgbImage, x, y| image.get_pixel(x, y).0.iter().map(|value| f64::from(*value)).sum::<f64>();
        let mut pairs = Vec::new();
        for bbox in marked.iter().map(|one| one.bbox) {
            let columns = bbox.x1.max(0.0) as u32..(bbox.x2.max(0.0) as u32).min(other.width());
            for y in bbox.y1.max(0.0) as u32..(bbox.y2.max(0.0) as u32).min(other.height()) {
                pairs.extend(columns.clone().map(|x| [grey(self.image, x, y), grey(other, x, y)]));
            }
        }
        let count = pairs.len().max(1) as f64;
        let [mean, other_mean] = [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<f64>() / count);
        let product = |a: usize, b: usize| {
            let means = [mean, other_mean];
            pairs.iter().map(|pair| (pair[a] - means[a]) * (pair[b] - means[b])).sum::<f64>()
        };
        // In a uniform area all products are 0, so the pictures count as the same.
        product(0, 1) >= MIN_CORRELATION * (product(0, 0) * product(1, 1)).sqrt()
    }
}
