//! Control of a workcell by its caller, millisecond by millisecond.

use sdg_kinematics::JointVector;

use crate::controller::ArmReference;
use crate::error::Result;
use crate::workcell::Workcell;

impl Workcell {
    /// Advances by one period, with the controller's reference at these positions (rad), velocities and accelerations.
    ///
    /// # Errors
    /// As for [`Data::step`](crate::Data::step).
    pub fn advance(&mut self, q: &JointVector, dq: &JointVector, ddq: &JointVector) -> Result<()> {
        self.set_reference(ArmReference { position: *q, velocity: *dq, acceleration: *ddq });
        self.tick()
    }
}
