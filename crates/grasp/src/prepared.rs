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
use sdg_geometry::PlanarSimilarity;
use sdg_shape::{SearchConfig, ShapeSearch};

use crate::error::Result;
use crate::marks_shift::MarksShift;
use crate::round_top::RoundTop;
use crate::sizes::SizeRange;
use crate::taught_marks::{TaughtMarks, whole_size};

/// Maximum extent of a part at the working resolution, in pixels. Chosen to save time: the resulting error is at most a
/// fraction of a pixel.
pub(crate) const MAX_EXTENT_PX: f64 = 256.0;
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
    /// Resizing factor of the cut-out, before its sides are rounded to whole pixels.
    cutout_scale: f64,
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
    /// The similarity nearest to the resizing of the cut-out.
    pub(crate) working_from_cutout: PlanarSimilarity,
    /// The position of the marks; `None` if there are too few edges around them, and for a part of revolution.
    pub(crate) marks_shift: Option<MarksShift>,
    /// The position of the marks of a part of revolution; `None` for other parts.
    pub(crate) round_top: Option<RoundTop>,
}

impl Prepared {
    /// `cutout` and `marks` are resized.
    fn new(
        cutout: &RgbImage,
        marks: &TaughtMarks,
        working_from_cutout: PlanarSimilarity,
        config: &SearchConfig,
    ) -> Result<Self> {
        let search = ShapeSearch::new(cutout, &marks.region(), config)?;
        let round_top = search.revolution().map(|revolution| RoundTop::new(revolution, marks));
        let marks_shift = if round_top.is_some() { None } else { MarksShift::new(cutout, marks, &config.shape) };
        Ok(Self { search, working_from_cutout, marks_shift, round_top })
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
    /// Width and height of the resized cut-out.
    size: [u32; 2],
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
        let own = [cutout.width(), cutout.height()];
        let size = whole_size(own, working.cutout_scale);
        let resized_marks = marks.resized(own, size);
        let working_from_cutout =
            if size == own { PlanarSimilarity::IDENTITY } else { nearest_similarity(marks, &resized_marks) };
        // The scale of the resized cut-out in the halved picture. An end of the range may lie just beyond the bounds:
        // because of rounding, or because the cut-out is not resized although its size differs slightly.
        let (least, largest) = SearchConfig::SCALE_BOUNDS;
        let over_working = |scale: &f64| (scale / working.shrink() / working_from_cutout.scale).clamp(least, largest);
        let scales = over_working(range.scales.start())..=over_working(range.scales.end());
        let key = PreparedKey { size, scales };
        let locked = || self.kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(kept) = locked().iter().find(|kept| kept.key == key) {
            return Ok(kept.prepared.clone());
        }
        let mut config = config.clone();
        config.scales = key.scales.clone();
        let resized;
        let cutout = if size == own {
            cutout
        } else {
            resized = imageops::resize(cutout, size[0], size[1], FilterType::Triangle);
            &resized
        };
        let made = Arc::new(Prepared::new(cutout, &resized_marks, working_from_cutout, &config)?);
        let mut kept = locked();
        if kept.len() == MAX_KEPT {
            kept.remove(0);
        }
        kept.push(Kept { key, prepared: made.clone() });
        Ok(made)
    }
}

/// The similarity nearest to the resizing of a cut-out with these marks. Poses are similarities, but the two axes have
/// slightly different factors, because each side is rounded to whole pixels.
fn nearest_similarity(marks: &TaughtMarks, resized: &TaughtMarks) -> PlanarSimilarity {
    let [from, to] = [marks, resized].map(|marks| marks.region().vertices);
    // Only an outline without extent has none; it is refused as a part without a shape to compare.
    PlanarSimilarity::fit(&from, &to).unwrap_or(PlanarSimilarity::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use nalgebra::{Point2, Vector2};
    use sdg_geometry::{BoundingBox, GraspLine};

    #[test]
    fn marks_of_a_resized_cut_out_stay_on_their_pixels() {
        let dot = Point2::new(50.0, 30.0);
        let cutout = RgbImage::from_fn(61, 43, |x, y| {
            let away = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - dot;
            Rgb([(255.0 * (-away.norm_squared() / 18.0).exp()).round() as u8; 3])
        });
        let marks = TaughtMarks {
            label: "dot".to_owned(),
            bbox: BoundingBox { x1: 8.0, y1: 8.0, x2: 53.0, y2: 35.0 },
            grasp: GraspLine::new(dot, Point2::new(20.0, 20.0)),
            outline: None,
            width_px: 10.0,
            photo_size: None,
            photo_middle: None,
        };
        // 50.63 × 35.69 pixels, rounded.
        let size = whole_size([61, 43], 0.83);
        assert_eq!(size, [51, 36]);
        let resized = imageops::resize(&cutout, size[0], size[1], FilterType::Triangle);
        let (mut sum, mut weight) = (Vector2::<f64>::zeros(), 0.0);
        for (x, y, pixel) in resized.enumerate_pixels() {
            sum += f64::from(pixel[0]) * Vector2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            weight += f64::from(pixel[0]);
        }
        let seen = Point2::from(sum / weight);
        let resized_marks = marks.resized([61, 43], size);
        let by_pose = nearest_similarity(&marks, &resized_marks).apply(&dot);
        for mark in [resized_marks.grasp.start, by_pose] {
            assert!((mark - seen).norm() < 0.1, "{mark} instead of {seen}");
        }
    }

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
