//! From above the part straight down to it.

use nalgebra::{Isometry3, Translation3};
use sdg_kinematics::{Approach, GraspSymmetry, HAND_OPENING_MAX_M, IkOptions, LineOptions};

use super::{Sequence, Steps, Stop, fails_at};
use crate::arm::Arm;
use crate::arm_state::{ContactSensitivity, HandCommand};
use crate::perception::{GraspStep, GraspTarget};

/// Least distance of the finger tips to the table when closing, m.
const FINGERTIP_CLEARANCE_M: f64 = 0.002;
/// Speed at which the opening changes on the way to the part, m/s.
const OPENING_SPEED_M_S: f64 = 0.2;
/// How long the arm stands still before the hand closes, s.
const SETTLE_SECS: f64 = 0.1;

impl<A: Arm> Sequence<'_, '_, A> {
    /// Puts the open hand above the grasp, as high as a straight way down exists from.
    pub(super) fn go_above(&mut self, target: &GraspTarget) -> Steps<Approach> {
        self.check_age()?;
        let limits = self.robot.limits();
        let lowest = limits.table_height_m + limits.fingertip_beyond_tcp_m + FINGERTIP_CLEARANCE_M;
        let mut base_from_grasp = target.base_from_tcp;
        base_from_grasp.translation.z = base_from_grasp.translation.z.max(lowest);

        let opening_m = (target.jaw_width_m + self.config.opening_margin_m).min(HAND_OPENING_MAX_M);
        self.robot.start_hand(HandCommand::Move { opening_m, speed_m_s: OPENING_SPEED_M_S })?;
        let seed = self.robot.commanded()?;
        let here = self.robot.panda().forward(&seed).translation.z;
        let mut first_error = None;
        for height in [here - base_from_grasp.translation.z, 0.25, 0.15, 0.10] {
            let base_from_pregrasp = above(&base_from_grasp, height.max(0.05));
            let planned = self.robot.panda().approach(
                &base_from_pregrasp,
                &base_from_grasp,
                GraspSymmetry::HalfTurn,
                &seed,
                &IkOptions::default(),
                &LineOptions::default(),
            );
            match planned {
                Ok(approach) => {
                    self.move_freely(&approach.pregrasp.q, GraspStep::Approach)?;
                    return Ok(approach);
                }
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        let p = base_from_grasp.translation.vector;
        let why = first_error.map_or_else(String::new, |error| error.to_string());
        Err(Stop::Failed(
            GraspStep::Approach,
            format!("no straight way down to ({:.2}, {:.2}, {:.3}) m: {why}", p.x, p.y, p.z),
        ))
    }

    /// Moves straight down to the grasp with the hand open.
    pub(super) fn descend(&mut self, approach: Approach) -> Steps<()> {
        self.robot.finish_hand()?;
        self.robot.set_contact_sensitivity(ContactSensitivity::Contact)?;
        let planned = self.robot.plan_along(&approach.path, &self.config.pace.approach_limits());
        let motion = fails_at(GraspStep::Approach, planned)?;
        self.follow(motion, GraspStep::Approach)?;
        Ok(self.robot.wait(SETTLE_SECS)?)
    }
}

/// A pose higher up.
pub(super) fn above(base_from_tcp: &Isometry3<f64>, height_m: f64) -> Isometry3<f64> {
    Translation3::new(0.0, 0.0, height_m) * base_from_tcp
}
