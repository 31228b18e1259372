//! The look-out poses of the sequence and the settings of its grasp.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use sdg_kinematics::collision::Obstacle;
use sdg_kinematics::{ArmGeometry, IkOptions, JointVector};

use crate::arm_state::Load;
use crate::camera_pose::CameraPose;
use crate::error::{Result, RobotError};
use crate::height::HeightMeasurement;
use crate::lying_part::LyingPart;
use crate::pace::Pace;
use crate::part_shape::PartShape;
use crate::place::Place;
use crate::touch::TouchDown;

/// Default centre of the first picture on the table, base frame, m.
pub const LOOK_AT_M: [f64; 2] = [0.48, 0.0];
/// Default height of a wrist camera above the table for detections, m: that of the shipped demonstrations, so that a
/// part has the same size as in them.
pub const LOOK_HEIGHT_M: f64 = 0.58;

/// A pose of the arm for finding the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LookOut {
    /// The camera on the hand points vertically down.
    CameraAt {
        /// x and y of the camera in the base frame, m.
        at_m: [f64; 2],
        /// Height above the table, m.
        height_m: f64,
        /// Rotation about the vertical, rad; see [`camera_looking_down`].
        yaw_rad: f64,
    },
    /// A configuration of the arm, rad: for a camera beside the robot, with the arm outside the camera's view.
    Joints(JointVector),
}

/// The poses of the sequence, its grasp, and its speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspConfig {
    /// The poses at which pictures are taken, one after the other, until the part is found. The first must be
    /// reachable.
    pub look_outs: Vec<LookOut>,
    /// Height of the wrist camera above the table for pictures from above a detection, m; best equal to that of the
    /// demonstration's photo.
    pub hover_height_m: f64,
    /// Force of each finger when closed, N.
    pub grasp_force_n: f64,
    /// Opening of the hand beyond the part's width, both sides together, m.
    pub opening_margin_m: f64,
    /// Height of the lift, m.
    pub lift_m: f64,
    /// The smallest sufficient lift if the arm cannot reach higher, m.
    pub min_lift_m: f64,
    /// Duration of holding the lifted part, s.
    pub hold_secs: f64,
    /// Maximum age of a picture at the start of a motion that depends on it, s.
    pub max_detection_age_secs: f64,
    /// The load of the hand while it holds the part.
    pub load: Option<Load>,
    /// The compliant descent of the last centimetres before the hand closes, on a compliant arm, for a table height
    /// that is not known to a millimetre. `None`: a descent by joint positions.
    pub soft_approach: Option<TouchDown>,
    /// How a camera on the hand measures the part's height; with `None`, or with a camera beside the robot, the height
    /// comes from perception.
    pub height: Option<HeightMeasurement>,
    /// z of the surface under the part, base frame, m, if it is given and not measured; `None` for the table.
    pub surface_m: Option<f64>,
    /// Obstacles in the cell besides the table: free motions are planned around them.
    pub obstacles: Vec<Obstacle>,
    /// Radius of the part around its grasp, m: the held part is kept away from the obstacles like the arm.
    pub part_radius_m: f64,
    /// The known shape of the part, for its distance from other parts; with `None` a shape is assumed from its width
    /// between the fingers.
    pub part: Option<PartShape>,
    /// Parts lying in the cell that are known before a picture is taken and must not be touched.
    pub lying: Vec<LyingPart>,
    /// All places of the cell: a part that lies in one of them did not fall beside a bin.
    pub places: Vec<Place>,
    /// Speed of the motions.
    pub pace: Pace,
}

impl Default for GraspConfig {
    /// The sequence of the paper *SingleDemoGrasp*, as rehearsals run it.
    fn default() -> Self {
        let look_outs = [0.0, 0.10, -0.10].map(|shift_m| LookOut::CameraAt {
            at_m: [LOOK_AT_M[0], LOOK_AT_M[1] + shift_m],
            height_m: LOOK_HEIGHT_M,
            yaw_rad: 0.0,
        });
        Self {
            look_outs: look_outs.to_vec(),
            hover_height_m: LOOK_HEIGHT_M,
            grasp_force_n: 40.0,
            opening_margin_m: 0.045,
            lift_m: 0.45,
            min_lift_m: 0.25,
            hold_secs: 1.0,
            max_detection_age_secs: 1.0,
            load: None,
            soft_approach: None,
            height: None,
            surface_m: None,
            obstacles: Vec::new(),
            part_radius_m: 0.06,
            part: None,
            lying: Vec::new(),
            places: Vec::new(),
            pace: Pace::REHEARSED,
        }
    }
}

