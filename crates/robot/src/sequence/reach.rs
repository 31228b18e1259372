//! The descent from above the part to it.

use nalgebra::{Isometry3, Translation3};
use sdg_kinematics::{Approach, GraspSymmetry, IkOptions, JointPath, JointVector, LineOptions, with_fingers_exchanged};

use super::{Sequence, Steps, Stop, fails_at};
use crate::arm::Arm;
use crate::arm_state::{ContactSensitivity, HandCommand};
use crate::error::RobotError;
use crate::grasp_target::GraspTarget;
use crate::perception::GraspStep;
use crate::surroundings::{Destination, Way};
use crate::touch::TouchDown;

/// Minimum distance between finger tips and table when the hand closes, m.
pub(super) const FINGERTIP_CLEARANCE_M: f64 = 0.002;
/// Speed at which the opening changes during the descent, m/s.
const OPENING_SPEED_M_S: f64 = 0.2;
/// Time that the arm stands still before the hand closes, s.
const SETTLE_SECS: f64 = 0.1;
/// Heights above the grasp from which a straight descent is tried, after the present height, m.
const HEIGHTS_M: [f64; 3] = [0.25, 0.15, 0.10];
/// Opening of the hand beyond a part, both sides together, if other parts leave no room for more, m.
const NARROW_MARGIN_M: f64 = 0.020;
/// Length of a compliant descent, m.
const SOFT_WAY_M: f64 = 0.020;
/// Largest height above the grasp, or above the expected contact of a held part with its place, at which a compliant
/// descent may end, m: the surface's height is uncertain.
pub(super) const MAX_EARLY_M: f64 = 0.010;

/// A path to above a grasp, with the straight descent to it.
enum Reach {
    Around(Way),
    Straight(Approach),
}

impl<A: Arm> Sequence<'_, '_, A> {
    /// Moves the open hand above the grasp, to the first of the tried heights with a straight descent; returns this
    /// descent.
    pub(super) fn go_above(&mut self, target: &GraspTarget) -> Steps<JointPath> {
        self.begin(GraspStep::Approach)?;
        self.check_age()?;
        let limits = self.robot.limits();
        let lowest =
            self.surface_height_m().max(limits.table_height_m) + limits.fingertip_beyond_tcp_m + FINGERTIP_CLEARANCE_M;
        let mut base_from_grasp = target.base_from_tcp;
        base_from_grasp.translation.z = base_from_grasp.translation.z.max(lowest);

        let opening_max_m = self.robot.geometry().hand.opening_max_m;
        let mut openings_m = vec![(target.jaw_width_m + self.known.opening_margin_m).min(opening_max_m)];
        if !self.known.lying.all().is_empty() && NARROW_MARGIN_M < self.known.opening_margin_m {
            openings_m.push((target.jaw_width_m + NARROW_MARGIN_M).min(opening_max_m));
        }
        let mut first_error = None;
        for opening_m in openings_m {
            self.known.opening_m = opening_m;
            let reach = match self.reach(&base_from_grasp)? {
                Ok(reach) => reach,
                Err(why) => {
                    first_error.get_or_insert(why);
                    continue;
                }
            };
            self.check_age_as_planned()?;
            self.robot.start_hand(HandCommand::Move { opening_m, speed_m_s: OPENING_SPEED_M_S })?;
            return match reach {
                Reach::Around(way) => self.travel(way, GraspStep::Approach)?.ok_or_else(no_approach),
                Reach::Straight(approach) => {
                    self.move_freely(&approach.pregrasp.q, GraspStep::Approach)?;
                    Ok(approach.path)
                }
            };
        }
        let p = base_from_grasp.translation.vector;
        let why = first_error.unwrap_or_default();
        Err(Stop::Failed(
            GraspStep::Approach,
            format!("no straight path down to ({:.2}, {:.2}, {:.3}) m: {why}", p.x, p.y, p.z),
        ))
    }

