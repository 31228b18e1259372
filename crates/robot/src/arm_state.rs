//! States of an arm and its hand, and commands to them, as plain values.

use std::ops::RangeInclusive;

use sdg_kinematics::JointVector;

/// Time between two commands of an arm that gets a command in every cycle (1 kHz), s.
pub const PERIOD_SECS: f64 = 1e-3;

/// Mode of the arm's controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmMode {
    /// The arm holds its position and accepts commands.
    Idle,
    /// The arm follows a motion.
    Moving,
    /// A person moves the arm by hand.
    Guiding,
    /// The arm stopped by itself, after a contact or a command that it could not follow, and must be recovered.
    Reflex,
    /// The stop button is pressed, or the brakes are closed.
    UserStopped,
    /// The arm recovers from an error.
    Recovering,
}

impl ArmMode {
    /// The name in messages and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Moving => "moving",
            Self::Guiding => "guiding",
            Self::Reflex => "reflex",
            Self::UserStopped => "user stopped",
            Self::Recovering => "recovering",
        }
    }
}

/// The arm's measurements at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmState {
    /// The arm's own clock, in seconds.
    pub time_secs: f64,
    /// Measured joint positions, rad.
    pub q: JointVector,
    /// Measured joint velocities, rad/s.
    pub dq: JointVector,
    /// Commanded joint positions, rad: the controller's reference.
    pub q_commanded: JointVector,
    /// Estimated external torques, N·m; zeros if the arm does not estimate them.
    pub tau_external_nm: JointVector,
    /// Mode of the controller.
    pub mode: ArmMode,
}

/// The state of the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandState {
    /// Distance between the fingers, m.
    pub opening_m: f64,
    /// Whether the hand presses on an object with the commanded force, at a width near the commanded one.
    pub is_grasping: bool,
    /// Force of each finger, N, if the hand measures it.
    pub force_n: Option<f64>,
}

/// A command for the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HandCommand {
    /// Move to an opening.
    Move {
        /// Distance between the fingers, m.
        opening_m: f64,
        /// Speed at which that distance changes, m/s.
        speed_m_s: f64,
    },
    /// Close until the fingers meet resistance.
    Grasp {
        /// The part's width between the fingers, m. Only the final widths [`held_widths_m`] are a grasp.
        width_m: f64,
        /// Tolerances below (first) and above (second) that width, m.
        tolerance_m: [f64; 2],
        /// Speed at which the opening changes, m/s.
        speed_m_s: f64,
        /// Force of each finger, N.
        force_n: f64,
    },
}

/// Tolerances below (first) and above (second) a part's width in a picture, m. The tolerances are wide because a width
/// measured in a picture is accurate to a few millimetres only, and a round part may be gripped beside its thickest
/// point. [`MIN_HELD_WIDTH_M`] detects a hand that closed without a part.
pub const GRASP_TOLERANCE_M: [f64; 2] = [0.03, 0.03];
/// Fingers closer together than this hold nothing, m.
pub const MIN_HELD_WIDTH_M: f64 = 0.001;
/// Largest change of the fingers' opening since they closed, m; a larger one means that the part is lost or released.
pub const MAX_WIDTH_CHANGE_M: f64 = 0.005;

/// The final widths, m, at which a hand holds a part, for the width and the tolerances of [`HandCommand::Grasp`].
pub fn held_widths_m(width_m: f64, [thinner_m, wider_m]: [f64; 2]) -> RangeInclusive<f64> {
    (width_m - thinner_m).max(MIN_HELD_WIDTH_M)..=width_m + wider_m
}

/// The load of the hand, for the controller's gravity compensation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the flange's frame, m.
    pub center_in_flange_m: [f64; 3],
}

impl Load {
    /// No load.
    pub const NONE: Self = Self { mass_kg: 0.0, center_in_flange_m: [0.0; 3] };
}

/// Contact threshold at which the arm stops by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactSensitivity {
    /// In free motion, where nothing may touch the arm: low thresholds.
    Free,
    /// On straight motions near the table, where the table and the part exert forces.
    Contact,
}

/// The end of a motion that did not fail.
#[derive(Debug, Clone, PartialEq)]
pub enum MotionEnd {
    /// The arm is at the motion's end.
    Arrived,
    /// An obstacle stopped the arm; the text describes the contact.
    Blocked(String),
}
