//! Carries the held part to above its place, in an orientation in which the fingers have room and the compliant descent
//! is possible.

use nalgebra::{Isometry3, Point3};
use sdg_geometry::RotationalSymmetry;
use sdg_kinematics::{Approach, GraspSymmetry, IkOptions, JointPath, JointVector, LineOptions};

use super::held_part::HeldPart;
use super::reach::above;
use super::{Sequence, Steps, Stop, fails_at};
use crate::arm::Arm;
use crate::arm_state::ContactSensitivity;
use crate::lying_part::LyingPart;
use crate::perception::GraspStep;
use crate::place::PlaceGoal;
use crate::room::same_turns_rad;
use crate::surroundings::{Destination, Surroundings, Way};
use crate::touch::TouchDown;

/// Heights above a place at which a straight descent to it starts, m.
const HEIGHTS_M: [f64; 3] = [0.20, 0.15, 0.10];
/// Height above the highest expected contact at which the compliant descent starts, m.
const SOFT_WAY_M: f64 = 0.015;
/// Distance below the lowest expected contact at which the compliant descent ends, m.
pub(super) const BELOW_M: f64 = 0.010;

/// The pose of the part at its place, and the pose of the tcp before the compliant descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    pub(super) base_from_part: Isometry3<f64>,
    pub(super) base_from_tcp: Isometry3<f64>,
    /// Height of the tcp before the compliant descent above that at the lowest expected contact, m.
    pub(super) soft_m: f64,
}

/// The path of the held part to above its place.
enum Carried {
    Around(Way),
    Straight(Approach),
}

impl<A: Arm> Sequence<'_, '_, A> {
    /// Carries the part to above its place, down to the start of the compliant descent, in an orientation in which the
    /// fingers have room at this opening (m).
    pub(super) fn carry(
        &mut self,
        goal: &PlaceGoal,
        symmetry: RotationalSymmetry,
        opening_m: f64,
        slip: &Isometry3<f64>,
    ) -> Steps<Aim> {
        self.begin(GraspStep::Carry)?;
        let held =
            self.known.held.clone().ok_or_else(|| Stop::Failed(GraspStep::Carry, "nothing is held".to_owned()))?;
        // The hand opens at the place; the straight path is therefore planned for the open hand.
        self.known.opening_m = opening_m;
        let [x, y] = goal.at_m;
        self.known.support = Some(Point3::new(x, y, goal.surface_m));
        let soft_m = self.soft_way_m(goal, &held)?;
        let mut aims: Vec<Aim> = same_turns_rad(symmetry)
            .into_iter()
            .map(|turn_rad| {
                let base_from_part = goal.base_from_part(goal.surface_m + held.height_m, turn_rad);
                let base_from_tcp = above(&(base_from_part * slip * held.part_from_tcp), soft_m);
                Aim { base_from_part, base_from_tcp, soft_m }
            })
            .collect();
        if let Some(part) = &held.shape {
            aims = goal.with_room_for_fingers(part, opening_m, aims, |aim| aim.base_from_tcp);
        }
        if aims.is_empty() {
            let opening_mm = opening_m * 1e3;
            let why = format!("\"{}\" has no room for fingers that open to {opening_mm:.0} mm", goal.name);
            return Err(Stop::Failed(GraspStep::Carry, why));
        }
        let mut why = None;
        for height_m in HEIGHTS_M {
            let mut left = aims.clone();
            while !left.is_empty() {
                let (aim_idx, carried) = match self.way_above(&left, height_m)? {
                    Ok(found) => found,
                    Err(because) => {
                        why.get_or_insert(because);
                        break;
                    }
                };
                let aim = left.remove(aim_idx);
                let end = match &carried {
                    Carried::Around(way) => way.approach.as_ref().map(|path| *path.end()),
                    Carried::Straight(approach) => Some(*approach.path.end()),
                };
                // A joint limit or an obstacle may end the descent before the contact in one orientation of the part
                // and not in another.
                if let Some(end) = end
                    && let Err(because) = self.goes_on_down(&end, &aim, goal.bin_m.is_some())?
                {
                    why.get_or_insert(because);
                    continue;
                }
                self.go_above_place(carried)?;
                return Ok(aim);
            }
        }
        let why = why.unwrap_or_default();
        Err(Stop::Failed(GraspStep::Carry, format!("no path to \"{}\" at ({x:.2}, {y:.2}) m: {why}", goal.name)))
    }

