//! The camera above the table.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use sdg_geometry::{PinholeCamera, PosedCamera};

/// A pinhole camera that looks down at the table.
///
/// The table's frame, in millimetres: x right and y down as in a vertical picture, z up. (It is left-handed, like every
/// frame with y down and z towards the viewer.)
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub width: usize,
    pub height: usize,
    /// Focal length in pixels.
    pub focal: f32,
    /// The camera's position.
    pub position: [f32; 3],
    /// The picture's right and down directions, and the viewing direction.
    axes: [[f32; 3]; 3],
}

/// The lines of sight of a row of the picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SightRow {
    position: [f32; 3],
    /// Direction at the left edge, and its change per pixel.
    first: [f32; 3],
    step: [f32; 3],
}

impl SightRow {
    /// The same lines in another frame, in which [`Sight::foot`] is at height `base`: `turned` converts directions,
    /// `origin` is the centre of rotation, and `min` is the origin of the new frame.
    #[inline]
    pub fn in_frame(&self, turned: impl Fn([f32; 2]) -> [f32; 2], origin: [f32; 2], min: [f32; 2], base: f32) -> Self {
        let direction = |v: [f32; 3]| {
            let [x, y] = turned([v[0], v[1]]);
            [x, y, v[2]]
        };
        let [x, y] = turned([self.position[0] - origin[0], self.position[1] - origin[1]]);
        Self {
            position: [x - min[0], y - min[1], self.position[2] - base],
            first: direction(self.first),
            step: direction(self.step),
        }
    }

    /// The line of sight through a position in the row.
    #[inline(always)]
    pub fn at(&self, px: f32) -> Sight {
        let ray = [0, 1, 2].map(|k| self.first[k] + self.step[k] * px);
        // At least slightly downwards, so that the line of sight meets the table.
        let inverse = 1.0 / ray[2].min(-0.05);
        let drift = [ray[0] * inverse, ray[1] * inverse];
        let z = self.position[2];
        Sight { foot: [self.position[0] - drift[0] * z, self.position[1] - drift[1] * z], drift }
    }
}

/// A line of sight: its intersection with the table, and its horizontal change per millimetre of height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub foot: [f32; 2],
    pub drift: [f32; 2],
}

impl Sight {
    /// The point at a height.
    #[inline(always)]
    pub fn at(&self, z: f32) -> [f32; 2] {
        [self.foot[0] + self.drift[0] * z, self.foot[1] + self.drift[1] * z]
    }
}

impl View {
    /// A camera that looks at the table's origin from `distance` millimetres, tilted by `tilt` radians from vertical
    /// about the horizontal axis in the direction `azimuth` (radians from x to y).
    pub fn new(width: u32, height: u32, focal: f32, distance: f32, tilt: f32, azimuth: f32) -> Self {
        // Rotated about a horizontal axis (Rodrigues).
        let (axis_y, axis_x) = azimuth.sin_cos();
        let (sin, cos) = tilt.sin_cos();
        let turned = |v: [f32; 3]| {
            let dot = (axis_x * v[0] + axis_y * v[1]) * (1.0 - cos);
            let cross = [axis_y * v[2], -axis_x * v[2], axis_x * v[1] - axis_y * v[0]];
            [
                v[0] * cos + cross[0] * sin + axis_x * dot,
                v[1] * cos + cross[1] * sin + axis_y * dot,
                v[2] * cos + cross[2] * sin,
            ]
        };
        let axes = [turned([1.0, 0.0, 0.0]), turned([0.0, 1.0, 0.0]), turned([0.0, 0.0, -1.0])];
        let position = axes[2].map(|v| -v * distance);
        Self { width: width as usize, height: height as usize, focal, position, axes }
    }

    /// The lines of sight through a row of the picture.
    #[inline]
    pub fn row(&self, py: f32) -> SightRow {
        let [u, v, w] = &self.axes;
        let (left, y) = (-0.5 * self.width as f32 / self.focal, (py - 0.5 * self.height as f32) / self.focal);
        SightRow {
            position: self.position,
            first: [0, 1, 2].map(|k| w[k] + u[k] * left + v[k] * y),
            step: u.map(|c| c / self.focal),
        }
    }

    /// The line of sight through a position in the picture.
    pub fn sight(&self, px: f32, py: f32) -> Sight {
        self.row(py).at(px)
    }

    /// The projection of a point; `None` if the point is not more than 1 mm in front of the camera.
    pub fn project(&self, p: [f32; 3]) -> Option<[f32; 2]> {
        let d = [p[0] - self.position[0], p[1] - self.position[1], p[2] - self.position[2]];
        let along = |axis: &[f32; 3]| axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
        let depth = along(&self.axes[2]);
        (depth > 1.0).then(|| {
            [
                self.focal * along(&self.axes[0]) / depth + 0.5 * self.width as f32,
                self.focal * along(&self.axes[1]) / depth + 0.5 * self.height as f32,
            ]
        })
    }

    /// Millimetres of the table per pixel in the centre of the picture.
    pub fn mm_per_px(&self) -> f32 {
        let [x, y, z] = self.position;
        (x * x + y * y + z * z).sqrt() / self.focal
    }

    /// The camera in metres, in a right-handed frame: x right, y up as in a vertical picture, z up.
    pub fn camera(&self) -> PosedCamera {
        let flipped = |[x, y, z]: [f32; 3]| Vector3::new(f64::from(x), -f64::from(y), f64::from(z));
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&self.axes.map(flipped)));
        let [width, height] = [self.width, self.height].map(|side| side as u32);
        let focal = f64::from(self.focal);
        PosedCamera {
            intrinsics: PinholeCamera::symmetric(width, height, focal),
            world_from_camera: Isometry3::from_parts(
                (flipped(self.position) * 1e-3).into(),
                UnitQuaternion::from_rotation_matrix(&axes),
            ),
        }
    }

    /// The bounding box of the visible part of the table: [min x, min y, max x, max y].
    pub fn ground(&self) -> [f32; 4] {
        let (w, h) = (self.width as f32, self.height as f32);
        [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].iter().fold(
            [f32::MAX, f32::MAX, f32::MIN, f32::MIN],
            |b, &[px, py]| {
                let p = self.sight(px, py).foot;
                [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sights_and_projections_agree() {
        let view = View::new(320, 240, 275.0, 400.0, 0.3, 1.1);
        for (px, py, z) in [(10.0, 20.0, 0.0), (160.0, 120.0, 30.0), (300.0, 200.0, 15.0)] {
            let [x, y] = view.sight(px, py).at(z);
            let seen = view.project([x, y, z]).unwrap();
            assert!((seen[0] - px).abs() < 0.01 && (seen[1] - py).abs() < 0.01, "{seen:?}");
        }
        // The camera in the form for other crates gives the same point, in metres, y up.
        let seen = view.camera().project(&nalgebra::Point3::new(0.031, 0.012, 0.02)).unwrap();
        let expected = view.project([31.0, -12.0, 20.0]).unwrap().map(f64::from);
        assert!((seen - nalgebra::Point2::from(expected)).norm() < 1e-3, "{seen} {expected:?}");
        let straight = View::new(320, 240, 275.0, 400.0, 0.0, 0.0);
        // 40 mm to the right at 400 mm are 27.5 pixels.
        assert!((straight.project([40.0, 0.0, 0.0]).unwrap()[0] - 187.5).abs() < 1e-3);
    }
}
