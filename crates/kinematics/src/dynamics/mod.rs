//! Torques of the arm: masses, and what the joints have to exert for a motion.
//!
//! `τ = M(q) q̈ + C(q, q̇) q̇ + g(q) + rotor inertia · q̈ + damping · q̇`, by the recursive Newton-Euler algorithm: velocities and accelerations of
//! the links go outwards from the base, forces and torques back. The tcp's velocity and acceleration come of the same pass.
//!
//! # Source
//! J. Craig, "Introduction to Robotics", chapter 6 (frames by modified Denavit-Hartenberg parameters).

mod inertia;

pub use inertia::LinkInertia;

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::joints::{JointVector, NUM_JOINTS};
use crate::panda::{DH_A_M, DH_ALPHA_RAD, DH_D_M, FLANGE_OFFSET_M, HAND_TURN_RAD, TCP_OFFSET_M};

/// Acceleration of free fall, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Masses of the arm and of what it carries, fingers and load at rest in the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmDynamics {
    /// Links 1 to 7 in their frames by Denavit and Hartenberg; link 7 with hand, fingers, camera and load.
    links: [LinkInertia; NUM_JOINTS],
    /// Inertia of the motors and gears behind each joint, kg·m².
    rotor_inertia: JointVector,
    /// Viscous friction of each joint, N·m·s/rad.
    damping: JointVector,
}

/// Motion of a link against the base, and its turn: linear in m/s and m/s², angular in rad/s and rad/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TcpMotion {
    pub(crate) velocity: Vector3<f64>,
    pub(crate) angular_velocity: Vector3<f64>,
    pub(crate) acceleration: Vector3<f64>,
    pub(crate) angular_acceleration: Vector3<f64>,
}

/// The turns and places of the links at a configuration, to be used for several motions there.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    /// Each link's axes in its parent's frame.
    parent_from_link: [Matrix3<f64>; NUM_JOINTS],
    base_from_tcp: Matrix3<f64>,
}

impl ArmDynamics {
    /// The arm with Franka's hand and a small camera, the fingers at an opening (m), holding nothing.
    ///
    /// # Source
    /// Franka publishes no masses. These are the simulated arm's (crates/simulation/assets/panda.xml): plausible, not identified.
    pub fn panda(opening_m: f64) -> Self {
        let link = |mass_kg, center_m: [f64; 3], diagonal: [f64; 3]| LinkInertia::new(mass_kg, center_m, diagonal);
        let mut links = [
            link(2.8, [0.0, -0.03, -0.08], [0.017, 0.017, 0.006]),
            link(2.6, [0.0, -0.08, 0.03], [0.016, 0.006, 0.016]),
            link(2.7, [0.03, 0.02, -0.06], [0.013, 0.013, 0.007]),
            link(2.6, [-0.04, 0.04, 0.02], [0.012, 0.008, 0.013]),
            link(2.4, [0.0, 0.04, -0.12], [0.020, 0.018, 0.005]),
            link(1.5, [0.05, 0.01, 0.005], [0.003, 0.005, 0.005]),
            link(0.75, [0.01, 0.0, 0.07], [0.0010, 0.0010, 0.0008]),
        ];
        let hand = link(0.85, [0.01, 0.0, 0.035], [0.0027, 0.0010, 0.0030]);
        links[NUM_JOINTS - 1].add(&hand, &link7_from_hand());
        for side in [1.0, -1.0] {
            let finger = link(0.06, [0.0, side * (0.010 + 0.5 * opening_m), 0.0784], [1.5e-5, 1.5e-5, 5e-6]);
            links[NUM_JOINTS - 1].add(&finger, &link7_from_hand());
        }
        Self { links, rotor_inertia: JointVector::repeat(0.1), damping: JointVector::repeat(0.5) }
    }

    /// The same with a load: its mass (kg) and its centre in the flange's frame (m), as a point.
    ///
    /// # Panics
    /// For a negative mass or numbers that are not finite.
    pub fn with_load(mut self, mass_kg: f64, center_in_flange_m: [f64; 3]) -> Self {
        assert!(mass_kg >= 0.0 && mass_kg.is_finite(), "a mass is not negative, found {mass_kg} kg");
        assert!(center_in_flange_m.iter().all(|x| x.is_finite()), "{center_in_flange_m:?} m is no place");
        let load = LinkInertia::new(mass_kg, center_in_flange_m, [0.0; 3]);
        self.links[NUM_JOINTS - 1].add(&load, &Isometry3::translation(0.0, 0.0, FLANGE_OFFSET_M));
        self
    }

    /// The torques (N·m) of a motion: positions in rad, velocities in rad/s, accelerations in rad/s².
    pub fn torques_nm(&self, q: &JointVector, velocity: &JointVector, acceleration: &JointVector) -> JointVector {
        let (torques, _) = self.of_motion(&Placed::new(q), velocity, acceleration, GRAVITY_M_S2);
        torques + self.damping.component_mul(velocity)
    }

    /// What holds the arm against its weight, N·m.
    pub fn gravity_nm(&self, q: &JointVector) -> JointVector {
        let zero = JointVector::zeros();
        self.of_motion(&Placed::new(q), &zero, &zero, GRAVITY_M_S2).0
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
        // Of the parent, in its own frame; the base is accelerated upwards in place of gravity.
        let (mut turning, mut turning_rate) = (zero, zero);
        let (mut moving, mut moving_rate) = (zero, Vector3::new(0.0, 0.0, gravity_m_s2));
        let mut forces = [(zero, zero); NUM_JOINTS];
        for joint in 0..NUM_JOINTS {
            let link_from_parent = placed.parent_from_link[joint].transpose();
            let place = place_in_parent(joint);
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
        let to_tcp = Vector3::new(0.0, 0.0, FLANGE_OFFSET_M + TCP_OFFSET_M);
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
            torque = placed.parent_from_link[joint] * torque + place_in_parent(joint).cross(&in_parent);
            force = in_parent;
        }
        (torques, tcp)
    }
}

impl Placed {
    pub(crate) fn new(q: &JointVector) -> Self {
        let parent_from_link: [Matrix3<f64>; NUM_JOINTS] = std::array::from_fn(|joint| {
            let (sin_a, cos_a) = twist(joint);
            let (sin_q, cos_q) = q[joint].sin_cos();
            Matrix3::new(cos_q, -sin_q, 0.0, sin_q * cos_a, cos_q * cos_a, -sin_a, sin_q * sin_a, cos_q * sin_a, cos_a)
        });
        // The hand's turn about z leaves vectors' lengths and the axis to the tcp as they are.
        let base_from_tcp = parent_from_link.iter().fold(Matrix3::identity(), |product, turn| product * turn);
        Self { parent_from_link, base_from_tcp }
    }
}

/// Sine and cosine of a link's twist, which is 0 or a right angle.
fn twist(joint: usize) -> (f64, f64) {
    if DH_ALPHA_RAD[joint] == 0.0 { (0.0, 1.0) } else { (DH_ALPHA_RAD[joint].signum(), 0.0) }
}

fn place_in_parent(joint: usize) -> Vector3<f64> {
    let (sin_a, cos_a) = twist(joint);
    Vector3::new(DH_A_M[joint], -sin_a * DH_D_M[joint], cos_a * DH_D_M[joint])
}

fn link7_from_hand() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), HAND_TURN_RAD);
    Isometry3::from_parts(Vector3::new(0.0, 0.0, FLANGE_OFFSET_M).into(), turn)
}

#[cfg(test)]
mod tests;
