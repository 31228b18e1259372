//! Computes the features of an image.

use std::sync::{Mutex, PoisonError};

use nalgebra::Point2;
use pulp::Arch;
use rayon::prelude::*;
use sdg_geometry::{Angle, Mask};

use crate::descriptor::{Describe, Scratch};
use crate::extrema::{self, Extremum};
use crate::orientation::{FindOrientations, Place};
use crate::scale_space::{self, Octave, PlanePool};
use crate::{Features, Plane, SiftConfig, SiftError, SiftKeypoint};

/// Finds keypoints and describes them.
///
/// Keeps the memory of the last scale space for the next image; several threads may use one `Sift`.
#[derive(Default)]
pub struct Sift {
    config: SiftConfig,
    pool: Mutex<PlanePool>,
}

impl Sift {
    /// A detector with these settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: SiftConfig) -> Result<Self, SiftError> {
        config.check()?;
        Ok(Self { config, pool: Mutex::default() })
    }

    /// The settings.
    pub fn config(&self) -> &SiftConfig {
        &self.config
    }

    /// The features of an image, or of its area inside the mask: from the finest octave to the coarsest and from the
    /// top down, or strongest contrast first if there are more points than [`SiftConfig::max_features`]. Descriptors
    /// also use pixels outside the mask.
    ///
    /// The result does not depend on the number of threads or on the processor.
    ///
    /// # Errors
    /// A mask whose size differs from the image's. An image too small for any keypoint has no features, without an
    /// error.
    pub fn detect_and_describe(&self, image: &Plane, mask: Option<&Mask>) -> Result<Features, SiftError> {
        check_mask(image, mask)?;
        let mut pool = std::mem::take(&mut *self.pool.lock().unwrap_or_else(PoisonError::into_inner));
        let octaves = scale_space::build(image, &self.config, &mut pool);
        let found = octaves.iter().map(|octave| (octave, extrema::find(octave, &self.config)));
        let mut points: Vec<(&Octave, Extremum)> = found
            .flat_map(|(octave, extrema)| extrema.into_iter().map(move |extremum| (octave, extremum)))
            .filter(|(octave, extremum)| is_inside(mask, octave.to_image(extremum.x), octave.to_image(extremum.y)))
            .collect();
        if let Some(most) = self.config.max_features.filter(|&most| most < points.len()) {
            // Sorting is stable, so equal contrasts keep their order.
            points.sort_by(|(_, a), (_, b)| b.contrast.total_cmp(&a.contrast));
            points.truncate(most);
        }
        let arch = Arch::new();
        let described: Vec<Features> = points
            .par_iter()
            .map_init(Scratch::default, |scratch, &(octave, extremum)| self.describe(arch, octave, extremum, scratch))
            .collect();
        let mut features = Features::default();
        for one in described {
            features.keypoints.extend(one.keypoints);
            features.descriptors.extend(one.descriptors);
        }
        if let Some(most) = self.config.max_features {
            features.keypoints.truncate(most);
            features.descriptors.truncate(most);
        }
        pool.recycle(octaves);
        *self.pool.lock().unwrap_or_else(PoisonError::into_inner) = pool;
        Ok(features)
    }

    /// The features at one extremum, one for each of its directions.
    fn describe(&self, arch: Arch, octave: &Octave, extremum: Extremum, scratch: &mut Scratch) -> Features {
        let sigma = self.config.sigma_of_level(extremum.level);
        let place = Place { x: extremum.x, y: extremum.y, sigma, level: extremum.level.round() as usize };
        let angles = arch.dispatch(FindOrientations { octave, place, gradients: &mut scratch.gradients });
        let mut features = Features::default();
        for angle in angles {
            let normalization = self.config.normalization;
            let describe = Describe { octave, place, angle, normalization, scratch: &mut *scratch };
            if let Some(descriptor) = arch.dispatch(describe) {
                features.descriptors.push(descriptor);
                features.keypoints.push(SiftKeypoint {
                    position: Point2::new(octave.to_image(extremum.x), octave.to_image(extremum.y)),
                    sigma: octave.pixel_size * sigma,
                    angle: Angle::from_radians(angle),
                    contrast: extremum.contrast,
                });
            }
        }
        features
    }
}

/// Checks that a mask has the size of the image.
///
/// # Errors
/// A mask whose size differs from the image's.
pub(crate) fn check_mask(image: &Plane, mask: Option<&Mask>) -> Result<(), SiftError> {
    let (image_width, image_height) = (image.width() as u32, image.height() as u32);
    match mask.map(|mask| (mask.width(), mask.height())) {
        Some((mask_width, mask_height)) if (mask_width, mask_height) != (image_width, image_height) => {
            Err(SiftError::MaskSize { image_width, image_height, mask_width, mask_height })
        }
        _ => Ok(()),
    }
}

fn is_inside(mask: Option<&Mask>, x: f64, y: f64) -> bool {
    // An extremum is at least `BORDER` samples from the border, so it is inside the image.
    mask.is_none_or(|mask| mask.get((x as u32).min(mask.width() - 1), (y as u32).min(mask.height() - 1)))
}
