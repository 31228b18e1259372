//! Limits of a model's demonstrations, in teaching and in files: otherwise the reading of a forged file of kilobytes
//! could take gigabytes of memory, or minutes.

use image::RgbImage;
use sdg_demonstration::ImageLimits;

use crate::error::{GraspError, Result};
use crate::prepared::MAX_EXTENT_PX;
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

/// Maximum number of pixels of all cut-outs after they were resized for the search, which takes about 0.2 s per million. A
/// cut-out whose outline fills it has below 0.1 million.
const MAX_RESIZED_PIXELS: f64 = 2e7;

/// The number of pixels that the remaining cut-outs of a model may have. All cut-outs together may have as many pixels
/// as one picture.
#[derive(Debug)]
pub(crate) struct CutoutBudget {
    pixels: u64,
    /// After the cut-outs were resized for the search.
    resized: f64,
}

impl Default for CutoutBudget {
    fn default() -> Self {
        Self { pixels: ImageLimits::default().max_pixels, resized: MAX_RESIZED_PIXELS }
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

    /// Subtracts a cut-out with these marks.
    pub(crate) fn take(&mut self, cutout: &RgbImage, marks: &TaughtMarks) -> Result<()> {
        let pixels = u64::from(cutout.width()) * u64::from(cutout.height());
        self.pixels = self
            .pixels
            .checked_sub(pixels)
            .ok_or(GraspError::PartsTooLarge { most: ImageLimits::default().max_pixels / 1_000_000 })?;
        let outline = marks.region().bounds();
        let shrink = (MAX_EXTENT_PX / outline.width().max(outline.height())).min(1.0);
        self.resized -= pixels as f64 * shrink * shrink;
        if self.resized < 0.0 { Err(GraspError::MarksFarApart) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    use super::*;

    #[test]
    fn cut_outs_that_are_large_before_or_after_resizing_are_refused() {
        let side = 1500;
        let bbox = BoundingBox { x1: 0.0, y1: 0.0, x2: f64::from(side), y2: f64::from(side) };
        let marks = |outline_px: f64| TaughtMarks {
            label: "bar".to_owned(),
            bbox,
            grasp: GraspLine::new(Point2::new(40.0, 35.0), Point2::new(80.0, 35.0)),
            outline: Some(Polygon::from_box(&BoundingBox { x1: 0.0, y1: 0.0, x2: outline_px, y2: 30.0 })),
            width_px: 30.0,
            photo_size: None,
            photo_middle: None,
        };
        let cutout = RgbImage::new(side, side);
        let mut budget = CutoutBudget::default();
        for _ in 0..8 {
            budget.take(&cutout, &marks(80.0)).unwrap();
        }
        assert!(matches!(budget.take(&cutout, &marks(80.0)), Err(GraspError::MarksFarApart)));
        // Around a large outline, the cut-out is reduced before it is searched.
        let mut budget = CutoutBudget::default();
        for _ in 0..93 {
            budget.take(&cutout, &marks(1400.0)).unwrap();
        }
        // 94 of 1500 × 1500 pixels are more than the 210 megapixels of one picture.
        assert!(matches!(budget.take(&cutout, &marks(1400.0)), Err(GraspError::PartsTooLarge { most: 210 })));
    }
}
