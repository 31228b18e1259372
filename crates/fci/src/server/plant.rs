//! The interface between the server and a simulated robot.

use nalgebra::{Isometry3, SMatrix, SVector};

/// Joint positions, velocities or torques, joint 1 first.
pub type JointVector = SVector<f64, 7>;
/// Linear (rows 0 to 2) and angular (rows 3 to 5) velocity in the base frame per joint velocity.
pub type Jacobian = SMatrix<f64, 6, 7>;

/// A robot at one instant. Units: rad, N·m, m, kg.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Joint positions.
    pub q: JointVector,
    /// Joint velocities.
    pub dq: JointVector,
    /// Joint-space inertia.
    pub mass: SMatrix<f64, 7, 7>,
    /// Torques that hold arm and hand against gravity, without the hand's load.
    pub gravity: JointVector,
    /// Coriolis and centrifugal torques.
    pub coriolis: JointVector,
    /// Torques of contacts on the joints, including the weight of the hand's load.
    pub contact_torque: JointVector,
    /// Whether links of the arm are closer to each other than allowed.
    pub self_collision: bool,
}

/// A simulated robot with a hand.
pub trait Plant: Send {
    /// The present state of the robot.
    fn observe(&mut self) -> Observation;

    /// `base_from_flange`, and the Jacobian of the flange's origin, at any joint positions.
    fn flange(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian);

    /// Advances the simulation by a millisecond with these motor torques, to which the plant adds nothing.
    ///
    /// # Errors
    /// The reason why the simulation ended, as text.
    fn step(&mut self, torque: &JointVector) -> Result<(), String>;

    /// Moves the fingers to a width (m, 0 to 0.08) at a speed (m/s), with at most this force (N); a negative width
    /// presses on any object between them.
    fn move_hand(&mut self, width_m: f64, speed_m_s: f64, force_n: f64);

    /// Distance between the fingers in m, and its rate in m/s.
    fn hand_width(&self) -> (f64, f64);
}
