//! A demonstration prepared for pictures in which the part has a roughly known size.
//!
//! ```text
//! cut-out ─ resized ─────────────┐
//!                                ├─ the part has the same size in both, as small as possible
//! picture ─ halved some times ───┘
//! ```
//! In a telephone's photo, a part can be a thousand pixels long. At a quarter of the resolution, its pose is as
//! accurate as at the full one, and the search takes a sixteenth of the time.

use std::sync::{Arc, Mutex};

use image::RgbImage;
use image::imageops::{self, FilterType};
use sdg_shape::{SearchConfig, ShapeSearch};

use crate::error::Result;
use crate::marks_shift::MarksShift;
use crate::round_top::RoundTop;
use crate::sizes::SizeRange;
use crate::taught_marks::TaughtMarks;

/// Maximum extent of a part at the working resolution, in pixels. Chosen to save time: the resulting error is at most a
/// fraction of a pixel.
const MAX_EXTENT_PX: f64 = 256.0;
/// Largest enlargement of a cut-out; a picture that would need more is halved instead. Chosen by hand, not measured.
const MAX_ENLARGEMENT: f64 = 1.19;
/// A cut-out is not resized if its size would change by less than this ratio. Chosen by hand, not measured.
const SAME_SIZE: f64 = 0.02;
/// Maximum number of cached sizes; a stream of pictures has one or two.
const MAX_KEPT: usize = 4;

/// The resizing that gives picture and cut-out the same scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WorkingSize {
    /// Number of times the picture is halved.
    pub(crate) halvings: u32,
    /// Resizing factor of the cut-out.
    pub(crate) cutout_scale: f64,
}

impl WorkingSize {
    /// The resizing for a part of `extent_px` in its cut-out that is `scale` times as large in the picture.
    pub(crate) fn new(extent_px: f64, scale: f64) -> Self {
        let mut halvings = 0;
        let in_picture = |halvings: u32| scale / f64::from(1u32 << halvings);
        while halvings < 16
            && (in_picture(halvings) * extent_px > MAX_EXTENT_PX || in_picture(halvings) > MAX_ENLARGEMENT)
        {
            halvings += 1;
        }
        let cutout_scale = in_picture(halvings);
        let is_same = (cutout_scale - 1.0).abs() < SAME_SIZE;
        Self { halvings, cutout_scale: if is_same { 1.0 } else { cutout_scale } }
    }

    /// Picture pixels per pixel of the halved picture.
    pub(crate) fn shrink(&self) -> f64 {
        f64::from(1u32 << self.halvings)
    }
}

/// A demonstration at one size.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) search: ShapeSearch,
    /// The position of the marks; `None` if there are too few edges around them, and for a part of revolution.
    pub(crate) marks_shift: Option<MarksShift>,
    /// The position of the marks of a part of revolution; `None` for other parts.
    pub(crate) round_top: Option<RoundTop>,
}

impl Prepared {
    fn new(cutout: &RgbImage, marks: &TaughtMarks, cutout_scale: f64, config: &SearchConfig) -> Result<Self> {
        let resized;
        let (cutout, marks) = if cutout_scale == 1.0 {
            (cutout, marks.clone())
        } else {
            let [width, height] =
                [cutout.width(), cutout.height()].map(|side| ((f64::from(side) * cutout_scale).round() as u32).max(1));
            resized = imageops::resize(cutout, width, height, FilterType::Triangle);
            (&resized, marks.resized(cutout_scale))
        };
        let search = ShapeSearch::new(cutout, &marks.region(), config)?;
        let round_top = search.revolution().map(|revolution| RoundTop::new(revolution, &marks));
        let marks_shift = if round_top.is_some() { None } else { MarksShift::new(cutout, &marks, &config.shape) };
        Ok(Self { search, marks_shift, round_top })
    }
}

/// The most recently prepared sizes of one demonstration. Each takes milliseconds to prepare, with the same result each
/// time.
#[derive(Debug, Clone, Default)]
pub(crate) struct PreparedSizes {
    kept: Arc<Mutex<Vec<Kept>>>,
}

#[derive(Debug, Clone)]
struct Kept {
    key: PreparedKey,
    prepared: Arc<Prepared>,
}

#[derive(Debug, Clone, PartialEq)]
struct PreparedKey {
    cutout_scale: f64,
    /// The range of sizes, relative to the working size.
    scales: std::ops::RangeInclusive<f64>,
}

impl PreparedSizes {
    /// The demonstration for sizes in `range`, for pictures resized by `working`.
    ///
    /// # Errors
    /// A part without a shape to compare at that size.
    pub(crate) fn get(
        &self,
        cutout: &RgbImage,
        marks: &TaughtMarks,
        working: &WorkingSize,
        range: &SizeRange,
        config: &SearchConfig,
    ) -> Result<Arc<Prepared>> {
        // The scale of the resized cut-out in the halved picture. A cut-out that is not resized although its size differs
        // slightly, and rounding, may move an end of the range just beyond the bounds.
        let (least, largest) = SearchConfig::SCALE_BOUNDS;
        let over_working = |scale: &f64| (scale / working.shrink() / working.cutout_scale).clamp(least, largest);
        let scales = over_working(range.scales.start())..=over_working(range.scales.end());
        let key = PreparedKey { cutout_scale: working.cutout_scale, scales };
        let locked = || self.kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(kept) = locked().iter().find(|kept| kept.key == key) {
            return Ok(kept.prepared.clone());
        }
        let mut config = config.clone();
        config.scales = key.scales.clone();
        let made = Arc::new(Prepared::new(cutout, marks, working.cutout_scale, &config)?);
        let mut kept = locked();
        if kept.len() == MAX_KEPT {
            kept.remove(0);
        }
        kept.push(Kept { key, prepared: made.clone() });
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_parts_are_halved_and_small_ones_stay() {
        let size = |extent_px: f64, scale: f64| WorkingSize::new(extent_px, scale);
        assert_eq!(size(120.0, 1.0), WorkingSize { halvings: 0, cutout_scale: 1.0 });
        assert_eq!(size(120.0, 1.01), WorkingSize { halvings: 0, cutout_scale: 1.0 });
        // 1000 px in the photo and in the picture: 250 px after two halvings, below the maximum of 256 px.
        assert_eq!(size(1000.0, 1.0), WorkingSize { halvings: 2, cutout_scale: 0.25 });
        // 60 px in the photo, 180 in the picture: 90 px in a picture halved once would require an enlarged cut-out.
        assert_eq!(size(60.0, 3.0), WorkingSize { halvings: 2, cutout_scale: 0.75 });
        assert_eq!(size(300.0, 0.5), WorkingSize { halvings: 0, cutout_scale: 0.5 });
    }
}
