//! An arm's geometry as data, with forward kinematics and Jacobian.
//!
//! Modified (Craig) Denavit–Hartenberg convention: frame *i* is rotated by `q[i]` about its own z axis, and
//! `link(i-1)_from_link(i) = RotX(alpha) · TransX(a) · RotZ(q) · TransZ(d)`.
//!
//! Frames: `base` (z up, x forward), `link 1..7` (on the joint axes), `flange` (along z of link 7), `hand` (the flange
//! rotated about z), `tcp` (along z of the hand, between the fingertips). The fingers open along y of `hand` and `tcp`;
//! z points out of the hand.
//!
//! Bodies of the arm are numbered: 0 is the base, 1 to 7 the links, 8 the hand with its fingers, 9 the held part.

use nalgebra::{Isometry3, SMatrix, Translation3, UnitQuaternion, Vector3};

use crate::capsule::Capsule;
use crate::inertia::LinkInertia;
use crate::joints::{JointVector, NUM_JOINTS};
use crate::limits::{CartesianLimits, JointLimits};

/// A geometric Jacobian: rows 0–2 the linear velocity (m/s), rows 3–5 the angular velocity (rad/s), per rad/s of a
/// joint.
pub type Jacobian = SMatrix<f64, 6, NUM_JOINTS>;

/// Craig's parameters of one joint and its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DhJoint {
    /// `a`, m.
    pub a_m: f64,
    /// `d`, m.
    pub d_m: f64,
    /// `alpha`, rad: 0 or ±π/2.
    pub alpha_rad: f64,
}

/// The data of an arm with its hand for kinematics, collisions and dynamics. Another arm is another value of this type,
/// see [`ArmGeometry::panda`] and [`ArmGeometry::fr3`].
///
/// In an arm with fewer joints, the last joints have the range from 0 to 0; their columns of the Jacobian are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmGeometry {
    /// The joints, from joint 1 at the base.
    pub joints: [DhJoint; NUM_JOINTS],
    /// Distance from link 7 to the flange along z, m.
    pub flange_offset_m: f64,
    /// The joint limits that inverse kinematics and paths respect.
    pub limits: JointLimits,
    /// The limits of the tcp's motion.
    pub cartesian_limits: CartesianLimits,
    /// The posture that inverse kinematics prefers, rad.
    pub ready: JointVector,
    /// The closed form of the inverse kinematics, if the arm has one; otherwise it is solved by descent from many
    /// starts.
    pub closed_form: Option<ClosedForm>,
    /// The hand on the flange.
    pub hand: HandGeometry,
    /// Capsules that contain base and links 1 to 7, each in the frame of the base or the link.
    pub capsules: [Vec<Capsule>; NUM_JOINTS + 1],
    /// Fewer and wider capsules than `capsules`, for a check in every cycle of a motion.
    pub wide_capsules: [Vec<Capsule>; NUM_JOINTS + 1],
    /// Pairs of bodies that can collide, the one nearer to the base first. Neighbours always touch.
    pub self_pairs: Vec<(usize, usize)>,
    /// Spheres around links' origins that contain wrist and elbow: part, number of the link, radius in m.
    pub balls: Vec<(ArmPart, usize, f64)>,
    /// Links 1 to 7 without the hand, in their frames.
    pub links: [LinkInertia; NUM_JOINTS],
    /// Inertia of the motors and gears behind each joint, kg·m².
    pub rotor_inertia: JointVector,
    /// Viscous friction of each joint, N·m·s/rad.
    pub damping: JointVector,
}

/// A method that computes all configurations for a pose and a given angle of joint 7.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosedForm {
    /// Franka's arms: three axes meet in the shoulder, two in the wrist, and joint 7 is offset from them.
    Franka,
}

