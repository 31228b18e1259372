//! Dynamics of the arm: its masses, and the joint torques of a motion.
//!
//! `τ = M(q) q̈ + C(q, q̇) q̇ + g(q) + rotor inertia · q̈ + damping · q̇`, by the recursive Newton-Euler algorithm:
//! velocities and accelerations of the links are computed from the base outwards, forces and torques inwards. The same
//! pass gives the tcp's velocity and acceleration.
//!
//! # Source
//! J. Craig, "Introduction to Robotics", chapter 6 (frames by modified Denavit-Hartenberg parameters).

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::geometry::{ArmGeometry, DhJoint};
pub use crate::inertia::LinkInertia;
use crate::joints::{JointVector, NUM_JOINTS};

/// Acceleration of gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Masses of the arm and its load; fingers and load are at rest in the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmDynamics {
    joints: [DhJoint; NUM_JOINTS],
    /// Distance from link 7 to the flange along z, m.
    flange_offset_m: f64,
    /// Distance from the flange to the tcp along z, m.
    tcp_offset_m: f64,
    /// Links 1 to 7 in their frames (Denavit and Hartenberg); link 7 includes hand, fingers, camera and load.
    links: [LinkInertia; NUM_JOINTS],
    /// Inertia of the motors and gears behind each joint, kg·m².
    rotor_inertia: JointVector,
    /// Viscous friction of each joint, N·m·s/rad.
    damping: JointVector,
}

/// Motion of the tcp relative to the base: linear in m/s and m/s², angular in rad/s and rad/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TcpMotion {
    pub(crate) velocity: Vector3<f64>,
    pub(crate) angular_velocity: Vector3<f64>,
    pub(crate) acceleration: Vector3<f64>,
    pub(crate) angular_acceleration: Vector3<f64>,
}

/// Rotations of the links and the tcp at a configuration, for several motions through it.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    /// The axes of each link in its parent's frame.
    parent_from_link: [Matrix3<f64>; NUM_JOINTS],
    base_from_tcp: Matrix3<f64>,
}

impl ArmDynamics {
    /// The dynamics of an arm with its hand, the fingers at an opening (m), without a load.
    pub fn new(arm: &ArmGeometry, opening_m: f64) -> Self {
        let mut links = arm.links;
        let link7_from_hand = arm.link7_from_hand();
        links[NUM_JOINTS - 1].add(&arm.hand.inertia, &link7_from_hand);
        let finger = &arm.hand.finger;
        let [from_pad_m, z_m] = finger.center_m;
        for side in [1.0, -1.0] {
            let center_m = [0.0, side * (from_pad_m + 0.5 * opening_m), z_m];
            let one = LinkInertia::new(finger.mass_kg, center_m, finger.inertia);
            links[NUM_JOINTS - 1].add(&one, &link7_from_hand);
        }
        Self {
            joints: arm.joints,
            flange_offset_m: arm.flange_offset_m,
            tcp_offset_m: arm.hand.tcp_offset_m,
            links,
            rotor_inertia: arm.rotor_inertia,
            damping: arm.damping,
        }
    }

    /// Adds a load as a point mass: its mass (kg) and its centre in the flange's frame (m).
    ///
    /// # Panics
    /// For a negative mass or numbers that are not finite.
    pub fn with_load(mut self, mass_kg: f64, center_in_flange_m: [f64; 3]) -> Self {
        assert!(mass_kg >= 0.0 && mass_kg.is_finite(), "a mass is not negative, found {mass_kg} kg");
        assert!(center_in_flange_m.iter().all(|x| x.is_finite()), "{center_in_flange_m:?} m is not a finite position");
        let load = LinkInertia::new(mass_kg, center_in_flange_m, [0.0; 3]);
        self.links[NUM_JOINTS - 1].add(&load, &Isometry3::translation(0.0, 0.0, self.flange_offset_m));
        self
    }

    /// The torques (N·m) of a motion: positions in rad, velocities in rad/s, accelerations in rad/s².
    pub fn torques_nm(&self, q: &JointVector, velocity: &JointVector, acceleration: &JointVector) -> JointVector {
        let (torques, _) = self.of_motion(&self.placed(q), velocity, acceleration, GRAVITY_M_S2);
        torques + self.damping.component_mul(velocity)
    }

