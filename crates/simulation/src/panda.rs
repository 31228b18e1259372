//! The arm in the model: its MJCF, and its joints, motors and frames.

use nalgebra::{Isometry3, SVector};

use crate::data::Data;
use crate::error::Result;
use crate::model::{Actuator, Asset, Body, Camera, Geom, Id, Joint, Model, Site};
use crate::scene::pose_attributes;

/// Number of the arm's joints.
pub const NUM_ARM_JOINTS: usize = 7;

/// Joint positions, velocities or torques of the arm, joint 1 first.
pub type ArmVector = SVector<f64, NUM_ARM_JOINTS>;

/// File name by which a model includes the arm.
pub const PANDA_FILE: &str = "panda.xml";

/// Travel of each finger in metres; the hand opens twice as far.
pub const FINGER_TRAVEL_M: f64 = 0.5 * sdg_kinematics::HAND_OPENING_MAX_M;

/// Distance of the finger tips beyond the tcp, in metres.
pub const FINGERTIP_BEYOND_TCP_M: f64 = 0.004;

/// The MJCF of the arm with hand and wrist camera, to be included by a model. The base frame is the world frame, and
/// each joint has one motor.
pub fn panda_asset() -> Asset {
    Asset { name: PANDA_FILE.to_owned(), bytes: include_bytes!("../assets/panda.xml").to_vec() }
}

/// The pads' priority and friction, and the wrist camera's field of view and pose, as in the MJCF.
const PAD_PRIORITY: &str = " priority=\"1\"";
const PAD_FRICTION: &str = "friction=\"1.0 ";
const WRIST_PLACE: &str = "pos=\"0.072 0 0.050\" xyaxes=\"0 1 0 1 0 0\"";
const WRIST_FOVY: &str = "fovy=\"47.149412403825\"";

/// As [`panda_asset`], with changes:
/// - `pad_friction`: another sliding friction of the pads, without priority, so that MuJoCo uses the larger friction of
///   pad and part;
/// - `wrist_fovy_deg`: another vertical field of view of the wrist camera;
/// - `hand_from_camera`: another pose of the wrist camera, in MuJoCo's camera frame.
pub(crate) fn changed_panda_asset(
    pad_friction: Option<f64>,
    wrist_fovy_deg: Option<f64>,
    hand_from_camera: Option<&Isometry3<f64>>,
) -> Asset {
    let mut text = include_str!("../assets/panda.xml").to_owned();
    if let Some(friction) = pad_friction {
        text = text.replace(PAD_PRIORITY, "").replace(PAD_FRICTION, &format!("friction=\"{friction} "));
    }
    if let Some(fovy) = wrist_fovy_deg {
        text = text.replace(WRIST_FOVY, &format!("fovy=\"{fovy:.12}\""));
    }
    if let Some(hand_from_camera) = hand_from_camera {
        text = text.replace(WRIST_PLACE, &pose_attributes(hand_from_camera));
    }
    Asset { name: PANDA_FILE.to_owned(), bytes: text.into_bytes() }
}

/// The arm's joints, motors, fingers, tcp and camera in a compiled model.
#[derive(Debug, Clone)]
pub struct PandaIds {
    /// Joints 1 to 7.
    pub joints: [Id<Joint>; NUM_ARM_JOINTS],
    /// Motors of joints 1 to 7.
    pub motors: [Id<Actuator>; NUM_ARM_JOINTS],
    /// Left and right finger's slides.
    pub finger_joints: [Id<Joint>; 2],
    /// Left and right finger's motors.
    pub finger_motors: [Id<Actuator>; 2],
    /// Left and right finger.
    pub fingers: [Id<Body>; 2],
    /// The tool centre point between the finger tips.
    pub tcp: Id<Site>,
    /// The camera on the hand.
    pub wrist_camera: Id<Camera>,
    qpos: [usize; NUM_ARM_JOINTS],
    qvel: [usize; NUM_ARM_JOINTS],
    finger_qpos: [usize; 2],
    finger_qvel: [usize; 2],
}

