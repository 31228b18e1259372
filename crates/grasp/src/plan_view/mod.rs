//! Teaching and detection with a calibrated camera, in the plan view of the marks' plane; grasps in metres.
//!
//! ```text
//! photo ─ plan view of the marks' plane ─ Demonstration in it ─ teach ─ model with Lengths
//! picture ─ plan view of the same scale ─────── detect, the size known ─┬─ back into the picture's pixels ─ GraspDetection
//!                                                                       └─ PlanarPose in metres
//! ```
//! In the plan view, the image of the plane is independent of the camera's lens, slant, height and resolution, so that
//! a model taught with one camera works with any other.

mod demonstration;
mod region;
mod uncertainty;

use std::ops::RangeInclusive;

use burn::tensor::read_sync;
use image::RgbImage;
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};
use sdg_geometry::{Angle, BoundingBox, PlanView, PlanarGrasp, Polygon, PosedCamera, Workspace};
use sdg_shape::{PixelRect, PlanViewMap};

pub use self::demonstration::{check_region_from_above, pictures_from_above, seen_from_above};
use self::region::RegionInPlanView;
pub use self::uncertainty::{Circumstances, ErrorLength, Uncertainty};
use crate::detection::{Found, GraspDetection};
use crate::error::{GraspError, Result};
use crate::lengths::Lengths;
use crate::model::{GraspModel, Verification};
use crate::region::SearchRegion;
use crate::search_window::SearchWindow;

/// A table and a camera above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraOverTable {
    /// The camera; its world's z points up.
    pub camera: PosedCamera,
    /// The table's z.
    pub table_height_m: f64,
    /// The area in which parts may lie; `None` for everything in the camera's view.
    pub workspace: Option<Workspace>,
}

/// The grasp pose, in the camera's world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarPose {
    /// The gripper's centre point, in metres.
    pub position_m: Point3<f64>,
    /// Angle about z, right-handed, of the direction from the first marked point to the second.
    pub yaw: Angle,
    /// The part's width between the jaws, in metres.
    pub opening_m: f64,
    /// Uncertainty of position and yaw.
    pub uncertainty: Uncertainty,
    /// The conditions from which the uncertainty was computed.
    pub circumstances: Circumstances,
}

impl PlanarPose {
    /// The gripper's pose: x along the marked line, y along the closing direction of the jaws, z down to the table.
    pub fn frame_from_tcp(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw.radians());
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts(self.position_m.into(), turn * down)
    }
}

/// A grasp in the picture's pixels and in metres.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanViewDetection {
    /// The detection in pixels of the given picture.
    pub detection: GraspDetection,
    /// The grasp pose in the camera's world.
    pub pose: PlanarPose,
}

/// Maximum number of pixels of a plan view's visible area, above which a search becomes slow. Chosen by hand.
const MAX_PLAN_PIXELS: u64 = 6_000_000;

/// A model used with a calibrated camera.
#[derive(Debug, Clone)]
pub struct PlanViewDetector {
    model: GraspModel,
    over_table: CameraOverTable,
    lengths: Lengths,
    view: PlanView,
    map: PlanViewMap,
    region: Option<RegionInPlanView>,
    /// The range of sizes relative to the part's size, if parts may lie at a height other than the table's.
    sizes: Option<RangeInclusive<f64>>,
}

impl PlanViewDetector {
    /// Prepares all data that are the same in every picture of the camera.
    ///
    /// # Errors
    /// A model without lengths; a camera whose pictures do not show the plane, or not the region.
    pub fn new(model: GraspModel, over_table: &CameraOverTable) -> Result<Self> {
        let lengths = model.facts().lengths.clone().ok_or(GraspError::NoLengths)?;
        let view = plan_view(over_table, &lengths)?;
        let map = PlanViewMap::new(&over_table.camera, &view);
        let region =
            model.region().map(|region| RegionInPlanView::new(region, &over_table.camera, &view)).transpose()?;
        // The model gets plan views, whose pixels are not those of the region.
        let model = model.with_region(None)?.of_known_size()?;
        Ok(Self { model, over_table: *over_table, lengths, view, map, region, sizes: None })
    }

    /// Searches the plan view for parts of these sizes relative to the part's size, because a higher part appears
    /// larger. No size within the range then speaks against a part. With `None`, parts lie on the table, and a
    /// different size means another part.
    ///
    /// # Errors
    /// An invalid range, as for [`GraspModel::with_size_tolerance`].
    pub fn set_sizes(&mut self, sizes: Option<RangeInclusive<f64>>) -> Result<()> {
        if self.sizes == sizes {
            return Ok(());
        }
        let model = self.model.clone();
        self.model = match &sizes {
            Some(range) => model.with_check(|check| {
                check.search.scales = range.clone();
                check.score = check.score.of_any_height();
            })?,
            None => model.of_known_size()?,
        };
        self.sizes = sizes;
        Ok(())
    }

