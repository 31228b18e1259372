//! The pinhole camera with its lens: point in front of the camera ↔ pixel.

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

use super::lens::PlumbBob;
use crate::GeometryError;

/// A pinhole camera and its lens, in pixels; the centre of the first pixel is at (0.5, 0.5).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinholeCamera {
    /// Image width.
    pub width: u32,
    /// Image height.
    pub height: u32,
    /// Horizontal focal length.
    pub fx: f64,
    /// Vertical focal length.
    pub fy: f64,
    /// The optical axis's x; the centre of a 640-pixel image is 320.
    pub cx: f64,
    /// The optical axis's y.
    pub cy: f64,
    /// The lens's distortion.
    #[serde(default)]
    pub lens: PlumbBob,
}

impl PinholeCamera {
    /// The paper's wrist camera: 640 × 480, f = 550 px, axis in the centre.
    pub const WRIST: Self =
        Self { width: 640, height: 480, fx: 550.0, fy: 550.0, cx: 320.0, cy: 240.0, lens: PlumbBob::NONE };

    /// A camera without distortion from its intrinsics.
    ///
    /// # Errors
    /// As for [`Self::checked`].
    pub fn new(width: u32, height: u32, fx: f64, fy: f64, cx: f64, cy: f64) -> Result<Self, GeometryError> {
        Self { width, height, fx, fy, cx, cy, lens: PlumbBob::NONE }.checked()
    }

    /// A camera without distortion, with square pixels and the optical axis in the centre of the picture.
    pub fn symmetric(width: u32, height: u32, focal_px: f64) -> Self {
        let [cx, cy] = [width, height].map(|side| 0.5 * f64::from(side));
        Self { width, height, fx: focal_px, fy: focal_px, cx, cy, lens: PlumbBob::NONE }
    }

    /// Returns the camera if its values are valid.
    ///
    /// # Errors
    /// A focal length that is not positive and finite, an empty image, or a centre or a coefficient that is not finite.
    pub fn checked(self) -> Result<Self, GeometryError> {
        let Self { width, height, fx, fy, cx, cy, lens } = self;
        let focal = |f: f64| f.is_finite() && f > 0.0;
        if !(focal(fx) && focal(fy)) || width == 0 || height == 0 {
            return Err(GeometryError::BadIntrinsics { fx, fy, width, height });
        }
        let values = [cx, cy].map(|value| ("the camera's centre", value));
        let coefficients = lens.to_array().map(|value| ("the lens's coefficients", value));
        match values.into_iter().chain(coefficients).find(|(_, value)| !value.is_finite()) {
            Some((what, value)) => Err(GeometryError::NotFinite { what, value }),
            None => Ok(self),
        }
    }

    /// The pixel of a point in the camera's frame; `None` at or behind the camera and outside the lens's range.
    pub fn project(&self, p_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        if p_in_camera.z <= 0.0 {
            return None;
        }
        let seen = self.lens.distort(&Point2::new(p_in_camera.x / p_in_camera.z, p_in_camera.y / p_in_camera.z))?;
        Some(Point2::new(self.fx * seen.x + self.cx, self.fy * seen.y + self.cy))
    }

    /// The point at depth 1 m that appears at `pixel`; `None` if the lens shows nothing there.
    pub fn unproject(&self, pixel: &Point2<f64>) -> Option<Point3<f64>> {
        let seen = Point2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy);
        self.lens.undistort(&seen).map(|point| Point3::new(point.x, point.y, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn refuses_a_focal_length_of_zero() {
        assert!(matches!(PinholeCamera::new(640, 480, 0.0, 550.0, 0.0, 0.0), Err(GeometryError::BadIntrinsics { .. })));
        let lens = PlumbBob { k2: f64::NAN, ..PlumbBob::NONE };
        assert!(matches!(
            PinholeCamera { lens, ..PinholeCamera::WRIST }.checked(),
            Err(GeometryError::NotFinite { .. })
        ));
    }

    /// The expected pixels are those of OpenCV 4.11's `projectPoints`, where the first pixel's centre is at (0, 0).
    #[test]
    fn projects_as_opencv_does() {
        let lens = PlumbBob { k1: -0.28, k2: 0.11, p1: 0.0013, p2: -0.0007, k3: -0.02 };
        let camera =
            PinholeCamera { width: 640, height: 480, fx: 612.3, fy: 609.8, cx: 318.7 + 0.5, cy: 244.1 + 0.5, lens };
        let camera_from_world = Isometry3::new(Vector3::new(0.05, -0.02, 0.6), Vector3::new(0.3, -0.2, 0.5));
        let cases = [
            ([0.0, 0.0, 0.0], [369.59644619, 223.82955543]),
            ([0.1, 0.05, 0.0], [424.11719817, 306.30321301]),
            ([-0.2, 0.1, 0.03], [143.97071309, 210.06492813]),
            ([0.25, -0.15, 0.01], [619.30965491, 210.13993331]),
            ([-0.3, -0.2, -0.02], [193.50280549, -122.45889733]),
        ];
        for (point, [x, y]) in cases {
            let in_camera = camera_from_world * Point3::from(point);
            let seen = camera.project(&in_camera).unwrap();
            assert!((seen - Point2::new(x + 0.5, y + 0.5)).norm() < 1e-7, "{seen}");
            let back = camera.unproject(&seen).unwrap() * in_camera.z;
            assert!((back - in_camera).norm() < 1e-9, "{back}");
        }
    }
}
