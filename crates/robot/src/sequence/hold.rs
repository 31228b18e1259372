//! Closing, lifting and holding; the hand's width and force show whether the part is held.

use nalgebra::Isometry3;
use sdg_kinematics::collision::{Body, Checker};
use sdg_kinematics::planning::{CheckedLine, checked_line};
use sdg_kinematics::{CartesianLimits, JointPath, JointVector, LineOptions, Trajectory};

use super::held_part::HeldPart;
use super::reach::above;
use super::{Sequence, Steps, Stop, fails_at};
use crate::arm::Arm;
use crate::arm_state::{GRASP_TOLERANCE_M, HandCommand, HandState, Load, MAX_WIDTH_CHANGE_M, MIN_HELD_WIDTH_M};
use crate::error::RobotError;
use crate::grasp_target::GraspTarget;
use crate::perception::GraspStep;
use crate::surroundings::{LINE_MARGIN_M, NEAR_AT_START_M, Surroundings};

/// Speed at which the opening changes when the hand closes, m/s.
const CLOSING_SPEED_M_S: f64 = 0.1;
/// Steps by which a straight motion up is shortened if the arm cannot follow the whole motion, m.
const UP_STEP_M: f64 = 0.05;

impl<A: Arm> Sequence<'_, '_, A> {
    /// Closes the hand on the part.
    pub(super) fn close(&mut self, target: &GraspTarget) -> Steps<()> {
        self.begin(GraspStep::Close)?;
        self.robot.start_hand(HandCommand::Grasp {
            width_m: target.jaw_width_m,
            tolerance_m: GRASP_TOLERANCE_M,
            speed_m_s: CLOSING_SPEED_M_S,
            force_n: self.cell.config.grasp_force_n,
        })?;
        let hand = self.robot.finish_hand()?;
        self.known.closed = Some(hand);
        self.known.opening_m = hand.opening_m;
        self.judge(GraspStep::Close, &hand)?;
        if let Some(load) = self.cell.config.load {
            self.robot.set_load(load)?;
        }
        let q = self.robot.state()?.q;
        let base_from_tcp = self.robot.geometry().forward(&q);
        self.known.held = Some(HeldPart::new(target, &base_from_tcp, self.surface_height_m(), self.cell.config));
        Ok(())
    }

    /// Lifts the part by [`super::GraspConfig::lift_m`], or less if the arm cannot reach that height or may not move
    /// there.
    pub(super) fn lift(&mut self) -> Steps<()> {
        self.begin(GraspStep::Lift)?;
        let config = self.cell.config;
        let limits = config.pace.lift_limits(self.robot.geometry());
        let motion = self.plan_up([config.min_lift_m, config.lift_m], &limits, GraspStep::Lift)?;
        self.follow(motion, GraspStep::Lift)?;
        let hand = self.robot.hand()?;
        self.judge(GraspStep::Lift, &hand)
    }

    /// The longest straight motion up, between two lengths (m), that is free of obstacles and satisfies the limits.
    pub(super) fn plan_up(
        &mut self,
        [min_m, max_m]: [f64; 2],
        limits: &CartesianLimits,
        step: GraspStep,
    ) -> Steps<Trajectory> {
        let start = self.robot.commanded()?;
        let base_from_tcp = self.robot.geometry().forward(&start);
        let mut up_m = max_m;
        loop {
            let planned = match self.free_line_up(&start, &above(&base_from_tcp, up_m))? {
                Ok(path) => fails_at(step, self.robot.plan_safely_along(&path, limits)),
                Err(why) => Err(Stop::Failed(step, why)),
            };
            match planned {
                Err(Stop::Failed(..)) if up_m - UP_STEP_M >= min_m - 1e-9 => up_m -= UP_STEP_M,
                planned => return planned,
            }
        }
    }

    /// A straight motion up that gets no nearer to obstacles that are near the hand at its start.
    fn free_line_up(&self, start: &JointVector, base_from_tcp: &Isometry3<f64>) -> Steps<Result<JointPath, String>> {
        let surroundings = Surroundings { may_start_near: true, ..self.surroundings() };
        self.free_line_among(&surroundings, start, base_from_tcp)
    }

