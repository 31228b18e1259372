//! Limits for moving up, and only up, from a contact below the limits.

use nalgebra::Vector3;
use sdg_kinematics::{JointVector, Trajectory};

use super::limits::{CheckedMotion, SafetyLimits};
use super::violation::Violation;
use crate::arm_state::PERIOD_SECS;

/// Largest descent that does not count as moving lower, m: the tcp's path is curved if the path in joint space is
/// straight, and the reference may be lower than the measured position.
const ASCENT_TOLERANCE_M: f64 = 0.5e-3;
/// Largest distance of the reference below the measured tcp while the arm rests on an object, m.
const BELOW_MEASURED_M: f64 = 1e-3;
/// Largest sideways distance of a compliant tcp from the descent, m: joint friction and contact forces push it.
const MAX_DESCENT_OFFSET_M: f64 = 5e-3;
/// Largest sideways distance of the hand from its contact position until it is as high as the limits require, m.
const MAX_ASCENT_OFFSET_M: f64 = 1e-3;

/// Position of a hand that came straight down to a contact and may therefore be lower than the limits allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FeltBelow {
    /// x and y of the tcp on the descent, base frame, m.
    at_m: [f64; 2],
    /// The lowest z at which the tcp counts as being on the descent, base frame, m.
    lowest_m: f64,
    /// Distance below the limits that was allowed for the descent, m.
    below_limits_m: f64,
}

/// The limits of a motion from a configuration: unchanged, or lowered for a hand that leaves a contact.
#[derive(Debug)]
pub(crate) struct LimitsFrom<'l> {
    limits: &'l SafetyLimits,
    /// The limits lowered to the hand's position.
    leaving: Option<SafetyLimits>,
}

impl FeltBelow {
    /// Stores a straight descent from a tcp at `from` (base frame, m) to z `lowest_m`. `below_limits_m` is the distance
    /// by which the limits were lowered for checking that descent.
    pub(crate) fn new(from: &Vector3<f64>, lowest_m: f64, below_limits_m: f64) -> Self {
        Self { at_m: [from.x, from.y], lowest_m: lowest_m - BELOW_MEASURED_M, below_limits_m }
    }

    fn is_here(&self, tcp: &Vector3<f64>) -> bool {
        let [x, y] = self.at_m;
        (tcp.x - x).hypot(tcp.y - y) <= MAX_DESCENT_OFFSET_M && tcp.z >= self.lowest_m
    }
}

impl SafetyLimits {
    /// The limits with table and workspace lowered by these distances.
    pub(crate) fn lowered(&self, table_m: f64, workspace_m: f64) -> Self {
        let mut limits = self.clone();
        limits.table_height_m -= table_m;
        if let Some(workspace) = &mut limits.workspace {
            workspace.min_m.z -= workspace_m;
        }
        limits
    }

    /// The limits of a motion from a configuration. A hand at its contact position, lower than the limits allow, may
    /// move straight up from there.
    pub(crate) fn starting_at(&self, start: &JointVector, felt: Option<&FeltBelow>) -> LimitsFrom<'_> {
        let leaving = felt.and_then(|felt| {
            let tcp = self.geometry.forward(start).translation.vector;
            let table_m = self.below_table_m(start);
            let floor_m = self.workspace.map_or(0.0, |workspace| workspace.min_m.z - tcp.z);
            let deepest_m = table_m.max(floor_m);
            let is_below = deepest_m > 0.0 && deepest_m <= felt.below_limits_m + ASCENT_TOLERANCE_M;
            // Table and workspace are lowered only as far as necessary.
            let lower_m = |needed_m: f64| if needed_m > 0.0 { needed_m + ASCENT_TOLERANCE_M } else { 0.0 };
            (is_below && felt.is_here(&tcp)).then(|| self.lowered(lower_m(table_m), lower_m(floor_m)))
        });
        LimitsFrom { limits: self, leaving }
    }

    /// Distance by which the arm is closer to the table than allowed, m.
    fn below_table_m(&self, q: &JointVector) -> f64 {
        self.min_table_clearance_m - self.table_clearance(q).lowest_m
    }

    /// Whether the arm is lower than table or workspace allow.
    pub(crate) fn is_below(&self, q: &JointVector, tcp_z_m: f64) -> bool {
        let is_under_floor = self.workspace.is_some_and(|workspace| tcp_z_m < workspace.min_m.z);
        is_under_floor || self.below_table_m(q) > 0.0
    }
}

impl LimitsFrom<'_> {
    /// As [`SafetyLimits::check`]; while the hand is lower than the limits allow, it must move straight up.
    ///
    /// # Errors
    /// The first limit that the motion violates.
    pub(crate) fn check(&self, trajectory: Trajectory) -> Result<CheckedMotion, Violation> {
        let Some(leaving) = &self.leaving else { return self.limits.check(trajectory) };
        self.check_leaving(&trajectory)?;
        leaving.check(trajectory)
    }

    fn check_leaving(&self, trajectory: &Trajectory) -> Result<(), Violation> {
        let arm = &self.limits.geometry;
        let from = arm.forward(trajectory.start()).translation.vector;
        let num_cycles = (trajectory.duration_secs() / PERIOD_SECS).ceil() as usize;
        let (mut highest_m, mut was_above) = (from.z, false);
        for cycle in 0..=num_cycles {
            let time_secs = cycle as f64 * PERIOD_SECS;
            let (q, _, _) = trajectory.sample(time_secs);
            let tcp = arm.forward(&q).translation.vector;
            if !self.limits.is_below(&q, tcp.z) {
                was_above = true;
                continue;
            }
            let [beside_m, down_m] = [(tcp - from).xy().norm(), highest_m - tcp.z];
            if was_above || beside_m > MAX_ASCENT_OFFSET_M || down_m > ASCENT_TOLERANCE_M {
                let (beside_mm, down_mm) = (beside_m * 1e3, down_m.max(0.0) * 1e3);
                return Err(Violation::Leaving { time_secs, beside_mm, down_mm });
            }
            highest_m = highest_m.max(tcp.z);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
