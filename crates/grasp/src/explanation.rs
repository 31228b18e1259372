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

    /// The demonstration to which the detection's outline belongs, and the position of its cut-out in the image.
    fn pose_of(&self, detection: &GraspDetection) -> Option<(usize, PlanarSimilarity)> {
        let seen = &detection.outline.as_ref()?.vertices;
        self.demonstrations.iter().enumerate().find_map(|(idx, demonstration)| {
            let taught = demonstration.outline(&PlanarSimilarity::IDENTITY).vertices;
            if taught.len() != seen.len() {
                return None;
            }
            let pose = PlanarSimilarity::fit(&taught, seen)?;
            let is_near = taught.iter().zip(seen).all(|(from, to)| (pose.apply(from) - to).norm() <= MAX_OFF_PX);
            is_near.then_some((idx, pose))
        })
    }
}