/// A hand with two parallel fingers.
#[derive(Debug, Clone, PartialEq)]
pub struct HandGeometry {
    /// Rotation of the hand relative to the flange, about z.
    pub flange_from_hand: UnitQuaternion<f64>,
    /// Distance from the flange to the tcp along z, m.
    pub tcp_offset_m: f64,
    /// Largest opening between the fingers, m.
    pub opening_max_m: f64,
    /// Half the width of the hand's body along the fingers' motion, m.
    pub half_width_m: f64,
    /// Half the depth of the hand's body, m.
    pub half_depth_m: f64,
    /// Length of the hand's body from the flange, m.
    pub length_m: f64,
    /// Capsules that contain the hand's body and a small camera on it, in the hand's frame.
    pub capsules: Vec<Capsule>,
    /// Fewer and wider capsules that also contain the fingers at any opening, see [`ArmGeometry::wide_capsules`].
    pub wide_capsules: Vec<Capsule>,
    /// A finger.
    pub finger: FingerGeometry,
    /// The hand's body with the camera, in the hand's frame.
    pub inertia: LinkInertia,
}

/// A finger of a hand, in the hand's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FingerGeometry {
    /// Half of the width across the finger's motion, m.
    pub half_width_m: f64,
    /// Thickness of the tip along the finger's motion, m.
    pub thickness_m: f64,
    /// Half of the finger's thickness at its root, along its motion: the distance of the root's centre from the face of
    /// the pad, m.
    pub middle_m: f64,
    /// Capsules along z that contain the finger, from root to tip.
    pub capsules: Vec<FingerCapsule>,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass: distance from the pad's face, and z, m.
    pub center_m: [f64; 2],
    /// Diagonal of the inertia, kg·m².
    pub inertia: [f64; 3],
}

/// A capsule of a finger, parallel to z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerCapsule {
    /// Distance by which the capsule is closer to the pad than the finger's centre, m.
    pub inward_m: f64,
    /// The ends of the axis along z, m.
    pub z_m: [f64; 2],
    /// Radius, m.
    pub radius_m: f64,
}

/// A part of the robot that could touch the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmPart {
    /// The ends of the fully opened fingers, and the tcp between them.
    FingerTips,
    /// The hand's body.
    Hand,
    /// Links 5 to 7, around the wrist centre and joint 7.
    Wrist,
    /// Links 3 and 4, around the elbow.
    Elbow,
}

/// All frames of the arm at one configuration, in the base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Links 1 to 7, from link 1.
    pub base_from_link: [Isometry3<f64>; NUM_JOINTS],
    /// The flange.
    pub base_from_flange: Isometry3<f64>,
    /// The hand.
    pub base_from_hand: Isometry3<f64>,
    /// The tool centre point between the fingertips.
    pub base_from_tcp: Isometry3<f64>,
}

impl ArmGeometry {
    /// The constant pose of the tcp relative to the flange.
    pub fn flange_from_tcp(&self) -> Isometry3<f64> {
        self.hand.flange_from_hand * Translation3::new(0.0, 0.0, self.hand.tcp_offset_m)
    }