impl LookOut {
    /// The arm's configuration at the look-out pose, rad.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] for an unreachable pose, and for a camera pose if the camera is not on the hand.
    pub fn configuration(&self, arm: &ArmGeometry, camera: &CameraPose, table_height_m: f64) -> Result<JointVector> {
        let (at_m, height_m, yaw_rad) = match (*self, camera) {
            (Self::Joints(q), _) => return Ok(q),
            (Self::CameraAt { at_m, height_m, yaw_rad }, CameraPose::OnFlange(_)) => (at_m, height_m, yaw_rad),
            (Self::CameraAt { .. }, CameraPose::InBase(_)) => {
                return Err(RobotError::Configuration {
                    what: "look-out pose".into(),
                    expected: "joint angles, since the camera is beside the robot".into(),
                    found: "a pose of the camera".into(),
                });
            }
        };
        let base_from_camera = camera_looking_down(at_m[0], at_m[1], table_height_m + height_m, yaw_rad);
        let base_from_tcp = camera.base_from_tcp(arm, &base_from_camera);
        arm.inverse(&base_from_tcp, &arm.ready, &IkOptions::default()).map(|solution| solution.q).map_err(|error| {
            RobotError::Configuration {
                what: format!("look-out pose at ({}, {}) m, {height_m} m above the table", at_m[0], at_m[1]),
                expected: "a camera pose within the arm's reach".into(),
                found: error.to_string(),
            }
        })
    }
}

/// The pose of a camera that points straight down from (`x`, `y`, `height_m`), m in the base frame. At yaw 0 the
/// picture's up direction is the base's x and its right direction is -y; a positive yaw rotates the camera
/// counter-clockwise as seen from above.
pub fn camera_looking_down(x: f64, y: f64, height_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    // Columns: the optical frame's x (right), y (down), z (forward) in the base frame.
    let at_yaw_zero = Matrix3::from_columns(&[-Vector3::y(), -Vector3::x(), -Vector3::z()]);
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad)
        * UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(at_yaw_zero));
    Isometry3::from_parts(Translation3::new(x, y, height_m), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_out_puts_the_camera_where_it_is_told() {
        let panda = ArmGeometry::panda();
        let tcp_from_camera = Isometry3::translation(0.072, 0.0, -0.0534);
        let camera = CameraPose::OnFlange(panda.flange_from_tcp() * tcp_from_camera);
        let look_out = LookOut::CameraAt { at_m: [0.5, 0.1], height_m: 0.5, yaw_rad: 0.3 };
        let q = look_out.configuration(&panda, &camera, 0.05).unwrap();
        let apart = (panda.forward(&q) * tcp_from_camera).inverse() * camera_looking_down(0.5, 0.1, 0.55, 0.3);
        assert!(apart.translation.vector.norm() < 1e-5 && apart.rotation.angle() < 1e-5, "{apart}");
    }

    #[test]
    fn places_that_cannot_be_are_said() {
        let (panda, camera) = (ArmGeometry::panda(), CameraPose::OnFlange(Isometry3::identity()));
        let far = LookOut::CameraAt { at_m: [1.5, 0.0], height_m: 0.5, yaw_rad: 0.0 };
        let found = far.configuration(&panda, &camera, 0.0).unwrap_err().to_string();
        assert!(
            found.starts_with("look-out pose at (1.5, 0) m, 0.5 m above the table: expected a camera pose"),
            "{found}"
        );
        let found = far.configuration(&panda, &CameraPose::InBase(Isometry3::identity()), 0.0).unwrap_err().to_string();
        assert!(found.contains("joint angles, since the camera is beside the robot"), "{found}");
    }
}
