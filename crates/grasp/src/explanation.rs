//! The explanation of a detection, mainly of a refused one: the size, and the places where picture and demonstration
//! differ.

use image::RgbImage;
use sdg_geometry::PlanarSimilarity;
use sdg_shape::Differences;

use crate::detection::GraspDetection;
use crate::model::GraspModel;
use crate::region::SearchRegion;
use crate::search_window::SearchWindow;
use crate::sizes::SizeRange;
use crate::verification::{SearchedImage, differences};

/// Tolerance in pixels between the corners of a detection's outline and of the demonstration's outline laid over it.
/// Both come from the same pose and differ only for a slanted camera.
const MAX_OFF_PX: f64 = 0.5;

impl GraspModel {
    /// The part's size in the picture relative to that in the photo, or to the nearest nominal size if picture and
    /// photo have different numbers of pixels. `None` without verification, and if a slanted camera distorts the
    /// outline.
    pub fn size_of(&self, detection: &GraspDetection, [width, height]: [u32; 2]) -> Option<f64> {
        let (demonstration_idx, pose) = self.pose_of(detection)?;
        let demonstration = &self.demonstrations[demonstration_idx];
        let tolerance = &demonstration.check().search.scales;
        let ranges = SizeRange::all(demonstration.marks.photo_size, [width, height], tolerance);
        Some(SizeRange::nearest(&ranges, pose.scale)?.log_size(pose.scale).exp())
    }

    /// The places where the picture differs from the demonstration, for each detection; `None` as for
    /// [`Self::size_of`].
    pub fn differences(&self, image: &RgbImage, detections: &[&GraspDetection]) -> Vec<Option<Differences>> {
        let poses: Vec<_> = detections.iter().map(|detection| self.pose_of(detection)).collect();
        if poses.iter().all(Option::is_none) {
            return vec![None; detections.len()];
        }
        let size = [image.width(), image.height()];
        let about = |region: &SearchRegion| {
            region.check(size).ok()?;
            SearchWindow::about(&region.bounds(), region, size, &self.demonstrations).ok()
        };
        let window = self.region().and_then(about).unwrap_or_else(|| SearchWindow::whole(size));
        let cut = window.cut(image);
        let searched = SearchedImage::of(&cut, &window.shot(), &self.demonstrations);
        let whole_from_window = window.whole_from_window();
        let at = |(idx, pose): (usize, PlanarSimilarity)| {
            let mut found = differences(&searched, idx, &whole_from_window.inverse().compose(&pose))?;
            let corners = found.features.iter_mut().flat_map(|square| &mut square.vertices);
            let points = found.edges.iter_mut().chain(&mut found.surface).chain(corners);
            points.for_each(|point| *point = whole_from_window.apply(point));
            Some(found)
        };
        poses.into_iter().map(|pose| pose.and_then(at)).collect()
    }

    /// The detection's demonstration, and the position of its cut-out in the image.
    fn pose_of(&self, detection: &GraspDetection) -> Option<(usize, PlanarSimilarity)> {
        let seen = &detection.outline.as_ref()?.vertices;
        let idx = detection.demonstration_idx;
        let taught = self.demonstrations.get(idx)?.outline(&PlanarSimilarity::IDENTITY).vertices;
        if taught.len() != seen.len() {
            return None;
        }
        let pose = PlanarSimilarity::fit(&taught, seen)?;
        let is_near = taught.iter().zip(seen).all(|(from, to)| (pose.apply(from) - to).norm() <= MAX_OFF_PX);
        is_near.then_some((idx, pose))
    }
}

#[cfg(all(test, feature = "teach"))]
mod tests {
    use super::*;
    use crate::drawn_part;
    use crate::model::Verification;
    use image::Rgb;
    use sdg_demonstration::Demonstration;

    #[test]
    fn a_picture_is_compared_with_the_photo_of_the_detection() {
        let plain = drawn_part::demonstration([320, 240]);
        // The other side of the part has the same outline, and stripes on its foot.
        let mut image = plain.image.clone();
        for left in [104, 112] {
            (86..102).for_each(|y| (left..left + 4).for_each(|x| image.put_pixel(x, y, Rgb([20, 20, 60]))));
        }
        let striped = Demonstration { image, annotation: plain.annotation.clone() };
        let picture = striped.image.clone();
        let model = drawn_part::taught(&[plain, striped]);
        let found = model.detect(&picture, Verification::ByShape).unwrap().swap_remove(0);
        assert_eq!(found.demonstration_idx, 1);
        let num_differences = |detection: &GraspDetection| {
            let Differences { edges, surface, features } =
                model.differences(&picture, &[detection]).swap_remove(0).unwrap();
            edges.len() + surface.len() + features.len()
        };
        let with_plain = GraspDetection { demonstration_idx: 0, ..found.clone() };
        let counts = [num_differences(&found), num_differences(&with_plain)];
        assert!(counts[0] < counts[1], "{counts:?}");
    }
}