    /// A straight motion free of obstacles; otherwise the reason why there is none.
    pub(super) fn free_line_among(
        &self,
        surroundings: &Surroundings<'_>,
        start: &JointVector,
        base_from_tcp: &Isometry3<f64>,
    ) -> Steps<Result<JointPath, String>> {
        let arm = self.robot.geometry();
        if !self.is_surrounded() {
            let line = arm.straight_path(start, base_from_tcp, &LineOptions::default());
            return Ok(line.map_err(|error| error.to_string()));
        }
        let mut model = surroundings.contact_model(arm, self.robot.limits().table_height_m)?;
        if surroundings.may_start_near {
            model.allow_overlaps_at(Body::HAND, start, NEAR_AT_START_M);
        }
        let mut checker = Checker::new(&model, LINE_MARGIN_M);
        let line = checked_line(arm, &mut checker, start, base_from_tcp).map_err(RobotError::Planning)?;
        let CheckedLine { share, path, blocked_by } = line;
        Ok(path.ok_or_else(|| {
            let why = blocked_by.unwrap_or_default();
            format!("{:.0} % of the straight path can be followed: {why}", share * 100.0)
        }))
    }

    /// Holds the part still for a while.
    pub(super) fn hold(&mut self) -> Steps<()> {
        self.begin(GraspStep::Hold)?;
        self.robot.wait(self.cell.config.hold_secs)?;
        let hand = self.robot.hand()?;
        self.judge(GraspStep::Hold, &hand)
    }

    /// Fails the step if the part is not held, by the observer's verdict first, then by the hand's.
    pub(super) fn judge(&mut self, step: GraspStep, hand: &HandState) -> Steps<()> {
        let by_hand = held(&self.known.closed.unwrap_or(*hand), hand);
        if by_hand.is_err() && self.known.held.take().is_some() && self.cell.config.load.is_some() {
            // The controller must not compensate a load that was lost.
            self.robot.set_load(Load::NONE)?;
        }
        self.report.hand_verdicts.push((step, by_hand.clone().err()));
        self.passed(step)?;
        by_hand.map_err(|why| Stop::Failed(step, why))
    }
}

/// Checks that the hand still holds the part on which it closed; otherwise returns the reason.
fn held(closed: &HandState, now: &HandState) -> Result<(), String> {
    let [closed_mm, now_mm] = [closed.opening_m * 1e3, now.opening_m * 1e3];
    if closed.opening_m < MIN_HELD_WIDTH_M {
        return Err(format!("the fingers closed to {closed_mm:.1} mm without touching the part"));
    }
    if now.opening_m < MIN_HELD_WIDTH_M || (now.opening_m - closed.opening_m).abs() > MAX_WIDTH_CHANGE_M {
        return Err(format!("the part slipped: the fingers held it at {closed_mm:.1} mm and are at {now_mm:.1} mm"));
    }
    if !now.is_grasping {
        let force = now.force_n.map_or_else(String::new, |force_n| format!(" with {force_n:.0} N"));
        return Err(format!("the fingers are at {now_mm:.1} mm and do not press on the part as commanded{force}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand(opening_m: f64, is_grasping: bool) -> HandState {
        HandState { opening_m, is_grasping, force_n: None }
    }

    #[test]
    fn width_and_force_tell_whether_a_part_is_held() {
        let closed = hand(0.020, true);
        assert_eq!(held(&closed, &hand(0.0205, true)), Ok(()));
        for (closed, now, expected) in [
            (hand(0.0002, true), hand(0.0002, true), "closed to 0.2 mm without touching"),
            (closed, hand(0.0, true), "slipped: the fingers held it at 20.0 mm and are at 0.0 mm"),
            (closed, hand(0.030, true), "slipped"),
            (closed, hand(0.020, false), "do not press"),
        ] {
            let why = held(&closed, &now).unwrap_err();
            assert!(why.contains(expected), "{why}");
        }
    }
}
