//! Free motions: straight in joint space above an empty table, or around the obstacles of the cell.

use sdg_kinematics::{JointLimits, JointPath, JointVector};

use super::config::GraspConfig;
use super::{FREE_CLEARANCE_M, Known, Sequence, Steps, Stop, fails_at};
use crate::arm::Arm;
use crate::arm_state::ContactSensitivity;
use crate::error::Result;
use crate::perception::GraspStep;
use crate::surroundings::{Destination, Surroundings, Way};

impl<A: Arm> Sequence<'_, '_, A> {
    /// Whether the cell contains obstacles or parts around which motions must be planned.
    pub(super) fn is_surrounded(&self) -> bool {
        !(self.cell.config.obstacles.is_empty() && self.known.lying.all().is_empty())
    }

    /// The obstacles and parts around the arm, and the held part.
    pub(super) fn surroundings(&self) -> Surroundings<'_> {
        around(self.cell.config, &self.known)
    }

    /// A path around the obstacles and parts of the cell.
    pub(super) fn way_to(&mut self, to: &Destination<'_>) -> Result<Way> {
        let limits = self.free_limits();
        let surroundings = around(self.cell.config, &self.known);
        self.robot.plan_around(&surroundings, to, &limits)
    }

    /// Joint limits of free motions, with a part in the hand and without.
    fn free_limits(&self) -> JointLimits {
        match self.known.held {
            Some(_) => self.cell.config.pace.carry_limits(self.robot.geometry()),
            None => self.cell.config.pace.free_limits(self.robot.geometry()),
        }
    }

    /// Follows a path except for its approach, which is returned.
    pub(super) fn travel(&mut self, way: Way, step: GraspStep) -> Steps<Option<JointPath>> {
        self.robot.set_contact_sensitivity(ContactSensitivity::Free)?;
        for motion in way.motions {
            self.follow(motion, step)?;
        }
        Ok(way.approach)
    }

    /// Moves to a configuration, avoiding the table and the obstacles of the cell.
    pub(super) fn move_freely(&mut self, q: &JointVector, step: GraspStep) -> Steps<()> {
        if self.is_surrounded() {
            let planned = self.way_to(&Destination::Configuration(q));
            let way = fails_at(step, planned)?;
            return self.travel(way, step).map(|_| ());
        }
        let limits = self.free_limits();
        let planned = self.robot.plan_free(q, &limits);
        let motion = fails_at(step, planned)?;
        let (arm, table_height_m) = (self.robot.geometry(), self.robot.limits().table_height_m);
        let clearance = motion.clearance(arm, table_height_m);
        // The held part hangs lower than the fingers.
        let held_m = self.known.held.as_ref().map_or(0.0, |held| held.hang_m);
        // The path may be lower than the clearance only if its destination is.
        let allowed = (FREE_CLEARANCE_M + held_m).min(arm.clearance(q, table_height_m).lowest_m - 1e-3);
        if clearance.lowest_m < allowed {
            return Err(Stop::Failed(
                step,
                format!("the path there passes {:.0} mm above the table", clearance.lowest_m * 1e3),
            ));
        }
        self.robot.set_contact_sensitivity(ContactSensitivity::Free)?;
        self.follow(motion, step)
    }
}

/// The obstacles and parts around an arm, and the held part.
fn around<'s>(config: &'s GraspConfig, known: &'s Known) -> Surroundings<'s> {
    Surroundings {
        obstacles: &config.obstacles,
        lying: known.lying.all(),
        held: known.held.as_ref().map_or(&[], |held| &held.in_tcp),
        may_start_near: false,
        opening_m: known.opening_m,
        support: known.support,
        table_clearance_m: FREE_CLEARANCE_M,
    }
}