impl PandaIds {
    /// Finds the arm in a model that includes [`panda_asset`].
    ///
    /// # Errors
    /// `UnknownName` if the model has no such arm.
    pub fn find(model: &Model) -> Result<Self> {
        let names: [String; NUM_ARM_JOINTS] = std::array::from_fn(|joint| format!("joint{}", joint + 1));
        let mut joints = [Id::new(0); NUM_ARM_JOINTS];
        let mut motors = [Id::new(0); NUM_ARM_JOINTS];
        for (index, name) in names.iter().enumerate() {
            joints[index] = model.id(name)?;
            motors[index] = model.id(name)?;
        }
        let finger_joints = [model.id("finger_joint1")?, model.id("finger_joint2")?];
        Ok(Self {
            joints,
            motors,
            finger_joints,
            finger_motors: [model.id("finger1")?, model.id("finger2")?],
            fingers: [model.id("left_finger")?, model.id("right_finger")?],
            tcp: model.id("tcp")?,
            wrist_camera: model.id("wrist")?,
            qpos: joints.map(|joint| model.qpos_index(joint)),
            qvel: joints.map(|joint| model.qvel_index(joint)),
            finger_qpos: finger_joints.map(|joint| model.qpos_index(joint)),
            finger_qvel: finger_joints.map(|joint| model.qvel_index(joint)),
        })
    }

    /// Joint angles in radians.
    pub fn position(&self, data: &Data) -> ArmVector {
        ArmVector::from_fn(|joint, _| data.qpos()[self.qpos[joint]])
    }

    /// Joint velocities in rad/s.
    pub fn velocity(&self, data: &Data) -> ArmVector {
        ArmVector::from_fn(|joint, _| data.qvel()[self.qvel[joint]])
    }

    /// Sets the arm to a configuration at rest, without dynamics.
    pub fn set_position(&self, data: &mut Data, q: &ArmVector) {
        for joint in 0..NUM_ARM_JOINTS {
            data.qpos_mut()[self.qpos[joint]] = q[joint];
            data.qvel_mut()[self.qvel[joint]] = 0.0;
        }
    }

    /// Indices of the joints in `qvel`.
    pub(crate) fn qvel_indices(&self) -> &[usize; NUM_ARM_JOINTS] {
        &self.qvel
    }

    /// Positions of left and right finger in metres, 0 closed.
    pub fn finger_position_m(&self, data: &Data) -> [f64; 2] {
        self.finger_qpos.map(|index| data.qpos()[index])
    }

    /// Velocities of left and right finger in m/s, positive opening.
    pub fn finger_velocity_m_s(&self, data: &Data) -> [f64; 2] {
        self.finger_qvel.map(|index| data.qvel()[index])
    }

    /// Sets the fingers to a position at rest, without dynamics.
    pub fn set_finger_position_m(&self, data: &mut Data, position_m: f64) {
        for finger in 0..2 {
            data.qpos_mut()[self.finger_qpos[finger]] = position_m;
            data.qvel_mut()[self.finger_qvel[finger]] = 0.0;
        }
    }

    /// Pose of the tool centre point in the base frame.
    pub fn base_from_tcp(&self, data: &Data) -> Isometry3<f64> {
        data.world_from_site(self.tcp)
    }

