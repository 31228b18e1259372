//! The arm's geometry: forward kinematics and Jacobian.
//!
//! Modified (Craig) Denavit–Hartenberg convention: frame *i* is turned by `q[i]` about its own z axis, and
//! `link(i-1)_from_link(i) = RotX(alpha) · TransX(a) · RotZ(q) · TransZ(d)`.
//!
//! Frames: `base` (z up, x forward), `link 1..7` (on the joint axes), `flange` (0.107 m along z of link 7),
//! `hand` (the flange turned by -π/4 about z), `tcp` (0.1034 m along z of the hand, between the finger tips).
//! The fingers open along y of `hand` and `tcp`; z points out of the hand.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Isometry3, SMatrix, Translation3, UnitQuaternion, Vector3};

use crate::joints::{JointVector, NUM_JOINTS};
use crate::limits::JointLimits;

/// A geometric Jacobian: rows 0–2 the linear velocity (m/s), rows 3–5 the angular velocity (rad/s), per rad/s of a joint.
pub type Jacobian = SMatrix<f64, 6, NUM_JOINTS>;

/// Craig's `a` of each joint, m.
pub const DH_A_M: [f64; NUM_JOINTS] = [0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088];
/// Craig's `d` of each joint, m.
pub const DH_D_M: [f64; NUM_JOINTS] = [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0];
/// Craig's `alpha` of each joint, rad.
pub const DH_ALPHA_RAD: [f64; NUM_JOINTS] = [0.0, -FRAC_PI_2, FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, FRAC_PI_2];
/// Link 7 to flange along z, m.
pub const FLANGE_OFFSET_M: f64 = 0.107;
/// Turn of the hand against the flange about z, rad.
pub const HAND_TURN_RAD: f64 = -FRAC_PI_4;
/// Flange to tcp along z, m.
pub const TCP_OFFSET_M: f64 = 0.1034;
/// Largest opening between the fingers, m.
pub const HAND_OPENING_MAX_M: f64 = 0.08;

/// Every frame of the arm at one configuration, in the base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Links 1 to 7, link 1 first.
    pub base_from_link: [Isometry3<f64>; NUM_JOINTS],
    /// The pose of the flange, 0.107 m along z of link 7.
    pub base_from_flange: Isometry3<f64>,
    /// The hand: the flange turned by [`HAND_TURN_RAD`].
    pub base_from_hand: Isometry3<f64>,
    /// The tool centre point between the finger tips.
    pub base_from_tcp: Isometry3<f64>,
}

/// A Franka Panda with its hand.
#[derive(Debug, Clone)]
pub struct Panda {
    pub(crate) limits: JointLimits,
    pub(crate) flange_from_tcp: Isometry3<f64>,
}

impl Panda {
    /// The arm with Franka's hand and published limits.
    pub fn new() -> Self {
        Self {
            limits: JointLimits::franka(),
            flange_from_tcp: flange_from_hand() * Translation3::new(0.0, 0.0, TCP_OFFSET_M),
        }
    }

    /// The joint limits that inverse kinematics and paths respect.
    pub fn limits(&self) -> &JointLimits {
        &self.limits
    }

    /// The tcp as seen from the flange: constant.
    pub fn flange_from_tcp(&self) -> &Isometry3<f64> {
        &self.flange_from_tcp
    }

    /// The pose of the tcp in the base frame, `base_from_tcp`.
    ///
    /// # Units and frames
    /// `q` in rad, result in m. Joint limits are not checked.
    pub fn forward(&self, q: &JointVector) -> Isometry3<f64> {
        self.base_from_flange(q) * self.flange_from_tcp
    }

    /// The pose of the flange in the base frame.
    pub fn base_from_flange(&self, q: &JointVector) -> Isometry3<f64> {
        let mut base_from_link = Isometry3::identity();
        for joint_idx in 0..NUM_JOINTS {
            base_from_link *= parent_from_link(joint_idx, q[joint_idx]);
        }
        base_from_link * Translation3::new(0.0, 0.0, FLANGE_OFFSET_M)
    }

    /// The poses of all frames in the base frame.
    pub fn frames(&self, q: &JointVector) -> Frames {
        let mut base_from_link = [Isometry3::identity(); NUM_JOINTS];
        let mut base_from_parent = Isometry3::identity();
        for joint_idx in 0..NUM_JOINTS {
            base_from_parent *= parent_from_link(joint_idx, q[joint_idx]);
            base_from_link[joint_idx] = base_from_parent;
        }
        let base_from_flange = base_from_parent * Translation3::new(0.0, 0.0, FLANGE_OFFSET_M);
        Frames {
            base_from_link,
            base_from_flange,
            base_from_hand: base_from_flange * flange_from_hand(),
            base_from_tcp: base_from_flange * self.flange_from_tcp,
        }
    }

