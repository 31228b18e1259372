//! A camera with its pose: pixel ↔ ray ↔ point on a plane.

use nalgebra::{Isometry3, Point2, Point3, Unit, Vector3};

use super::pinhole::PinholeCamera;

/// A half-line in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The start, in metres.
    pub origin: Point3<f64>,
    /// Direction, of unit length.
    pub direction: Unit<Vector3<f64>>,
}

impl Ray {
    /// The intersection of the ray with the plane z = `height_m`; `None` if the ray is parallel to the plane or points
    /// away from it.
    pub fn at_height(&self, height_m: f64) -> Option<Point3<f64>> {
        let t = (height_m - self.origin.z) / self.direction.z;
        (t.is_finite() && t > 0.0).then(|| self.origin + self.direction.into_inner() * t)
    }
}

/// A camera with its pose in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedCamera {
    /// Size, focal lengths, centre and lens.
    pub intrinsics: PinholeCamera,
    /// Transform from the optical frame (x right, y down, z forward) to the world, metres.
    pub world_from_camera: Isometry3<f64>,
}

impl PosedCamera {
    /// The pixel of a point in the world; `None` at or behind the camera and outside the lens's range.
    pub fn project(&self, p_in_world: &Point3<f64>) -> Option<Point2<f64>> {
        self.intrinsics.project(&self.world_from_camera.inverse_transform_point(p_in_world))
    }

    /// The ray through a pixel; `None` if the lens shows nothing there.
    pub fn ray(&self, pixel: &Point2<f64>) -> Option<Ray> {
        let direction = self.world_from_camera * self.intrinsics.unproject(pixel)?.coords;
        Some(Ray {
            origin: self.world_from_camera.translation.vector.into(),
            direction: Unit::new_normalize(direction),
        })
    }

    /// The point of the plane z = `height_m` that appears at `pixel`; `None` if the lens shows nothing there, or if the
    /// ray misses the plane.
    pub fn at_height(&self, pixel: &Point2<f64>, height_m: f64) -> Option<Point3<f64>> {
        self.ray(pixel)?.at_height(height_m)
    }

    /// Metres per pixel on the plane z = `height_m` near `pixel` (the mean of both axes); `None` as for
    /// [`at_height`](Self::at_height).
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>, height_m: f64) -> Option<f64> {
        let here = self.at_height(pixel, height_m)?;
        let right = self.at_height(&Point2::new(pixel.x + 1.0, pixel.y), height_m)?;
        let down = self.at_height(&Point2::new(pixel.x, pixel.y + 1.0), height_m)?;
        Some(0.5 * ((right - here).norm() + (down - here).norm()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// Half a metre above (0.4, 0, 0), looking vertically down with image x along world x.
    fn looking_down() -> PosedCamera {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        PosedCamera {
            intrinsics: PinholeCamera::WRIST,
            world_from_camera: Isometry3::from_parts(Vector3::new(0.4, 0.0, 0.5).into(), turn),
        }
    }

    #[test]
    fn one_hundred_and_ten_pixels_are_ten_centimetres_at_half_a_metre() {
        let camera = looking_down();
        let seen = camera.project(&Point3::new(0.5, 0.0, 0.0)).unwrap();
        assert!((seen - Point2::new(430.0, 240.0)).norm() < 1e-9);
        // World y points up in the image: the camera is rotated about x.
        let left_of_robot = camera.project(&Point3::new(0.4, 0.1, 0.0)).unwrap();
        assert!((left_of_robot - Point2::new(320.0, 130.0)).norm() < 1e-9);
    }

    #[test]
    fn a_ray_upwards_misses_the_table() {
        let mut camera = looking_down();
        camera.world_from_camera.rotation = UnitQuaternion::identity();
        assert_eq!(camera.at_height(&Point2::new(320.0, 240.0), 0.0), None);
        assert_eq!(camera.project(&Point3::new(0.4, 0.0, 0.0)), None);
    }

    proptest! {
        #[test]
        fn pixel_to_plane_and_back(x in 0.0..640.0f64, y in 0.0..480.0f64, height in 0.0..0.2f64, tilt in -0.3..0.3f64) {
            let mut camera = looking_down();
            camera.world_from_camera.rotation *= UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
            let pixel = Point2::new(x, y);
            let point = camera.at_height(&pixel, height).unwrap();
            prop_assert!((point.z - height).abs() < 1e-9);
            prop_assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-6);
        }
    }
}
