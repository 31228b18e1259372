//! A horizontal plane at the height of the table or above it, seen vertically from above at a fixed scale.
//!
//! ```text
//! y of the world                     column 0
//!   ↑   ┌───────────────┐ ← top_m    ┌──────→ x
//!   │   │ the plane     │            │  plan view
//!   │   └───────────────┘            ↓
//!   └──────→ x  ↑ left_m             y
//! ```
//! The view from above is not mirrored: x of the view is x of the world, and y of the view points against y of the
//! world. An angle in the plan view, from x towards y, is therefore minus the same angle about the world's z.
//!
//! Only points of the plane are shown at their true position. Let the camera be at height `H` above the plane, and a
//! point at height `h` above the plane, at the horizontal distance `d` from the camera: the point is displaced outwards
//! by `d h / (H − h)`. With H = 0.58 m, d = 150 mm and h = 30 mm, this is 8 mm.

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

use super::posed::PosedCamera;
use crate::{Polygon, convex_hull};

/// A rectangle of the world in which parts may lie, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Workspace {
    /// Smallest and largest x.
    pub x_m: [f64; 2],
    /// Smallest and largest y.
    pub y_m: [f64; 2],
}

/// The position and the resolution of a plan view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlanView {
    /// The plane's z in the world, in metres.
    pub height_m: f64,
    /// Pixels per metre.
    pub pixels_per_m: f64,
    /// World x of the left border.
    pub left_m: f64,
    /// World y of the upper border.
    pub top_m: f64,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
}

/// The reason why a plan view cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanViewError {
    /// The camera does not look at the plane.
    #[error(
        "expected the camera to look down at the plane at z = {height_m} m; the middle of its picture does not show it"
    )]
    NotInView {
        /// The plane's z in the world, in metres.
        height_m: f64,
    },
    /// The picture shows nothing of the workspace.
    #[error("expected the picture to show some of the workspace x {:?} m, y {:?} m; it shows x {:?} m, y {:?} m",
        .workspace.x_m, .workspace.y_m, .seen.x_m, .seen.y_m)]
    OutsideWorkspace {
        /// The workspace that was given.
        workspace: Workspace,
        /// The part of the plane that the picture shows.
        seen: Workspace,
    },
    /// More pixels than allowed.
    #[error(
        "expected a plan view of at most {max} pixels, found {found}: take the photo from the look-out height or with fewer pixels, or give a smaller workspace"
    )]
    TooLarge {
        /// Pixels allowed.
        max: u64,
        /// Pixels of the visible area.
        found: u64,
    },
}

/// Number of intervals along each side of the picture in the grid of pixels that are mapped to the plane. With this
/// number, at most a percent of the visible plane is missing at each of its corners.
const GRID: u32 = 32;
/// Maximum length of a pixel on the plane, as a multiple of the smallest one. Towards the horizon, longer pixels show
/// too little to find parts. Chosen by hand.
const MAX_COARSENING: f64 = 4.0;
/// Maximum size of the view's rectangle, as a multiple of the maximum visible area, so that the memory is limited where
/// little of the rectangle is visible. The ratio is 2.2 for a picture of 16:9 rotated by 45°. Chosen by hand.
const MAX_RECTANGLE_RATIO: f64 = 4.0;

impl PlanView {
    /// The part of the plane at `height_m` that `camera` shows, within the workspace.
    ///
    /// # Errors
    /// The camera does not look at the plane or the workspace, or the visible area would have more than `max_pixels`.
    /// Unlike the view's rectangle, this area does not depend on the camera's rotation about the vertical.
    pub fn of(
        camera: &PosedCamera,
        height_m: f64,
        pixels_per_m: f64,
        workspace: Option<&Workspace>,
        max_pixels: u64,
    ) -> Result<Self, PlanViewError> {
        let seen = seen_of_plane(camera, height_m).ok_or(PlanViewError::NotInView { height_m })?;
        let bounds = Workspace::around(&seen);
        let shown = match workspace {
            None => bounds,
            Some(workspace) => bounds
                .intersection(workspace)
                .ok_or(PlanViewError::OutsideWorkspace { workspace: *workspace, seen: bounds })?,
        };
        // A rounding error must not add a pixel.
        let side = |[low, high]: [f64; 2]| ((high - low) * pixels_per_m - 1e-6).ceil().max(1.0);
        let [width, height] = [shown.x_m, shown.y_m].map(side);
        let rectangle = width * height;
        let [width, height] = [width, height].map(|side| side as u32);
        let view = Self { height_m, pixels_per_m, left_m: shown.x_m[0], top_m: shown.y_m[1], width, height };
        let found = view.visible_area(&seen).max(rectangle / MAX_RECTANGLE_RATIO) as u64;
        if found > max_pixels {
            return Err(PlanViewError::TooLarge { max: max_pixels, found });
        }
        Ok(view)
    }

