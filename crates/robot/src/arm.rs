//! The trait of all arms: state, checked motions, hand, stop.

use sdg_kinematics::ArmGeometry;

use crate::arm_state::{ArmState, ContactSensitivity, HandCommand, HandState, Load, MotionEnd};
use crate::error::RobotError;
use crate::safety::CheckedMotion;
use crate::touch::{TouchDown, Touched};
use crate::watch::Watch;

/// An arm with a hand, simulated or real.
///
/// Calls except [`Arm::start_hand`] block until the requested action is done. After an error the arm has stopped, or
/// its own controller is stopping it.
pub trait Arm {
    /// Links, limits and hand of the arm.
    fn geometry(&self) -> &ArmGeometry;

    /// The present state of the arm.
    ///
    /// # Errors
    /// [`RobotError::Lost`] if the arm does not answer.
    fn state(&mut self) -> Result<ArmState, RobotError>;

    /// Follows a motion; `watch` receives every state on the path and decides when to stop.
    ///
    /// # Errors
    /// [`RobotError::Stopped`] after a stop requested by `watch`, and errors reported by the arm.
    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd, RobotError>;

    /// Stands still for `duration_secs`; `watch` receives every state.
    ///
    /// # Errors
    /// As for [`Arm::follow`].
    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<(), RobotError>;

    /// The present state of the hand.
    ///
    /// # Errors
    /// [`RobotError::Lost`] if the hand does not answer; [`RobotError::Hand`] if its last command failed.
    fn hand(&mut self) -> Result<HandState, RobotError>;

    /// Starts a motion of the hand, which runs in parallel with the arm's.
    ///
    /// # Errors
    /// [`RobotError::Hand`] if the hand refuses the command; [`RobotError::Latched`] or [`RobotError::Stopped`] if the
    /// arm reports that it was stopped.
    fn start_hand(&mut self, command: HandCommand) -> Result<(), RobotError>;

    /// Waits until the hand has finished its command.
    ///
    /// # Errors
    /// [`RobotError::Hand`] if the command failed or does not end, and as for [`Arm::follow`].
    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState, RobotError>;

    /// Sets the contact threshold at which the arm stops by itself.
    ///
    /// # Errors
    /// Errors reported by the arm.
    fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> Result<(), RobotError>;

    /// Tells the controller the load of the hand.
    ///
    /// # Errors
    /// Errors reported by the arm.
    fn set_load(&mut self, load: Load) -> Result<(), RobotError>;

    /// Stops arm and hand at once. A hand at rest keeps holding its part.
    ///
    /// # Errors
    /// Errors reported by the arm.
    fn stop(&mut self) -> Result<(), RobotError>;

    /// Recovers from a reflex or another error, without moving the arm.
    ///
    /// # Errors
    /// The error, if it persists.
    fn recover(&mut self) -> Result<(), RobotError>;
}

/// An arm that accepts torques and can therefore be compliant.
pub trait CompliantArm: Arm {
    /// Moves straight down from the arm's position until the arm measures a contact, or to the end of the path. Presses
    /// on the touched surface and stops; `watch` receives every state.
    ///
    /// # Errors
    /// As for [`Arm::follow`].
    fn touch_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> Result<Touched, RobotError>;
}
