//! A part in one picture: its line of sight and its apparent size.

use nalgebra::{Point2, Point3, Vector2};

use crate::grasp_target::GraspTarget;

/// A part in a picture, on the assumption that its marks lie in a given plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// The camera's centre, base frame, m.
    pub camera_m: Point3<f64>,
    /// The part's centre in the plane, base frame, m; z is the height of the plane.
    pub middle_m: Point3<f64>,
    /// Standard deviation of the centre along x and along y, m.
    pub place_sigma_m: f64,
    /// Ratio of the part's apparent size in the plane to its true size; `None` if the true size is not known.
    pub size: Option<f64>,
    /// Standard deviation of the size.
    pub size_sigma: f64,
    /// The grasp, with its marks in the plane.
    pub target: GraspTarget,
}

impl Sighting {
    /// Distance of the plane below the camera, m.
    pub fn distance_m(&self) -> f64 {
        self.camera_m.z - self.middle_m.z
    }

    /// Height at which the part's apparent size is its true size, m.
    pub fn height_by_size_m(&self) -> Option<f64> {
        self.size.map(|size| self.camera_m.z - self.distance_m() / size)
    }

    /// Sideways metres of the line of sight per metre downwards.
    pub(super) fn slope(&self) -> Vector2<f64> {
        (self.middle_m - self.camera_m).xy() / self.distance_m()
    }

    /// x and y of the line of sight at a height, base frame, m.
    pub fn middle_at(&self, height_m: f64) -> Point2<f64> {
        self.camera_m.xy() + self.slope() * (self.camera_m.z - height_m)
    }

    /// Moves the part along its line of sight so that its marks are at another height, m.
    pub fn at_height(&self, height_m: f64) -> Self {
        let share = (self.camera_m.z - height_m) / self.distance_m();
        let mut target = self.target;
        let p = &mut target.base_from_tcp.translation;
        p.x = self.camera_m.x + (p.x - self.camera_m.x) * share;
        p.y = self.camera_m.y + (p.y - self.camera_m.y) * share;
        p.z += height_m - self.middle_m.z;
        target.jaw_width_m *= share;
        let middle = self.middle_at(height_m);
        Self {
            middle_m: Point3::new(middle.x, middle.y, height_m),
            place_sigma_m: self.place_sigma_m * share,
            size: self.size.map(|size| size * share),
            target,
            ..*self
        }
    }
}
