//! The possible sizes of a part in a picture of an uncalibrated camera.
//!
//! A photo and a picture may have different numbers of pixels because one was resized or cropped. The files do not
//! record which of the two happened, so both hypotheses are tried: **same pixels**, a part covers as many pixels as in
//! its photo, and **same frame**, it covers the same fraction of the picture. Around each hypothesis, sizes vary within
//! the model's tolerance.

use std::ops::RangeInclusive;

use sdg_geometry::{Angle, PlanarSimilarity};

/// A range of sizes that is searched at once, in pixels of the picture per pixel of the demonstration's photo.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SizeRange {
    pub(crate) scales: RangeInclusive<f64>,
    /// The hypotheses in the range, one or both.
    nominal: Vec<f64>,
}

/// Hypotheses whose ln differ by less count as one. Chosen by hand, not measured.
const SAME_LOG: f64 = 0.03;
/// Overlapping ranges are searched together if the largest size is at most this many times the smallest, because one
/// template has its edges at one resolution. Drillscrews taught at three quarters of the pixels were found in one of
/// nine cases with a value of 3, and in seven with 1.9. Chosen by hand.
const MAX_RATIO: f64 = 1.9;

impl SizeRange {
    /// The ranges to search, merged where one search covers two overlapping ranges; `photo` and `picture` are width and
    /// height.
    pub(crate) fn all(photo: Option<[u32; 2]>, picture: [u32; 2], tolerance: &RangeInclusive<f64>) -> Vec<Self> {
        let shorter = |[width, height]: [u32; 2]| f64::from(width.min(height));
        let same_frame = photo.map_or(1.0, |photo| shorter(picture) / shorter(photo));
        let about = |nominal: f64| nominal * tolerance.start()..=nominal * tolerance.end();
        let same_pixels = Self { scales: about(1.0), nominal: vec![1.0] };
        if same_frame.ln().abs() < SAME_LOG {
            return vec![same_pixels];
        }
        let low = tolerance.start() * same_frame.min(1.0);
        let high = tolerance.end() * same_frame.max(1.0);
        let overlap = same_frame.ln().abs() < (tolerance.end() / tolerance.start()).ln();
        if overlap && high / low <= MAX_RATIO {
            return vec![Self { scales: low..=high, nominal: vec![1.0, same_frame] }];
        }
        vec![same_pixels, Self { scales: about(same_frame), nominal: vec![same_frame] }]
    }

    /// The range that contains a scale or is nearest to it.
    pub(crate) fn nearest(ranges: &[Self], scale: f64) -> Option<&Self> {
        ranges.iter().min_by(|a, b| a.distance(scale).total_cmp(&b.distance(scale)))
    }

    /// The geometric mean of the range.
    pub(crate) fn middle(&self) -> f64 {
        (self.scales.start() * self.scales.end()).sqrt()
    }

    /// ln of a size over the nearest hypothesis.
    pub(crate) fn log_size(&self, scale: f64) -> f64 {
        self.nominal
            .iter()
            .map(|nominal| (scale / nominal).ln())
            .min_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or_else(|| scale.ln())
    }

    /// Distance of a scale from the range, as a difference of ln; 0 inside.
    pub(crate) fn distance(&self, scale: f64) -> f64 {
        (self.scales.start() / scale).ln().max((scale / self.scales.end()).ln()).max(0.0)
    }

    pub(crate) fn clamp(&self, scale: f64) -> f64 {
        scale.clamp(*self.scales.start(), *self.scales.end())
    }
}