    /// The path to above a grasp; otherwise the reason why there is none.
    fn reach(&mut self, base_from_grasp: &Isometry3<f64>) -> Steps<Result<Reach, String>> {
        let seed = self.robot.commanded()?;
        let here = self.robot.geometry().forward(&seed).translation.z;
        let mut first_error = None;
        for height in [&[here - base_from_grasp.translation.z], &HEIGHTS_M[..]].concat() {
            let height = height.max(0.05);
            if self.is_surrounded() {
                // The planner tries both orientations of the hand with all configurations of the arm, and uses the
                // fastest path that it finds.
                let grasps = [*base_from_grasp, with_fingers_exchanged(base_from_grasp)];
                match self.way_to(&Destination::Approached(&grasps, height)) {
                    Ok(way) => return Ok(Ok(Reach::Around(way))),
                    Err(error) if error.latches() => return Err(error.into()),
                    Err(error) => {
                        first_error.get_or_insert(error.to_string());
                    }
                }
                continue;
            }
            let planned = self.robot.geometry().approach(
                &above(base_from_grasp, height),
                base_from_grasp,
                GraspSymmetry::HalfTurn,
                &seed,
                &IkOptions::default(),
                &LineOptions::default(),
            );
            match planned {
                Ok(approach) => return Ok(Ok(Reach::Straight(approach))),
                Err(error) => {
                    first_error.get_or_insert(error.to_string());
                }
            }
        }
        Ok(Err(first_error.unwrap_or_default()))
    }

    /// Moves straight down to the grasp with the hand open.
    pub(super) fn descend(&mut self, path: JointPath) -> Steps<()> {
        self.robot.finish_hand()?;
        self.robot.set_contact_sensitivity(ContactSensitivity::Contact)?;
        match self.cell.config.soft_approach.filter(|_| self.cell.touch.is_some()) {
            Some(touch_down) => self.descend_softly(&path, &touch_down)?,
            None => {
                let planned =
                    self.robot.plan_along(&path, &self.cell.config.pace.approach_limits(self.robot.geometry()));
                let motion = fails_at(GraspStep::Approach, planned)?;
                self.follow(motion, GraspStep::Approach)?;
            }
        }
        Ok(self.robot.wait(SETTLE_SECS)?)
    }

    /// Descends at the speed of an approach, and compliantly at the end.
    fn descend_softly(&mut self, path: &JointPath, touch_down: &TouchDown) -> Steps<()> {
        let base_from_grasp = self.robot.geometry().forward(path.end());
        self.go_down_to(path.start(), &above(&base_from_grasp, SOFT_WAY_M), GraspStep::Approach)?;
        let touch_down = TouchDown { max_way_m: SOFT_WAY_M, ..*touch_down };
        let touched = self.touch_down(&touch_down, GraspStep::Approach)?;
        let Some(touched) = touched else { return Ok(()) };
        let early_m = touched.tcp_height_m - base_from_grasp.translation.z;
        if early_m <= MAX_EARLY_M {
            return Ok(());
        }
        let early_mm = early_m * 1e3;
        Err(Stop::Failed(
            GraspStep::Approach,
            match touched.is_contact {
                true => format!("the fingers touched an object {early_mm:.0} mm above the grasp"),
                false => format!("the soft descent ended {early_mm:.0} mm above the grasp without a lasting contact"),
            },
        ))
    }

    /// Moves straight down to a pose at the speed of an approach.
    pub(super) fn go_down_to(
        &mut self,
        start: &JointVector,
        base_from_tcp: &Isometry3<f64>,
        step: GraspStep,
    ) -> Steps<()> {
        let line = self.robot.geometry().straight_path(start, base_from_tcp, &LineOptions::default());
        let path = fails_at(step, line.map_err(RobotError::Planning))?;
        let planned = self.robot.plan_along(&path, &self.cell.config.pace.approach_limits(self.robot.geometry()));
        let motion = fails_at(step, planned)?;
        self.follow(motion, step)
    }
}

fn no_approach() -> Stop {
    Stop::Failed(GraspStep::Approach, "the path around the obstacles has no approach".to_owned())
}

/// A pose, raised by `height_m`.
pub(super) fn above(base_from_tcp: &Isometry3<f64>, height_m: f64) -> Isometry3<f64> {
    Translation3::new(0.0, 0.0, height_m) * base_from_tcp
}
