//! The limit that a motion violates.

use sdg_kinematics::{JointVector, NUM_JOINTS};

use crate::safety::self_collision::SelfCollision;

/// The first limit that a motion violates; times in seconds from the motion's start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum Violation {
    /// The motion does not start at the arm's position.
    #[error("it starts {apart_rad:.3} rad from the position of joint {joint}, at most {max_rad:.3} are allowed")]
    StartsElsewhere {
        /// Joint number, 1 to 7.
        joint: usize,
        apart_rad: f64,
        max_rad: f64,
    },
    /// A value that is not finite.
    #[error("at {time_secs:.3} s joint {joint} has no finite position, velocity or acceleration")]
    NotFinite {
        time_secs: f64,
        /// Joint number, 1 to 7.
        joint: usize,
    },
    /// The position, velocity, acceleration or jerk of a joint is outside its limits.
    #[error(
        "at {time_secs:.3} s the {quantity} of joint {joint} is {found:.4} {unit}, allowed is {min:.4} to {max:.4}"
    )]
    Joint {
        time_secs: f64,
        /// Position, velocity, acceleration or jerk.
        quantity: &'static str,
        /// Joint number, 1 to 7.
        joint: usize,
        found: f64,
        min: f64,
        max: f64,
        unit: &'static str,
    },
    /// The velocity, acceleration or jerk of the tcp exceeds its limit.
    #[error("at {time_secs:.3} s the {quantity} of the tcp is {found:.3} {unit}, at most {max:.3} are allowed")]
    Cartesian {
        time_secs: f64,
        /// Velocity, acceleration or jerk, linear or angular.
        quantity: &'static str,
        found: f64,
        max: f64,
        /// Unit of the values, such as m/s or rad/s².
        unit: &'static str,
    },
    /// The hand leaves the workspace.
    #[error(
        "at {time_secs:.3} s the {part} is at {axis} = {found_m:.4} m, outside the workspace of {min_m:.4} to {max_m:.4} m"
    )]
    Workspace {
        time_secs: f64,
        part: &'static str,
        /// x, y or z of the base frame.
        axis: char,
        found_m: f64,
        min_m: f64,
        max_m: f64,
    },
    /// Finger tips, hand, wrist or elbow come too close to the table.
    #[error("at {time_secs:.3} s the {part} is {found_mm:.1} mm above the table, at least {min_mm:.1} mm are required")]
    Table {
        time_secs: f64,
        /// Finger tips, hand, wrist or elbow.
        part: &'static str,
        /// Height above the table, mm; negative below.
        found_mm: f64,
        min_mm: f64,
    },
    /// A hand that descended to a contact lower than the limits allow does not move straight up.
    #[error(
        "at {time_secs:.3} s the hand, lower than the limits allow after it came down by contact, is {beside_mm:.1} \
         mm beside the vertical path and {down_mm:.1} mm lower than before"
    )]
    Leaving { time_secs: f64, beside_mm: f64, down_mm: f64 },
    /// The arm comes too close to itself.
    #[error("at {time_secs:.3} s {collision}")]
    SelfCollision { time_secs: f64, collision: SelfCollision },
}

impl Violation {
    /// Checks that a motion starts at most `max_rad` from a position of the arm, in each joint.
    ///
    /// # Errors
    /// [`Violation::StartsElsewhere`] for the first joint that is farther away or has no position.
    pub fn check_start(start: &JointVector, q: &JointVector, max_rad: f64) -> Result<(), Self> {
        let apart = (start - q).abs();
        match (0..NUM_JOINTS).find(|&idx| apart[idx].is_nan() || apart[idx] > max_rad) {
            None => Ok(()),
            Some(idx) => Err(Self::StartsElsewhere { joint: idx + 1, apart_rad: apart[idx], max_rad }),
        }
    }
}
