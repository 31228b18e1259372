//! Limits of a model's demonstrations, in teaching and in files: otherwise the reading of a forged file of kilobytes
//! could take gigabytes of memory, or minutes.

use image::RgbImage;
use sdg_demonstration::ImageLimits;

use crate::error::{GraspError, Result};
use crate::taught::MARGIN_PX;
use crate::taught_marks::{TaughtMarks, extent};

/// Maximum number of demonstrations of a model, far above practical use.
pub(crate) const MAX_DEMONSTRATIONS: usize = 100;
/// Minimum extent of a taught part in its photo: everything with two edges resembles a smaller part. Chosen by hand, not
/// measured.
pub(crate) const MIN_PART_PX: f64 = 20.0;

/// Checks the number of a model's demonstrations.
pub(crate) fn check_count(count: usize) -> Result<()> {
    match count {
        0 => Err(GraspError::NoDemonstration),
        1..=MAX_DEMONSTRATIONS => Ok(()),
        found => Err(GraspError::TooManyDemonstrations { most: MAX_DEMONSTRATIONS, found }),
    }
}

/// The number of pixels that the remaining cut-outs of a model may have. All cut-outs together may have as many pixels
/// as one picture.
#[derive(Debug)]
pub(crate) struct CutoutBudget {
    pixels: u64,
}

impl Default for CutoutBudget {
    fn default() -> Self {
        Self { pixels: ImageLimits::default().max_pixels }
    }
}

impl CutoutBudget {
    /// The maximum size of the next cut-out: that of its marks and a margin, within the budget.
    pub(crate) fn limits(&self, marks: &TaughtMarks) -> ImageLimits {
        let long = marks.bbox.width().max(marks.bbox.height());
        // A cut-out may have been enlarged with its margin, if another photo shows the part larger.
        let margin = 2.0 * (MARGIN_PX + 2.0) * (long / MIN_PART_PX).max(1.0);
        let extent = extent(&marks.bbox, &marks.grasp);
        // Infinite or too large numbers become the budget.
        let pixels = ((extent.width() + margin) * (extent.height() + margin)) as u64;
        ImageLimits { max_pixels: pixels.min(self.pixels) }
    }

    /// Subtracts a cut-out.
    pub(crate) fn take(&mut self, cutout: &RgbImage) -> Result<()> {
        let pixels = u64::from(cutout.width()) * u64::from(cutout.height());
        self.pixels = self
            .pixels
            .checked_sub(pixels)
            .ok_or(GraspError::PartsTooLarge { most: ImageLimits::default().max_pixels / 1_000_000 })?;
        Ok(())
    }
}
