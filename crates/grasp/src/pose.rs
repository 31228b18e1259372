//! Conversion of a grasp in the image to a pose of the gripper.

use nalgebra::{Isometry3, Matrix3, Point2, Rotation3, Translation3, UnitQuaternion, Vector3};
use sdg_geometry::{PlanarGrasp, PosedCamera};

use crate::GraspError;

/// The heights of the marks and of the grasp, which a photo does not show: known from the part, or measured once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspPlane {
    /// Height of the marks' plane in the base frame, in metres. The paper's code uses the table's height and therefore
    /// has a parallax error: 11 mm for marks 40 mm high, 150 px off the axis.
    pub mark_height_m: f64,
    /// Height of the gripper's centre point when it closes, in the base frame, in metres.
    pub grasp_height_m: f64,
}

/// The grasp pose, and the width of the part at the grasp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspPose {
    /// Transform from the tool centre point's frame to the robot's base, metres: z points down to the table,
    /// y is the closing direction of the jaws, x runs along the marked line.
    pub base_from_tcp: Isometry3<f64>,
    /// The part's width between the jaws, in metres.
    pub jaw_width_m: f64,
}

impl GraspPose {
    /// Projects the grasp through the pinhole camera onto the marks' plane; the pose is at the grasp height.
    ///
    /// # Units and frames
    /// `grasp` in pixels of `camera`, whose world is the robot's base; `max_opening_m` is the gripper's stroke.
    ///
    /// # Errors
    /// A ray that misses the plane, or a part wider than the gripper's opening.
    ///
    /// # Source
    /// Paper, section V-A (perception node); the paper's code scales pixels by camera height / focal length instead.
    pub fn from_planar(
        camera: &PosedCamera,
        grasp: &PlanarGrasp,
        plane: &GraspPlane,
        max_opening_m: f64,
    ) -> Result<Self, GraspError> {
        let on_plane = |pixel: Point2<f64>| {
            camera.at_height(&pixel, plane.mark_height_m).ok_or(GraspError::OffPlane {
                x: pixel.x,
                y: pixel.y,
                height_m: plane.mark_height_m,
            })
        };
        let center = on_plane(grasp.center())?;
        // A short step along the line, so that perspective does not change the direction.
        let (sin, cos) = grasp.angle.radians().sin_cos();
        let ahead = on_plane(grasp.center() + nalgebra::Vector2::new(cos, sin))?;
        let along = (ahead - center).normalize();
        let down = -Vector3::z();
        let across = down.cross(&along);

        let [one, other] = grasp.jaws();
        let jaw_width_m = (on_plane(one)? - on_plane(other)?).norm();
        if jaw_width_m > max_opening_m {
            return Err(GraspError::TooWide { width_m: jaw_width_m, max_opening_m });
        }
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along, across, down]));
        Ok(Self {
            base_from_tcp: Isometry3::from_parts(
                Translation3::new(center.x, center.y, plane.grasp_height_m),
                UnitQuaternion::from_rotation_matrix(&rotation),
            ),
            jaw_width_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::{Angle, PinholeCamera};
    use std::f64::consts::PI;

    fn half_a_metre_above(x: f64, y: f64) -> PosedCamera {
        PosedCamera {
            intrinsics: PinholeCamera::WRIST,
            world_from_camera: Isometry3::from_parts(
                Translation3::new(x, y, 0.5),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
            ),
        }
    }

    const PLANE: GraspPlane = GraspPlane { mark_height_m: 0.0, grasp_height_m: 0.01 };

    #[test]
    fn the_middle_of_the_image_is_below_the_camera() {
        let grasp = PlanarGrasp { x: 320.0, y: 240.0, angle: Angle::ZERO, width: 22.0 };
        let pose = GraspPose::from_planar(&half_a_metre_above(0.4, 0.1), &grasp, &PLANE, 0.08).unwrap();
        let at = pose.base_from_tcp.translation.vector;
        assert!((at - Vector3::new(0.4, 0.1, 0.01)).norm() < 1e-12);
        // 22 px at 0.5 m and f = 550 px.
        assert!((pose.jaw_width_m - 0.02).abs() < 1e-12);
        assert!((pose.base_from_tcp * Vector3::z() + Vector3::z()).norm() < 1e-12);
        assert!((pose.base_from_tcp * Vector3::x() - Vector3::x()).norm() < 1e-9);
    }

    #[test]
    fn a_turn_to_the_right_in_the_image_turns_the_gripper_with_it() {
        // Image y is opposite to base y for this camera, so that +90° in the image is the direction -y of the base.
        let grasp = PlanarGrasp { x: 320.0, y: 240.0, angle: Angle::from_degrees(90.0), width: 22.0 };
        let pose = GraspPose::from_planar(&half_a_metre_above(0.4, 0.0), &grasp, &PLANE, 0.08).unwrap();
        assert!((pose.base_from_tcp * Vector3::x() + Vector3::y()).norm() < 1e-9);
    }

    #[test]
    fn a_higher_plane_is_nearer_the_axis() {
        let grasp = PlanarGrasp { x: 430.0, y: 240.0, angle: Angle::ZERO, width: 10.0 };
        let raised = GraspPlane { mark_height_m: 0.1, ..PLANE };
        let pose = GraspPose::from_planar(&half_a_metre_above(0.0, 0.0), &grasp, &raised, 0.08).unwrap();
        assert!((pose.base_from_tcp.translation.x - 0.08).abs() < 1e-12);
    }

    #[test]
    fn a_part_wider_than_the_gripper_is_refused() {
        let grasp = PlanarGrasp { x: 320.0, y: 240.0, angle: Angle::ZERO, width: 99.0 };
        let refused = GraspPose::from_planar(&half_a_metre_above(0.4, 0.0), &grasp, &PLANE, 0.08);
        assert!(matches!(refused, Err(GraspError::TooWide { width_m, .. }) if (width_m - 0.09).abs() < 1e-9));
    }
}