    /// The torques that hold the arm at rest against gravity, N·m.
    pub fn gravity_nm(&self, q: &JointVector) -> JointVector {
        let zero = JointVector::zeros();
        self.of_motion(&self.placed(q), &zero, &zero, GRAVITY_M_S2).0
    }

    /// The rotations of the links and the tcp at a configuration.
    pub(crate) fn placed(&self, q: &JointVector) -> Placed {
        let parent_from_link: [Matrix3<f64>; NUM_JOINTS] = std::array::from_fn(|joint| {
            let (sin_a, cos_a) = self.joints[joint].twist();
            let (sin_q, cos_q) = q[joint].sin_cos();
            Matrix3::new(cos_q, -sin_q, 0.0, sin_q * cos_a, cos_q * cos_a, -sin_a, sin_q * sin_a, cos_q * sin_a, cos_a)
        });
        // The hand's rotation about z changes neither lengths of vectors nor the axis to the tcp.
        let base_from_tcp = parent_from_link.iter().fold(Matrix3::identity(), |product, turn| product * turn);
        Placed { parent_from_link, base_from_tcp }
    }

    /// Viscous friction of each joint, N·m·s/rad.
    pub(crate) fn damping(&self) -> &JointVector {
        &self.damping
    }

    /// Torques without friction (N·m), and the tcp's motion in the base frame.
    pub(crate) fn of_motion(
        &self,
        placed: &Placed,
        velocity: &JointVector,
        acceleration: &JointVector,
        gravity_m_s2: f64,
    ) -> (JointVector, TcpMotion) {
        let zero = Vector3::zeros();
        // Motion of the parent, in its own frame. An upward acceleration of the base replaces gravity.
        let (mut turning, mut turning_rate) = (zero, zero);
        let (mut moving, mut moving_rate) = (zero, Vector3::new(0.0, 0.0, gravity_m_s2));
        let mut forces = [(zero, zero); NUM_JOINTS];
        for joint in 0..NUM_JOINTS {
            let link_from_parent = placed.parent_from_link[joint].transpose();
            let place = place_in_parent(&self.joints[joint]);
            moving = link_from_parent * (moving + turning.cross(&place));
            moving_rate =
                link_from_parent * (moving_rate + turning_rate.cross(&place) + turning.cross(&turning.cross(&place)));
            let carried = link_from_parent * turning;
            let spin = Vector3::new(0.0, 0.0, velocity[joint]);
            turning = carried + spin;
            turning_rate =
                link_from_parent * turning_rate + carried.cross(&spin) + Vector3::new(0.0, 0.0, acceleration[joint]);
            forces[joint] = self.links[joint].force_and_torque(&moving_rate, &turning, &turning_rate);
        }
        let to_tcp = Vector3::new(0.0, 0.0, self.flange_offset_m + self.tcp_offset_m);
        let tcp_rate = moving_rate + turning_rate.cross(&to_tcp) + turning.cross(&turning.cross(&to_tcp));
        let tcp = TcpMotion {
            velocity: placed.base_from_tcp * (moving + turning.cross(&to_tcp)),
            angular_velocity: placed.base_from_tcp * turning,
            acceleration: placed.base_from_tcp * tcp_rate - Vector3::new(0.0, 0.0, gravity_m_s2),
            angular_acceleration: placed.base_from_tcp * turning_rate,
        };

        let mut torques = self.rotor_inertia.component_mul(acceleration);
        let (mut force, mut torque) = (zero, zero);
        for joint in (0..NUM_JOINTS).rev() {
            force += forces[joint].0;
            torque += forces[joint].1;
            torques[joint] += torque.z;
            let in_parent = placed.parent_from_link[joint] * force;
            torque = placed.parent_from_link[joint] * torque + place_in_parent(&self.joints[joint]).cross(&in_parent);
            force = in_parent;
        }
        (torques, tcp)
    }
}

fn place_in_parent(joint: &DhJoint) -> Vector3<f64> {
    let (sin_a, cos_a) = joint.twist();
    Vector3::new(joint.a_m, -sin_a * joint.d_m, cos_a * joint.d_m)
}

#[cfg(test)]
mod tests;