    /// The area of the view in which these points of the plane and those between them lie, in square pixels.
    fn visible_area(&self, seen: &[Point3<f64>]) -> f64 {
        let hull = Polygon { vertices: convex_hull(seen.iter().map(|point| self.pixel(point))) };
        hull.clip(f64::from(self.width), f64::from(self.height)).area()
    }

    /// The point of the plane at a pixel.
    pub fn point(&self, pixel: &Point2<f64>) -> Point3<f64> {
        let [x, y] = [pixel.x, pixel.y].map(|k| k / self.pixels_per_m);
        Point3::new(self.left_m + x, self.top_m - y, self.height_m)
    }

    /// The pixel of a point of the plane. Other points are first projected vertically onto the plane.
    pub fn pixel(&self, point: &Point3<f64>) -> Point2<f64> {
        Point2::new(point.x - self.left_m, self.top_m - point.y) * self.pixels_per_m
    }

    /// Maps a pixel of the plan view to the camera's picture; `None` if the picture does not show that point.
    pub fn in_picture(&self, camera: &PosedCamera, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        let seen = camera.project(&self.point(pixel))?;
        let [width, height] = [camera.intrinsics.width, camera.intrinsics.height].map(f64::from);
        ((0.0..=width).contains(&seen.x) && (0.0..=height).contains(&seen.y)).then_some(seen)
    }

    /// Maps a pixel of the camera's picture to the plan view; `None` if the pixel does not show the plane.
    pub fn from_picture(&self, camera: &PosedCamera, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        Some(self.pixel(&camera.at_height(pixel, self.height_m)?))
    }
}

impl Workspace {
    /// The smallest rectangle with all points.
    fn around(points: &[Point3<f64>]) -> Self {
        let bounds = |coordinate: fn(&Point3<f64>) -> f64| {
            let values = || points.iter().map(coordinate);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        };
        Self { x_m: bounds(|point| point.x), y_m: bounds(|point| point.y) }
    }

    fn intersection(&self, other: &Self) -> Option<Self> {
        let both = |a: [f64; 2], b: [f64; 2]| {
            let [low, high] = [a[0].max(b[0]), a[1].min(b[1])];
            (low < high).then_some([low, high])
        };
        Some(Self { x_m: both(self.x_m, other.x_m)?, y_m: both(self.y_m, other.y_m)? })
    }
}

