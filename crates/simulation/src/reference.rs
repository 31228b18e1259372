//! A workcell that is driven from outside, a millisecond at a time.

use sdg_kinematics::JointVector;

use crate::controller::ArmReference;
use crate::error::Result;
use crate::workcell::Workcell;

impl Workcell {
    /// One period on, with the controller's reference where positions (rad), velocities and accelerations say.
    ///
    /// # Errors
    /// [`SimulationError::Unstable`](crate::SimulationError::Unstable).
    pub fn advance(&mut self, q: &JointVector, dq: &JointVector, ddq: &JointVector) -> Result<()> {
        self.set_reference(ArmReference { position: *q, velocity: *dq, acceleration: *ddq });
        self.tick()
    }
}
