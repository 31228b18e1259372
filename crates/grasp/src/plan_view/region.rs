//! A region of the picture in the plan view.

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanView, PosedCamera};

use crate::error::Result;
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
        match bounds.filter(|bounds| bounds.area() > 0.0) {
            Some(bounds) => Ok(Self { region: *region, bounds }),
            None => Err(RegionError::OffTable { region: *region }.into()),
        }
    }

    /// The window that is cut out of a plan view of size `view_size`.
    ///
    /// # Errors
    /// A region that is too small for the part.
    pub(super) fn window(&self, view_size: [u32; 2], demonstrations: &[TaughtDemonstration]) -> Result<SearchWindow> {
        SearchWindow::about(&self.bounds, &self.region, view_size, demonstrations)
    }
}