    /// The geometric Jacobian of the tcp, in the base frame.
    ///
    /// # Shapes
    /// `J [6, 7]`, with `[v; ω] = J q̇`; see [`Jacobian`].
    pub fn jacobian(&self, q: &JointVector) -> Jacobian {
        self.forward_and_jacobian(q).1
    }

    /// `base_from_tcp` and the Jacobian together, at the cost of one pass over the chain.
    pub fn forward_and_jacobian(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian) {
        let frames = self.frames(q);
        let tcp = frames.base_from_tcp.translation.vector;
        let mut jacobian = Jacobian::zeros();
        for (joint_idx, base_from_link) in frames.base_from_link.iter().enumerate() {
            let axis = base_from_link.rotation * Vector3::z();
            let lever = tcp - base_from_link.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, joint_idx).copy_from(&axis.cross(&lever));
            jacobian.fixed_view_mut::<3, 1>(3, joint_idx).copy_from(&axis);
        }
        (frames.base_from_tcp, jacobian)
    }
}

impl Default for Panda {
    fn default() -> Self {
        Self::new()
    }
}

fn flange_from_hand() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), HAND_TURN_RAD)
}

fn parent_from_link(joint_idx: usize, q: f64) -> Isometry3<f64> {
    // RotX(alpha)·TransX(a)·RotZ(q)·TransZ(d): alpha is 0 or ±π/2, the quaternion is the product of the two turns.
    let (sin_half_a, cos_half_a) = (DH_ALPHA_RAD[joint_idx] * 0.5).sin_cos();
    let (sin_half_q, cos_half_q) = (q * 0.5).sin_cos();
    let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(
        cos_half_a * cos_half_q,
        sin_half_a * cos_half_q,
        -sin_half_a * sin_half_q,
        cos_half_a * sin_half_q,
    ));
    let (sin_a, cos_a) = DH_ALPHA_RAD[joint_idx].sin_cos();
    let d = DH_D_M[joint_idx];
    let translation = Translation3::new(DH_A_M[joint_idx], -sin_a * d, cos_a * d);
    Isometry3::from_parts(translation, rotation)
}

/// The twist in the base frame that takes `from` to `to` in unit time: rows 0–2 metres, rows 3–5 radians.
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
        let frames = Panda::new().frames(&JointVector::zeros());
        // Straight up 0.333 + 0.316 + 0.384, forward 0.088 (the elbow's offsets cancel), down 0.107.
        let flange = frames.base_from_flange.translation.vector;
        assert!((flange - Vector3::new(0.088, 0.0, 0.926)).norm() < 1e-12);
        let z = frames.base_from_flange.rotation * Vector3::z();
        assert!((z + Vector3::z()).norm() < 1e-12);
        let tcp = frames.base_from_tcp.translation.vector;
        assert!((tcp - Vector3::new(0.088, 0.0, 0.8226)).norm() < 1e-12);
        // The hand is turned by -π/4 about a z that points down: its x axis is at +π/4 seen from above.
        let x = frames.base_from_hand.rotation * Vector3::x();
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        assert!((x - Vector3::new(diagonal, diagonal, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn the_ready_pose_is_where_franka_has_it() {
        let base_from_tcp = Panda::new().forward(&ready_pose());
        // In the plane y = 0, from the base: shoulder at height 0.333; upper arm leaning back by 45°, so (-s, s) along it
        // and (s, s) across; forearm level, its offset of 0.0825 upwards; 0.088 forward; flange and tcp straight down.
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
        let panda = Panda::new();
        let mut q = ready_pose();
        let before = panda.forward(&q);
        q[0] = 0.7;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
        let error = pose_error(&panda.forward(&q), &(turn * before));
        assert!(error.norm() < 1e-12);
    }

    #[test]
    fn the_jacobian_agrees_with_finite_differences() {
        // Central differences at 1e-6 rad of lengths below 1 m are good to about 1e-9.
        const STEP_RAD: f64 = 1e-6;
        const TOLERANCE: f64 = 2e-8;
        let panda = Panda::new();
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
        let panda = Panda::new();
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
