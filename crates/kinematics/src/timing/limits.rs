//! All limits of a motion.

use crate::dynamics::ArmDynamics;
use crate::limits::{CartesianLimits, JointLimits};

/// The limits of a motion along a rounded path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotionLimits<'a> {
    pub(crate) joints: &'a JointLimits,
    pub(crate) cartesian: &'a CartesianLimits,
    pub(crate) dynamics: &'a ArmDynamics,
}