    /// The constant pose of the hand relative to the last link.
    pub(crate) fn link7_from_hand(&self) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::new(0.0, 0.0, self.flange_offset_m), self.hand.flange_from_hand)
    }

    /// The pose of the tcp in the base frame, `base_from_tcp`.
    ///
    /// # Units and frames
    /// `q` in rad, result in m. Joint limits are not checked.
    pub fn forward(&self, q: &JointVector) -> Isometry3<f64> {
        self.base_from_flange(q) * self.flange_from_tcp()
    }

    /// The pose of the flange in the base frame.
    pub fn base_from_flange(&self, q: &JointVector) -> Isometry3<f64> {
        let mut base_from_link = Isometry3::identity();
        for joint_idx in 0..NUM_JOINTS {
            base_from_link *= self.joints[joint_idx].parent_from_link(q[joint_idx]);
        }
        base_from_link * Translation3::new(0.0, 0.0, self.flange_offset_m)
    }

    /// The poses of all frames in the base frame.
    pub fn frames(&self, q: &JointVector) -> Frames {
        let mut base_from_link = [Isometry3::identity(); NUM_JOINTS];
        let mut base_from_parent = Isometry3::identity();
        for joint_idx in 0..NUM_JOINTS {
            base_from_parent *= self.joints[joint_idx].parent_from_link(q[joint_idx]);
            base_from_link[joint_idx] = base_from_parent;
        }
        let base_from_flange = base_from_parent * Translation3::new(0.0, 0.0, self.flange_offset_m);
        Frames {
            base_from_link,
            base_from_flange,
            base_from_hand: base_from_flange * self.hand.flange_from_hand,
            base_from_tcp: base_from_flange * self.flange_from_tcp(),
        }
    }

    /// The geometric Jacobian of the tcp, in the base frame.
    ///
    /// # Shapes
    /// `J [6, 7]`, with `[v; ω] = J q̇`; see [`Jacobian`].
    pub fn jacobian(&self, q: &JointVector) -> Jacobian {
        self.forward_and_jacobian(q).1
    }

    /// `base_from_tcp` and the Jacobian together, from one pass over the chain.
    pub fn forward_and_jacobian(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian) {
        let frames = self.frames(q);
        let tcp = frames.base_from_tcp.translation.vector;
        let mut jacobian = Jacobian::zeros();
        for (joint_idx, base_from_link) in frames.base_from_link.iter().enumerate() {
            if self.limits.position_min[joint_idx] == self.limits.position_max[joint_idx] {
                continue;
            }
            let axis = base_from_link.rotation * Vector3::z();
            let lever = tcp - base_from_link.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, joint_idx).copy_from(&axis.cross(&lever));
            jacobian.fixed_view_mut::<3, 1>(3, joint_idx).copy_from(&axis);
        }
        (frames.base_from_tcp, jacobian)
    }
}

impl DhJoint {
    fn parent_from_link(&self, q: f64) -> Isometry3<f64> {
        // RotX(alpha)·TransX(a)·RotZ(q)·TransZ(d): the quaternion is the product of the two rotations.
        let (sin_half_a, cos_half_a) = (self.alpha_rad * 0.5).sin_cos();
        let (sin_half_q, cos_half_q) = (q * 0.5).sin_cos();
        let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(
            cos_half_a * cos_half_q,
            sin_half_a * cos_half_q,
            -sin_half_a * sin_half_q,
            cos_half_a * sin_half_q,
        ));
        let (sin_a, cos_a) = self.alpha_rad.sin_cos();
        let translation = Translation3::new(self.a_m, -sin_a * self.d_m, cos_a * self.d_m);
        Isometry3::from_parts(translation, rotation)
    }

    /// Sine and cosine of alpha, without rounding errors at ±π/2.
    #[inline(always)]
    pub(crate) fn twist(&self) -> (f64, f64) {
        if self.alpha_rad == 0.0 { (0.0, 1.0) } else { (self.alpha_rad.signum(), 0.0) }
    }
}

