//! The input files from which a model is taught.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sdg_demonstration::{Demonstration, PixelFrame};
use sdg_grasp::{GraspError, TeachOptions, check_region_from_above};

use crate::camera_files::CameraFile;
use crate::demonstrations::read_pair;
use crate::pictures::{check_is_not_turned, read_image_in};

/// Photos with their marks, and optional further inputs.
#[derive(Debug, Clone, Copy)]
pub struct TeachingFiles<'a> {
    /// Photo and marks of each demonstration.
    pub demonstrations: &'a [(PathBuf, PathBuf)],
    /// Pictures without the part.
    pub negatives: &'a [PathBuf],
    /// The calibrated camera that took all pictures, and the heights above the table of the marks and of the grasp, in
    /// metres.
    pub camera: Option<(&'a Path, [f64; 2])>,
}

impl TeachingFiles<'_> {
    /// Reads the demonstrations; with a camera, in the plan view of the marks' plane. Adds the pictures without the
    /// part and the lengths to the options. If the options have a region, its picture size is set to the size of the
    /// first photo.
    ///
    /// # Errors
    /// Files cannot be read, or the region is not inside the first photo. With a camera: a photo is rotated by an Exif
    /// orientation, has a different size, or has marks outside the visible part of the plane; or the region
    /// cannot be searched in the plan view.
    pub fn read(&self, options: &mut TeachOptions) -> Result<Vec<Demonstration>> {
        let mut pixel_frame = PixelFrame::Upright;
        if self.camera.is_some() {
            self.demonstrations.iter().try_for_each(|(photo, _)| check_is_not_turned(photo))?;
            pixel_frame = PixelFrame::Sensor;
        }
        let read = self.demonstrations.iter().map(|(photo, marks)| read_pair(photo, marks));
        let demonstrations = read.collect::<Result<Vec<_>>>()?;
        options.negatives =
            self.negatives.iter().map(|path| read_image_in(path, pixel_frame)).collect::<Result<_>>()?;
        if let (Some(region), Some(first)) = (options.region, demonstrations.first()) {
            let size = first.image.dimensions().into();
            let region = region.of_picture(size);
            region.check(size).map_err(GraspError::from)?;
            options.region = Some(region);
        }
        let Some((path, [mark_height_m, grasp_height_m])) = self.camera else { return Ok(demonstrations) };
        let camera = CameraFile::read(path)?;
        for (demonstration, (photo, _)) in demonstrations.iter().zip(self.demonstrations) {
            camera.check_picture(&demonstration.image).with_context(|| photo.display().to_string())?;
        }
        for (negative, path) in options.negatives.iter().zip(self.negatives) {
            camera.check_picture(negative).with_context(|| path.display().to_string())?;
        }
        let (seen, lengths) = camera.seen_from_above(&demonstrations, mark_height_m, grasp_height_m)?;
        options.negatives = camera.pictures_from_above(&options.negatives, &lengths)?;
        if let Some(region) = &options.region {
            check_region_from_above(region, &seen, &camera.over_table, &lengths)?;
        }
        options.lengths = Some(lengths);
        options.over_table = Some(camera.over_table);
        Ok(seen)
    }
}