    /// Continues with another camera, or with the same camera at another pose.
    ///
    /// # Errors
    /// A camera whose pictures do not show the plane, or not the searched region; the detector is then unchanged.
    pub fn move_to(&mut self, over_table: &CameraOverTable) -> Result<()> {
        let view = plan_view(over_table, &self.lengths)?;
        let region =
            self.region().map(|region| RegionInPlanView::new(region, &over_table.camera, &view)).transpose()?;
        (self.view, self.region) = (view, region);
        self.map = PlanViewMap::new(&over_table.camera, &self.view);
        self.over_table = *over_table;
        Ok(())
    }

    /// Searches only this region of pictures, in their pixels; `None` for whole pictures.
    ///
    /// # Errors
    /// A region that extends beyond the camera's pictures or belongs to pictures of another size, that does not show
    /// the plane, or that is too small for the part; the detector is then unchanged.
    pub fn look_in(&mut self, region: Option<&SearchRegion>) -> Result<()> {
        let region =
            region.map(|region| RegionInPlanView::new(region, &self.over_table.camera, &self.view)).transpose()?;
        if let Some(region) = &region {
            region.window([self.view.width, self.view.height], self.model.demonstrations())?;
        }
        self.region = region;
        Ok(())
    }

    /// The searched region of pictures, in their pixels; `None` for whole pictures.
    pub fn region(&self) -> Option<&SearchRegion> {
        self.region.as_ref().map(|region| &region.region)
    }

    /// The model, for plan views of known size.
    pub fn model(&self) -> &GraspModel {
        &self.model
    }

    /// A picture of the camera in the model's plan view.
    pub fn plan_view_of(&self, picture: &RgbImage) -> RgbImage {
        self.map.resample(picture)
    }