    /// The finger (0 left, 1 right) of a geom.
    pub fn finger_of(&self, model: &Model, geom: Id<Geom>) -> Option<usize> {
        let body = model.body_of(geom);
        self.fingers.iter().position(|&finger| finger == body)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;
    use sdg_kinematics as kinematics;

    use super::*;
    use crate::camera::{WRIST_FOCAL_LENGTH_PX, vertical_field_of_view_rad};

    fn arm() -> (Data, PandaIds) {
        let xml = "<mujoco><compiler angle='radian'/><include file='panda.xml'/></mujoco>";
        let model = Arc::new(Model::from_xml(xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        (Data::new(model).unwrap(), ids)
    }

    /// Tests that the hand's opening is the same in `sdg-fci`, in `sdg-kinematics`, and in the MJCF.
    #[test]
    fn the_hand_opens_as_far_everywhere() {
        assert_eq!(sdg_fci::server::HAND_MAX_WIDTH_M, kinematics::HAND_OPENING_MAX_M);
        let range = format!("axis=\"0 1 0\" limited=\"true\" range=\"0 {FINGER_TRAVEL_M}\"");
        assert!(include_str!("../assets/panda.xml").contains(&range), "{range}");
    }

    #[test]
    fn mujoco_and_kinematics_agree_everywhere() {
        let (mut data, ids) = arm();
        let panda = kinematics::ArmGeometry::panda();
        let mut rng = Pcg64::seed_from_u64(7);
        for _ in 0..200 {
            let q = ArmVector::from_fn(|joint, _| {
                rng.random_range(panda.limits.position_min[joint]..panda.limits.position_max[joint])
            });
            ids.set_position(&mut data, &q);
            data.forward().unwrap();
            let frames = panda.frames(&q);
            for (index, &joint) in ids.joints.iter().enumerate() {
                let body =
                    data.model().id::<Body>(&data.model().name(joint).unwrap().replace("joint", "link")).unwrap();
                let difference = frames.base_from_link[index].inverse() * data.world_from_body(body);
                assert!(difference.translation.vector.norm() < 1e-9, "link {}", index + 1);
                assert!(difference.rotation.angle() < 1e-7, "link {}", index + 1);
            }
            let difference = frames.base_from_tcp.inverse() * ids.base_from_tcp(&data);
            assert!(difference.translation.vector.norm() < 1e-9 && difference.rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn limits_are_frankas() {
        let (data, ids) = arm();
        let limits = kinematics::JointLimits::panda();
        let raw = data.model().raw();
        for joint in 0..NUM_ARM_JOINTS {
            // SAFETY: two numbers per joint and two per actuator.
            let (range, torque) = unsafe {
                (
                    *raw.jnt_range.add(2 * ids.joints[joint].index()).cast::<[f64; 2]>(),
                    *raw.actuator_ctrlrange.add(2 * ids.motors[joint].index()).cast::<[f64; 2]>(),
                )
            };
            assert_eq!(range, [limits.position_min[joint], limits.position_max[joint]]);
            assert_eq!(torque, [-limits.torque_max[joint], limits.torque_max[joint]]);
        }
    }

    #[test]
    fn worn_pads_have_their_friction_and_no_priority() {
        let pads = |asset: Asset| {
            let xml = "<mujoco><compiler angle='radian'/><include file='panda.xml'/></mujoco>";
            let model = Model::from_xml(xml, &[asset]).unwrap();
            let raw = model.raw();
            let mut found = Vec::new();
            for geom in model.ids::<Geom>().filter(|&geom| model.name(geom).is_some_and(|name| name.contains("pad"))) {
                // SAFETY: one priority and three coefficients per geom.
                found.push(unsafe { (*raw.geom_priority.add(geom.index()), *raw.geom_friction.add(3 * geom.index())) });
            }
            found
        };
        assert_eq!(pads(panda_asset()), [(1, 1.0); 8]);
        assert_eq!(pads(changed_panda_asset(Some(0.7), None, None)), [(0, 0.7); 8]);
    }

    #[test]
    fn the_camera_looks_along_the_approach_axis() {
        let (data, ids) = arm();
        let optical_axis = data.world_from_mujoco_camera(ids.wrist_camera).rotation * -nalgebra::Vector3::z();
        let approach_axis = ids.base_from_tcp(&data).rotation * nalgebra::Vector3::z();
        assert!((optical_axis - approach_axis).norm() < 1e-9);
        let fovy = data.model().vertical_field_of_view_rad(ids.wrist_camera);
        assert!((fovy - vertical_field_of_view_rad(WRIST_FOCAL_LENGTH_PX, 480)).abs() < 1e-12);
        let changed = String::from_utf8(changed_panda_asset(None, Some(60.0), None).bytes).unwrap();
        assert!(changed.contains("fovy=\"60.000000000000\"") && !changed.contains(WRIST_FOVY));
    }

    #[test]
    fn closed_fingers_meet_at_the_tcp() {
        let (mut data, ids) = arm();
        ids.set_finger_position_m(&mut data, 0.0);
        data.forward().unwrap();
        let tcp = ids.base_from_tcp(&data);
        for (side, name) in [(1.0, "left_pad_3"), (-1.0, "right_pad_3")] {
            let pad = data.world_from_geom(data.model().id(name).unwrap());
            let in_tcp = tcp.inverse_transform_point(&pad.translation.vector.into());
            // The pad is 6 mm thick; its inner face is in the plane between the fingers.
            assert!((in_tcp.y - side * 0.003).abs() < 1e-9, "{name} at {in_tcp}");
            let tip = in_tcp.z + 0.0045;
            assert!((tip - FINGERTIP_BEYOND_TCP_M - 0.0016).abs() < 0.002, "{name}: tip {tip} m beyond the tcp");
        }
    }
}