/// The twist in the base frame that moves `from` to `to` in unit time: rows 0–2 in metres, rows 3–5 in radians.
pub(crate) fn pose_error(from: &Isometry3<f64>, to: &Isometry3<f64>) -> nalgebra::Vector6<f64> {
    let linear = to.translation.vector - from.translation.vector;
    let angular = (to.rotation * from.rotation.inverse()).scaled_axis();
    nalgebra::Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::ready_pose;
    use crate::test_poses::random_configuration;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn at_zero_the_arm_stands_upright_with_the_hand_down() {
        let frames = ArmGeometry::panda().frames(&JointVector::zeros());
        // In m: straight up 0.333 + 0.316 + 0.384, forward 0.088 (the elbow's offsets cancel), down 0.107.
        let flange = frames.base_from_flange.translation.vector;
        assert!((flange - Vector3::new(0.088, 0.0, 0.926)).norm() < 1e-12);
        let z = frames.base_from_flange.rotation * Vector3::z();
        assert!((z + Vector3::z()).norm() < 1e-12);
        let tcp = frames.base_from_tcp.translation.vector;
        assert!((tcp - Vector3::new(0.088, 0.0, 0.8226)).norm() < 1e-12);
        // The hand is rotated by -π/4 about a z axis that points down: its x axis is at +π/4 seen from above.
        let x = frames.base_from_hand.rotation * Vector3::x();
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        assert!((x - Vector3::new(diagonal, diagonal, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn the_ready_pose_is_where_franka_has_it() {
        let base_from_tcp = ArmGeometry::panda().forward(&ready_pose());
        // From the base, in the plane y = 0, in m. The shoulder is at a height of 0.333. The upper arm leans back by
        // 45°: it is along (-s, s), and its offset is along (s, s). The forearm is level, with its offset of 0.0825
        // upwards. Joint 7 is 0.088 forward of the forearm's end; flange and tcp are straight below joint 7.
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let x = -0.316 * s + 0.0825 * s + 0.384 + 0.088;
        let z = 0.333 + 0.316 * s + 0.0825 * s + 0.0825 - 0.107 - 0.1034;
        let found = base_from_tcp.translation.vector;
        assert!((found - Vector3::new(x, 0.0, z)).norm() < 1e-12);
        // Franka's own O_T_EE in the ready pose: (0.3069, 0, 0.4869), z down, x forward.
        assert!((found - Vector3::new(0.3069, 0.0, 0.4869)).norm() < 1e-4);
        let rotation = base_from_tcp.rotation.to_rotation_matrix();
        let expected = nalgebra::Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        assert!((rotation.matrix() - expected).norm() < 1e-12);
    }

    #[test]
    fn the_turning_of_the_first_joint_turns_everything() {
        let panda = ArmGeometry::panda();
        let mut q = ready_pose();
        let before = panda.forward(&q);
        q[0] = 0.7;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
        let error = pose_error(&panda.forward(&q), &(turn * before));
        assert!(error.norm() < 1e-12);
    }

    #[test]
    fn the_jacobian_agrees_with_finite_differences() {
        // Central differences with a step of 1e-6 rad have an error of about 1e-9 for lengths below 1 m.
        const STEP_RAD: f64 = 1e-6;
        const TOLERANCE: f64 = 2e-8;
        let panda = ArmGeometry::panda();
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for _ in 0..200 {
            let q = random_configuration(&mut rng);
            let jacobian = panda.jacobian(&q);
            for joint_idx in 0..NUM_JOINTS {
                let mut step = JointVector::zeros();
                step[joint_idx] = STEP_RAD;
                let numeric = pose_error(&panda.forward(&(q - step)), &panda.forward(&(q + step))) / (2.0 * STEP_RAD);
                let error = (jacobian.column(joint_idx) - numeric).abs().max();
                assert!(error < TOLERANCE, "joint {} off by {error}", joint_idx + 1);
            }
        }
    }

    #[test]
    fn the_frames_agree_with_the_short_cuts() {
        let panda = ArmGeometry::panda();
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        for _ in 0..50 {
            let q = random_configuration(&mut rng);
            let frames = panda.frames(&q);
            assert!(pose_error(&frames.base_from_tcp, &panda.forward(&q)).norm() < 1e-12);
            assert!(pose_error(&frames.base_from_flange, &panda.base_from_flange(&q)).norm() < 1e-12);
            let tcp_in_hand = frames.base_from_hand.inverse() * frames.base_from_tcp;
            assert!((tcp_in_hand.translation.vector - Vector3::z() * 0.1034).norm() < 1e-12);
            assert!(tcp_in_hand.rotation.angle() < 1e-12);
        }
    }
}