    /// The size of a pixel of the picture in the plane of the marks, in metres; `None` if the pixel does not show the
    /// plane.
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>) -> Option<f64> {
        self.over_table.camera.metres_per_pixel(pixel, self.view.height_m)
    }

    /// Finds the part in a picture of the camera, best score first, as [`GraspModel::detect`] does.
    ///
    /// # Errors
    /// As for [`GraspModel::detect`].
    pub fn detect(&self, picture: &RgbImage, verification: Verification) -> Result<Vec<PlanViewDetection>> {
        let found = self.find(picture, verification)?;
        Ok(found.into_iter().filter_map(|found| self.placed(found.detection)).collect())
    }

    /// Detections in a picture, in pixels of the plan view.
    pub(crate) fn find(&self, picture: &RgbImage, verification: Verification) -> Result<Vec<Found>> {
        if let Some(region) = self.region() {
            region.check(picture.dimensions().into())?;
        }
        let window = self.search_window()?;
        self.find_in(&self.window_of(picture, &window.rect), &window, verification)
    }

    /// Detections in the plan view of a whole picture, in its pixels.
    #[cfg(feature = "teach")]
    pub(crate) fn find_in_view(&self, view: &RgbImage) -> Result<Vec<Found>> {
        let window = self.search_window()?;
        self.find_in(&window.cut(view), &window, Verification::ByShape)
    }

    /// The searched window of the plan view.
    fn search_window(&self) -> Result<SearchWindow> {
        let size = self.view_size();
        match &self.region {
            None => Ok(SearchWindow::whole(size)),
            Some(region) => region.window(size, self.model.demonstrations()),
        }
    }

    /// Detections in a window of the plan view, in pixels of the whole plan view.
    fn find_in(&self, image: &RgbImage, window: &SearchWindow, verification: Verification) -> Result<Vec<Found>> {
        let counts = |detection: &GraspDetection| {
            let placed = self.placed(detection.clone());
            placed.is_some_and(|placed| placed.detection.lies_within(self.region(), self.picture_size()))
        };
        read_sync(self.model.find_in(image, window, verification, counts))
    }

    /// Width and height of the camera's pictures.
    pub(crate) fn picture_size(&self) -> [u32; 2] {
        let intrinsics = self.over_table.camera.intrinsics;
        [intrinsics.width, intrinsics.height]
    }

    /// Width and height of the plan view.
    pub(crate) fn view_size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// A rectangle of the plan view of a picture.
    pub(crate) fn window_of(&self, picture: &RgbImage, window: &PixelRect) -> RgbImage {
        self.map.resample_window(picture, window)
    }

    /// The detection in the picture, with its pose in metres; `None` if it is outside the picture.
    pub(crate) fn placed(&self, mut detection: GraspDetection) -> Option<PlanViewDetection> {
        let changed_slant = self.changed_slant(&detection)?;
        // Only poses by edges are displaced; the outline remains at the edges.
        if let (Some(edges), Some(_)) = (self.lengths.edges, detection.agreement) {
            let displaced = changed_slant * (edges.height_m * self.view.pixels_per_m);
            (detection.grasp.x, detection.grasp.y) = (detection.grasp.x - displaced.x, detection.grasp.y - displaced.y);
            detection.keypoints.iter_mut().for_each(|(point, _)| *point -= displaced);
        }
        let grasp = detection.grasp;
        let center = grasp.center();
        let seen = self.view.in_picture(&self.over_table.camera, &center)?;
        let above = self.over_table.table_height_m + self.lengths.grasp_height_m;
        let on_plane = self.view.point(&center);
        let circumstances = self.circumstances(&detection, changed_slant, &seen)?;
        let pose = PlanarPose {
            position_m: Point3::new(on_plane.x, on_plane.y, above),
            // The plan view's y is opposite to the world's.
            yaw: Angle::from_radians(-grasp.angle.radians()),
            opening_m: grasp.width / self.view.pixels_per_m,
            uncertainty: circumstances.uncertainty(),
            circumstances,
        };
        Some(PlanViewDetection { detection: self.in_picture(detection)?, pose })
    }

    /// The slant at a detection in the plan view minus that of the demonstration's photo, which is rotated with the
    /// part; see [`slant`].
    fn changed_slant(&self, detection: &GraspDetection) -> Option<Vector2<f64>> {
        let GraspDetection { demonstration_idx, grasp, .. } = detection;
        let here = slant(&self.over_table.camera, &self.view.point(&grasp.center()));
        let taught = self.model.demonstrations().get(*demonstration_idx)?.marks.grasp.angle();
        Some(self.lengths.changed_slant(here, *demonstration_idx, grasp.angle - taught))
    }

    /// The conditions that determine the errors of a detection in the plan view, whose grasp is at `seen` in the
    /// picture.
    fn circumstances(
        &self,
        detection: &GraspDetection,
        changed_slant: Vector2<f64>,
        seen: &Point2<f64>,
    ) -> Option<Circumstances> {
        let BoundingBox { x1, y1, x2, y2 } = detection.bbox;
        Some(Circumstances {
            pixel_m: self.over_table.camera.metres_per_pixel(seen, self.view.height_m)?,
            slant: changed_slant.norm(),
            mark_height_m: self.lengths.mark_height_m,
            edge_sigma_m: self.lengths.edges.map(|edges| edges.sigma_m),
            diagonal_m: (x2 - x1).hypot(y2 - y1) / self.view.pixels_per_m,
            agreement: detection.agreement.unwrap_or(0.0),
        })
    }

    /// The position in the picture of a point of the plan view, also beyond the picture's border.
    pub fn shown(&self, point: &Point2<f64>) -> Option<Point2<f64>> {
        self.over_table.camera.project(&self.view.point(point))
    }

    /// The detection in pixels of the picture.
    fn in_picture(&self, detection: GraspDetection) -> Option<GraspDetection> {
        let shown = |point: &Point2<f64>| self.shown(point);
        let outline = match &detection.outline {
            Some(outline) => {
                Some(Polygon { vertices: outline.vertices.iter().map(shown).collect::<Option<Vec<_>>>()? })
            }
            None => None,
        };
        let corners = detection.bbox.corners().iter().map(shown).collect::<Option<Vec<_>>>()?;
        let bbox = outline.as_ref().map_or_else(|| BoundingBox::around(corners), |outline| Some(outline.bounds()))?;
        let keypoints = detection.keypoints.iter().map(|(point, score)| Some((shown(point)?, *score)));
        let picture = self.picture_size().map(f64::from);
        Some(GraspDetection {
            bbox: bbox.clip(picture[0], picture[1]),
            keypoints: keypoints.collect::<Option<Vec<_>>>()?,
            outline,
            grasp: self.grasp_in_picture(&detection.grasp)?,
            ..detection
        })
    }

    fn grasp_in_picture(&self, grasp: &PlanarGrasp) -> Option<PlanarGrasp> {
        let (sin, cos) = grasp.angle.radians().sin_cos();
        let center = self.shown(&grasp.center())?;
        let along = self.shown(&(grasp.center() + Vector2::new(cos, sin)))? - center;
        let [one, other] = grasp.jaws();
        Some(PlanarGrasp {
            x: center.x,
            y: center.y,
            angle: Angle::from_radians(along.y.atan2(along.x)),
            width: (self.shown(&one)? - self.shown(&other)?).norm(),
        })
    }
}

/// The tangent of the angle between a line of sight and the vertical, in the directions x and y of the plan view: the
/// apparent displacement, in metres, of a point one metre above the plane.
pub(crate) fn slant(camera: &PosedCamera, point: &Point3<f64>) -> [f64; 2] {
    let sight = point.coords - camera.world_from_camera.translation.vector;
    [sight.x / -sight.z, sight.y / sight.z]
}

/// The plan view of the visible area of the marks' plane, at the resolution of the model's demonstrations.
pub(crate) fn plan_view(over_table: &CameraOverTable, lengths: &Lengths) -> Result<PlanView> {
    let CameraOverTable { camera, table_height_m, workspace } = over_table;
    let height = table_height_m + lengths.mark_height_m;
    Ok(PlanView::of(camera, height, lengths.pixels_per_m, workspace.as_ref(), MAX_PLAN_PIXELS)?)
}