/// Scales about the upper left corner.
pub(crate) fn scaling(factor: f64) -> PlanarSimilarity {
    PlanarSimilarity { scale: factor, angle: Angle::ZERO, tx: 0.0, ty: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "teach")]
    use crate::{detection::GraspDetection, drawn_part, model::Verification};

    const TOLERANCE: RangeInclusive<f64> = 0.75..=1.35;

    #[test]
    fn a_picture_like_the_photo_is_searched_once_about_its_size() {
        for photo in [None, Some([640, 480]), Some([480, 640])] {
            let ranges = SizeRange::all(photo, [640, 480], &TOLERANCE);
            assert_eq!(ranges, [SizeRange { scales: 0.75..=1.35, nominal: vec![1.0] }]);
        }
    }

    #[test]
    fn another_number_of_pixels_is_another_size_or_another_crop() {
        // 1.05 times the pixels per side: from 0.75 to 1.05 · 1.35 in one search.
        let [range] = &SizeRange::all(Some([640, 480]), [672, 504], &TOLERANCE)[..] else { panic!("one range") };
        assert!((range.scales.start() - 0.75).abs() < 1e-12 && (range.scales.end() - 1.4175).abs() < 1e-12);
        assert!(range.log_size(1.0) == 0.0 && range.log_size(1.05) == 0.0);
        assert!((range.log_size(1.155) - 1.1f64.ln()).abs() < 1e-12);

        // 1.5 times the pixels per side, and a third: too far for one search.
        assert_eq!(SizeRange::all(Some([640, 480]), [960, 720], &TOLERANCE).len(), 2);
        let [pixels, frame] = &SizeRange::all(Some([960, 720]), [320, 240], &TOLERANCE)[..] else {
            panic!("two ranges")
        };
        assert_eq!(pixels.scales, TOLERANCE);
        assert!(
            (frame.scales.start() - 0.25).abs() < 1e-12 && (frame.middle() - (0.25f64 * 0.45).sqrt()).abs() < 1e-12
        );
        assert!(frame.distance(0.3) == 0.0 && (frame.distance(0.5) - (0.5f64 / 0.45).ln()).abs() < 1e-12);
        assert!((frame.clamp(0.9) - 0.45).abs() < 1e-12);
    }

    /// The log-odds of the sizes of two drawn parts in a picture of this width and height; `scales` are their sizes
    /// relative to the photo of 320 × 240 pixels.
    #[cfg(feature = "teach")]
    fn size_terms(tolerance: RangeInclusive<f64>, picture: [u32; 2], scales: [f64; 2]) -> [f64; 2] {
        let model = drawn_part::model([320, 240]).with_size_tolerance(tolerance).unwrap();
        let [width, height] = picture.map(f64::from);
        let places = [(0.25 * width, 0.35 * height, 20.0), (0.7 * width, 0.6 * height, 140.0)];
        let [one, other] = [0, 1].map(|k| {
            let (x, y, angle_deg) = places[k];
            let scaled = scaling(scales[k]);
            scaled.compose(&drawn_part::at(x / scales[k], y / scales[k], angle_deg))
        });
        let seen = drawn_part::picture(picture, &[one, other]);
        let found = model.detect(&seen, Verification::ByShape).unwrap();
        [one, other].map(|pose| {
            let center = drawn_part::line().transformed(&pose).center();
            let at_it = found.iter().find(|detection| (detection.grasp.center() - center).norm() < 2.0);
            at_it.unwrap_or_else(|| panic!("{center}: {found:?}")).evidence.unwrap().size
        })
    }

    #[cfg(feature = "teach")]
    #[test]
    fn the_middle_of_a_picture_shows_parts_of_that_picture_s_size() {
        let model = drawn_part::model([320, 240]);
        // Of a picture with twice the photo's pixels per side.
        let pose = scaling(2.0).compose(&drawn_part::at(80.0, 60.0, 20.0));
        let middle = drawn_part::picture([320, 240], &[pose]);
        let center = drawn_part::line().transformed(&pose).center();
        let is_there = |found: Vec<GraspDetection>| {
            found.iter().any(|found| found.is_accepted() && (found.grasp.center() - center).norm() < 2.0)
        };
        assert!(is_there(model.detect_in_middle(&middle, [640, 480], Verification::ByShape).unwrap()));
        assert!(!is_there(model.detect(&middle, Verification::ByShape).unwrap()));
        // A grasp point 2 px inside the middle, and one 1 px beside it.
        for (x, num_accepted) in [(22.0, 1), (19.0, 0)] {
            let middle = drawn_part::picture([320, 240], &[drawn_part::at(x, 100.0, 0.0)]);
            let found = model.detect_in_middle(&middle, [336, 252], Verification::ByShape).unwrap();
            assert_eq!(found.iter().filter(|found| found.is_accepted()).count(), num_accepted, "{x}: {found:?}");
        }
    }

    #[cfg(feature = "teach")]
    #[test]
    fn the_widest_tolerance_is_searched_at_every_nominal_size() {
        let model = drawn_part::model([320, 240]).with_size_tolerance(0.5..=2.0).unwrap();
        // Nearly twice the photo's pixels per side: the cut-out is not resized for the picture halved once.
        let pose = scaling(2.5).compose(&drawn_part::at(127.0, 95.0, 20.0));
        let found = model.detect(&drawn_part::picture([636, 477], &[pose]), Verification::ByShape).unwrap();
        let center = drawn_part::line().transformed(&pose).center();
        let is_part = |found: &GraspDetection| found.is_accepted() && (found.grasp.center() - center).norm() < 3.0;
        assert!(found.iter().any(is_part), "{center}: {found:?}");
    }

    #[cfg(feature = "teach")]
    #[test]
    fn parts_of_one_picture_have_one_size_in_pixels() {
        // A picture of five sixths of the photo's pixels per side, searched once for both nominal sizes. The two sizes
        // differ by 4 % and are next to different nominal sizes.
        let middle = (200.0f64 / 240.0).sqrt();
        let terms = size_terms(0.8..=1.2, [267, 200], [0.98 * middle, 1.02 * middle]);
        assert!(terms.iter().all(|term| *term > -0.8), "{terms:?}");
        // Twice the pixels per side, searched separately for each nominal size: of two parts with different nominal
        // sizes, one has another size than the best.
        let terms = size_terms(TOLERANCE, [640, 480], [1.0, 2.0]);
        assert!(terms.contains(&0.0) && terms.iter().any(|term| *term < -2.8), "{terms:?}");
    }
}
