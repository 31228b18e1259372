//! A region of the picture in the plan view.

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanView, PosedCamera};

use crate::error::{GraspError, Result};
use crate::region::{RegionError, SearchRegion};
use crate::search_window::SearchWindow;
use crate::taught::TaughtDemonstration;

/// Each edge of the region is mapped at points that divide it into this many intervals, because a lens bends the edge.
const POINTS_A_SIDE: u32 = 16;

/// A region of the picture, and its bounding box in the plan view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RegionInPlanView {
    /// The region in pixels of the picture.
    pub(super) region: SearchRegion,
    /// The bounding box in pixels of the plan view.
    bounds: BoundingBox,
    /// Pixels of the picture per pixel of the plan view, in the middle of the bounds.
    picture_per_view: f64,
}

impl RegionInPlanView {
    /// Finds the bounds of a region of the pictures in the plan view.
    ///
    /// # Errors
    /// A region outside the camera's pictures, or one that shows nothing of the plan view.
    pub(super) fn new(region: &SearchRegion, camera: &PosedCamera, view: &PlanView) -> Result<Self> {
        region.check([camera.intrinsics.width, camera.intrinsics.height])?;
        let edges = region.bounds();
        let along = |low: f64, high: f64, k: u32| low + (high - low) * f64::from(k) / f64::from(POINTS_A_SIDE);
        let points = (0..=POINTS_A_SIDE).flat_map(|k| {
            let (x, y) = (along(edges.x1, edges.x2, k), along(edges.y1, edges.y2, k));
            [[x, edges.y1], [x, edges.y2], [edges.x1, y], [edges.x2, y]].map(Point2::from)
        });
        let seen = points.filter_map(|point| view.from_picture(camera, &point));
        let bounds = BoundingBox::around(seen).map(|bounds| bounds.clip(f64::from(view.width), f64::from(view.height)));
        let Some(bounds) = bounds.filter(|bounds| bounds.area() > 0.0) else {
            return Err(RegionError::OffTable { region: *region }.into());
        };
        let middle = camera.project(&view.point(&bounds.center()));
        let metres_per_pixel = middle.and_then(|middle| camera.metres_per_pixel(&middle, view.height_m));
        let picture_per_view = metres_per_pixel.map_or(1.0, |metres| 1.0 / (metres * view.pixels_per_m));
        Ok(Self { region: *region, bounds, picture_per_view })
    }

    /// The window that is cut out of a plan view of size `view_size`.
    ///
    /// # Errors
    /// A region that is too small for the part; the lengths are in pixels of the picture, like the region.
    pub(super) fn window(&self, view_size: [u32; 2], demonstrations: &[TaughtDemonstration]) -> Result<SearchWindow> {
        SearchWindow::about(&self.bounds, &self.region, view_size, demonstrations).map_err(|error| match error {
            GraspError::Region(RegionError::SmallerThanPart { region, length, across }) => {
                let [length, across] = [length, across].map(|in_view| in_view * self.picture_per_view);
                RegionError::SmallerThanPart { region, length, across }.into()
            }
            error => error,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taught_marks::TaughtMarks;
    use image::{Rgb, RgbImage};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
    use sdg_geometry::{GraspLine, PinholeCamera};

    /// A bar of 80 × 30 pixels.
    fn bar() -> TaughtDemonstration {
        let is_bar = |x: u32, y: u32| (20..100).contains(&x) && (20..50).contains(&y);
        let cutout = RgbImage::from_fn(120, 70, |x, y| Rgb([if is_bar(x, y) { 220 } else { 60 }; 3]));
        let marks = TaughtMarks {
            label: "bar".to_owned(),
            bbox: BoundingBox { x1: 20.0, y1: 20.0, x2: 100.0, y2: 50.0 },
            grasp: GraspLine::new(Point2::new(40.0, 35.0), Point2::new(80.0, 35.0)),
            outline: None,
            width_px: 30.0,
            photo_size: None,
            photo_middle: None,
        };
        TaughtDemonstration::from_parts(cutout, marks).unwrap()
    }

    #[test]
    fn a_region_that_is_too_small_is_compared_with_the_part_in_the_picture() {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let camera = PosedCamera {
            intrinsics: PinholeCamera::WRIST,
            world_from_camera: Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.55), down),
        };
        // 1000 pixels per metre in the picture, 2000 in the plan view.
        let view = PlanView::of(&camera, 0.0, 2000.0, None, 6_000_000).unwrap();
        let size = [view.width, view.height];
        let taught = [bar()];
        let region = RegionInPlanView::new(&SearchRegion::new([300, 200, 15, 10]), &camera, &view).unwrap();
        let lengths = |window: Result<SearchWindow>| match window.unwrap_err() {
            GraspError::Region(RegionError::SmallerThanPart { length, across, .. }) => [length, across],
            error => panic!("{error}"),
        };
        let in_picture = lengths(region.window(size, &taught));
        let in_view = lengths(SearchWindow::about(&region.bounds, &region.region, size, &taught));
        for (picture, view) in in_picture.iter().zip(in_view) {
            assert!((picture - 0.5 * view).abs() < 0.01 * view, "{picture} of {view}");
        }
    }
}