    /// The path to above one of the aims, with the index of that aim; otherwise the reason why there is none.
    fn way_above(&mut self, aims: &[Aim], height_m: f64) -> Steps<Result<(usize, Carried), String>> {
        let poses: Vec<Isometry3<f64>> = aims.iter().map(|aim| aim.base_from_tcp).collect();
        if !self.is_surrounded() {
            let best = self.straight_down(&poses, height_m)?;
            return Ok(best.map(|(aim_idx, approach)| (aim_idx, Carried::Straight(approach))));
        }
        match self.way_to(&Destination::Approached(&poses, height_m)) {
            Ok(way) => Ok(Ok((way.goal_idx, Carried::Around(way)))),
            Err(error) if error.latches() => Err(error.into()),
            Err(error) => Ok(Err(error.to_string())),
        }
    }

    /// The straight path down to the pose that the arm reaches at the lowest cost, with the index of that pose.
    fn straight_down(&mut self, poses: &[Isometry3<f64>], height_m: f64) -> Steps<Result<(usize, Approach), String>> {
        let seed = self.robot.commanded()?;
        let mut best: Option<(usize, Approach)> = None;
        let mut why = String::new();
        for (index, pose) in poses.iter().enumerate() {
            let (ik, line) = (IkOptions::default(), LineOptions::default());
            let planned =
                self.robot.geometry().approach(&above(pose, height_m), pose, GraspSymmetry::Fixed, &seed, &ik, &line);
            match planned {
                Ok(approach) if best.as_ref().is_none_or(|(_, best)| approach.pregrasp.cost < best.pregrasp.cost) => {
                    best = Some((index, approach));
                }
                Ok(_) => {}
                Err(error) => why = error.to_string(),
            }
        }
        Ok(best.ok_or(why))
    }

    /// Height above the lowest expected contact at which the compliant descent starts, m. In a bin the part may be put
    /// on other parts: on the known ones, and at least on one like itself, because not every part there is known.
    fn soft_way_m(&self, goal: &PlaceGoal, held: &HeldPart) -> Steps<f64> {
        let (Some(_), Some(shape)) = (goal.bin_m, &held.shape) else { return Ok(SOFT_WAY_M) };
        let base_from_part = goal.base_from_part(goal.surface_m + held.height_m, 0.0);
        let placed = LyingPart { base_from_part, shape: shape.clone() };
        let below = self.known.lying.all().iter().filter(|other| other.overlaps(&placed));
        let filled_m = below.map(|other| other.top_in_base_m() - goal.surface_m).fold(shape.top_m(), f64::max);
        let max_m = TouchDown::MAX_WAY_M - SOFT_WAY_M - BELOW_M;
        if filled_m <= max_m {
            return Ok(SOFT_WAY_M + filled_m);
        }
        let (name, filled_mm, max_mm) = (&goal.name, filled_m * 1e3, max_m * 1e3);
        let why = format!("\"{name}\" may be filled to {filled_mm:.0} mm, at most {max_mm:.0} mm are possible");
        Err(Stop::Failed(GraspStep::Carry, why))
    }

    /// Checks that the arm can descend from a configuration to the lowest possible contact, and that the hand has room
    /// down to the expected one; otherwise returns the reason.
    fn goes_on_down(&self, from: &JointVector, aim: &Aim, is_bin: bool) -> Steps<Result<(), String>> {
        let arm = self.robot.geometry();
        let base_from_tcp = arm.forward(from);
        let lowest = above(&base_from_tcp, -(aim.soft_m + BELOW_M));
        if let Err(error) = arm.straight_path(from, &lowest, &LineOptions::default()) {
            return Ok(Err(error.to_string()));
        }
        // Parts in a bin may lie anywhere: the contact ends the descent.
        let lying = if is_bin { &[] } else { self.known.lying.all() };
        let surroundings = Surroundings { lying, ..self.surroundings() };
        let contact = above(&base_from_tcp, -aim.soft_m);
        Ok(self.free_line_among(&surroundings, from, &contact)?.map(|_| ()))
    }

    fn go_above_place(&mut self, carried: Carried) -> Steps<()> {
        let path: JointPath = match carried {
            Carried::Around(way) => self.travel(way, GraspStep::Carry)?.ok_or_else(|| {
                Stop::Failed(GraspStep::Carry, "the path around the obstacles has no approach".to_owned())
            })?,
            Carried::Straight(approach) => {
                self.move_freely(&approach.pregrasp.q, GraspStep::Carry)?;
                approach.path
            }
        };
        let hand = self.robot.hand()?;
        self.judge(GraspStep::Carry, &hand)?;
        self.begin(GraspStep::PutDown)?;
        self.robot.set_contact_sensitivity(ContactSensitivity::Contact)?;
        let planned = self.robot.plan_along(&path, &self.cell.config.pace.approach_limits(self.robot.geometry()));
        let motion = fails_at(GraspStep::PutDown, planned)?;
        self.follow(motion, GraspStep::PutDown)
    }
}