/// Points of the plane that the picture shows well, at least two.
fn seen_of_plane(camera: &PosedCamera, height_m: f64) -> Option<Vec<Point3<f64>>> {
    let [width, height] = [camera.intrinsics.width, camera.intrinsics.height].map(f64::from);
    camera.at_height(&Point2::new(0.5 * width, 0.5 * height), height_m)?;
    let places = (0..=GRID).flat_map(|row| (0..=GRID).map(move |column| [column, row]));
    let pixels = places.map(|place| {
        let [x, y] = place.map(|k| f64::from(k) / f64::from(GRID));
        Point2::new(x * width, y * height)
    });
    let seen: Vec<(Point3<f64>, f64)> = pixels
        .filter_map(|pixel| Some((camera.at_height(&pixel, height_m)?, camera.metres_per_pixel(&pixel, height_m)?)))
        .collect();
    let finest = seen.iter().map(|(_, length)| *length).fold(f64::INFINITY, f64::min);
    let well: Vec<_> =
        seen.into_iter().filter(|(_, length)| *length <= MAX_COARSENING * finest).map(|(point, _)| point).collect();
    (well.len() > 1).then_some(well)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PinholeCamera, PlumbBob};
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// 0.58 m above the origin, tilted about the picture's horizontal axis.
    fn camera(tilt_deg: f64) -> PosedCamera {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI + tilt_deg.to_radians());
        let lens = PlumbBob { k1: -0.2, k2: 0.05, p1: 0.001, p2: -0.0005, k3: 0.0 };
        PosedCamera {
            intrinsics: PinholeCamera { lens, ..PinholeCamera::WRIST },
            world_from_camera: Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.58).into(), turn),
        }
    }

    #[test]
    fn straight_down_it_is_the_picture_itself_without_the_lens() {
        let camera = PosedCamera { intrinsics: PinholeCamera::WRIST, ..camera(0.0) };
        let view = PlanView::of(&camera, 0.03, 1000.0, None, 1_000_000).unwrap();
        // 0.55 m away, 550 pixels of focal length: a pixel is a millimetre.
        assert_eq!((view.width, view.height), (640, 480));
        let pixel = Point2::new(100.25, 70.5);
        assert!((view.in_picture(&camera, &pixel).unwrap() - pixel).norm() < 1e-9);
        assert!((view.point(&pixel) - Point3::new(-0.21975, 0.1695, 0.03)).norm() < 1e-9);
    }

    #[test]
    fn a_point_above_the_plane_is_displaced_as_stated() {
        let camera = camera(0.0);
        let view = PlanView::of(&camera, 0.0, 1000.0, None, 10_000_000).unwrap();
        let seen = camera.project(&Point3::new(0.15, 0.0, 0.03)).unwrap();
        let shown = view.point(&view.from_picture(&camera, &seen).unwrap());
        assert!((shown.x - 0.15 - 0.15 * 0.03 / 0.55).abs() < 1e-9, "{shown}");
    }

    #[test]
    fn what_cannot_be_seen_is_refused() {
        let of = |tilt_deg: f64, workspace: Option<&Workspace>, max| {
            PlanView::of(&camera(tilt_deg), 0.0, 1000.0, workspace, max)
        };
        let away = of(120.0, None, u64::MAX).unwrap_err();
        assert!(matches!(away, PlanViewError::NotInView { .. }) && away.to_string().contains("at z = 0 m"), "{away}");
        assert!(matches!(of(0.0, None, 1000), Err(PlanViewError::TooLarge { max: 1000, .. })));
        let elsewhere = Workspace { x_m: [2.0, 3.0], y_m: [0.0, 1.0] };
        assert!(matches!(of(0.0, Some(&elsewhere), u64::MAX), Err(PlanViewError::OutsideWorkspace { .. })));
        let near = Workspace { x_m: [-0.1, 0.1], y_m: [-0.05, 3.0] };
        let view = of(0.0, Some(&near), u64::MAX).unwrap();
        assert!(view.width == 200 && view.left_m == -0.1 && view.top_m < 0.5, "{view:?}");
    }

    #[test]
    fn a_rotated_picture_may_have_as_many_pixels() {
        let intrinsics = PinholeCamera::symmetric(2048, 1536, 1800.0);
        for yaw_deg in [0.0_f64, 45.0] {
            let mut camera = PosedCamera { intrinsics, ..camera(0.0) };
            let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians());
            camera.world_from_camera.rotation = yaw * camera.world_from_camera.rotation;
            // 0.564 m away: a pixel of the view is a pixel of the picture. The rectangle has 6.4 million at 45°.
            let of = |max| PlanView::of(&camera, 0.016, 1800.0 / 0.564, None, max);
            assert!(of(6_000_000).is_ok(), "{yaw_deg}: {:?}", of(6_000_000));
            let refused = of(3_100_000);
            assert!(matches!(refused, Err(PlanViewError::TooLarge { found: 3_140_000..3_150_000, .. })), "{refused:?}");
        }
    }

    #[test]
    fn a_horizon_in_the_picture_bounds_the_view() {
        let view = PlanView::of(&camera(65.0), 0.0, 1000.0, None, u64::MAX).unwrap();
        assert!(view.width < 8000 && view.height < 8000, "{view:?}");
    }

    proptest! {
        #[test]
        fn to_the_plan_view_and_back(x in 20.0..620.0f64, y in 20.0..460.0f64, tilt in -25.0..25.0f64, height in 0.0..0.05f64) {
            let camera = camera(tilt);
            let view = PlanView::of(&camera, height, 900.0, None, u64::MAX).unwrap();
            let pixel = Point2::new(x, y);
            let shown = view.from_picture(&camera, &pixel).unwrap();
            prop_assert!((view.in_picture(&camera, &shown).unwrap() - pixel).norm() < 1e-5);
            let point = view.point(&shown);
            prop_assert!((point.z - height).abs() < 1e-12 && (view.pixel(&point) - shown).norm() < 1e-9);
        }
    }
}
