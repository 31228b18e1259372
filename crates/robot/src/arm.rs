//! The trait of all arms: state, checked motions, hand, stop.

use sdg_kinematics::ArmGeometry;

use crate::arm_state::{ArmState, ContactSensitivity, HandCommand, HandState, Load, MotionEnd};
use crate::error::RobotError;
use crate::safety::CheckedMotion;
use crate::touch::{TouchDown, Touched};
use crate::watch::Watch;

/// An arm with a hand, simulated or real.
///
/// Calls block until what they ask for is done. An error leaves the arm at rest, or coming to rest by the robot's own means.
pub trait Arm {
    /// Its links, limits and hand.
    fn geometry(&self) -> &ArmGeometry;

    /// The present state of the arm.
    ///
    /// # Errors
    /// [`RobotError::Lost`] where it does not answer.
    fn state(&mut self) -> Result<ArmState, RobotError>;

    /// Follows a motion; `watch` sees every state on the way and says when to stop.
    ///
    /// # Errors
    /// [`RobotError::Stopped`] after a stop that `watch` asked for, and what the arm itself reports.
    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd, RobotError>;

    /// Stands still for some seconds; `watch` sees the states.
    ///
    /// # Errors
    /// As [`Arm::follow`].
    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<(), RobotError>;

    /// The present state of the hand.
    ///
    /// # Errors
    /// [`RobotError::Lost`] where it does not answer.
    fn hand(&mut self) -> Result<HandState, RobotError>;

    /// Begins a motion of the hand, which goes on beside the arm's.
    ///
    /// # Errors
    /// [`RobotError::Hand`] where it refuses.
    fn start_hand(&mut self, command: HandCommand) -> Result<(), RobotError>;

    /// Waits until the hand has ended what it was asked.
    ///
    /// # Errors
    /// [`RobotError::Hand`] where it failed or does not end, and as [`Arm::follow`].
    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState, RobotError>;

    /// Sets at which contact the arm stops by itself.
    ///
    /// # Errors
    /// What the arm reports.
    fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> Result<(), RobotError>;

    /// Tells the controller what the hand carries.
    ///
    /// # Errors
    /// What the arm reports.
    fn set_load(&mut self, load: Load) -> Result<(), RobotError>;

    /// Stops arm and hand at once.
    ///
    /// # Errors
    /// What the arm reports.
    fn stop(&mut self) -> Result<(), RobotError>;

    /// Recovers from a reflex or another error; the arm does not move by it.
    ///
    /// # Errors
    /// Where the error stays.
    fn recover(&mut self) -> Result<(), RobotError>;
}

/// An arm that takes torques, and so can yield to what it touches.
pub trait CompliantArm: Arm {
    /// Comes straight down from where the arm stands until something is felt, presses on it, and stands; `watch` sees every state.
    ///
    /// # Errors
    /// As [`Arm::follow`].
    fn touch_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> Result<Touched, RobotError>;
}
