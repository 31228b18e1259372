//! A motion planned around the obstacles of a workcell, in words and as JSON.

use std::fmt::Write;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use sdg_kinematics::collision::{CollisionModel, Proximity};
use sdg_kinematics::planning::{Plan, PlanPart, nearest_on, plan_parts};
use sdg_kinematics::{ArmGeometry, JointVector, Trajectory};
use sdg_robot::workcell::Workcell;
use serde_json::{Value, json};

/// Each goal pose at `turns` equally spaced rotations about its z axis.
pub fn turned_goals(goals: impl Iterator<Item = Isometry3<f64>>, turns: u32) -> Vec<Isometry3<f64>> {
    let turn = |index: u32| {
        let angle_rad = std::f64::consts::TAU * f64::from(index) / f64::from(turns);
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad)
    };
    goals.flat_map(|pose| (0..turns).map(move |index| pose * turn(index))).collect()
}

/// The first limit of a grasp in this workcell that the motions violate: the workspace, the table, the tcp's speed.
pub fn refused_by_limits(workcell: &Workcell, motions: &[Trajectory]) -> Option<String> {
    let limits = workcell.safety_limits();
    motions.iter().find_map(|motion| limits.check(motion.clone()).err()).map(|violation| violation.to_string())
}

/// A plan and its key figures.
#[derive(Debug, Clone)]
pub struct ExplainedPlan {
    arm: ArmGeometry,
    start: JointVector,
    parts: Vec<PlanPart>,
    /// Number of motions from rest to rest through the parts of the path.
    num_motions: usize,
    /// Duration of these motions, in seconds. `stopping_secs` is the duration with a stop at every waypoint.
    secs: f64,
    stopping_secs: f64,
    /// The collision on the straight motion; `None` if the plan is straight.
    straight: Option<Proximity>,
    /// Index of the goal in the given order, from 0, and its angle about the hand's axis, in degrees.
    goal: (usize, f64),
    num_checks: usize,
    planning_ms: f64,
}

impl ExplainedPlan {
    /// Explains a plan to one of several goals, each at `turns` angles as made by [`turned_goals`]. `stopping_secs` is the
    /// duration with a stop at every waypoint, `planning_ms` the time that the planner took.
    pub fn new(
        model: &CollisionModel,
        plan: &Plan,
        motions: &[Trajectory],
        stopping_secs: f64,
        turns: u32,
        planning_ms: f64,
    ) -> Self {
        let parts = plan_parts(model, plan, motions);
        let (start, end) = (plan.waypoints[0], plan.waypoints[plan.waypoints.len() - 1]);
        let turns = turns as usize;
        Self {
            arm: model.arm().clone(),
            start,
            parts,
            num_motions: motions.len(),
            secs: motions.iter().map(Trajectory::duration_secs).sum(),
            stopping_secs,
            straight: (plan.waypoints.len() > 2).then(|| nearest_on(model, &start, &end)),
            goal: (plan.goal_idx / turns, 360.0 * (plan.goal_idx % turns) as f64 / turns as f64),
            num_checks: plan.num_checks,
            planning_ms,
        }
    }

    /// The plan in lines of text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |what: String| writeln!(text, "  {what}").expect("writing to a string cannot fail");
        let (secs, num_motions) = (self.secs, self.num_motions);
        let motions = match num_motions {
            0 => "the arm is at the goal already, a motion".to_owned(),
            1 => "one motion".to_owned(),
            _ => format!("{num_motions} motions"),
        };
        let stops = match self.parts.len() {
            0 | 1 => String::new(),
            _ => format!(" ({:.1} s if it stopped at each waypoint)", self.stopping_secs),
        };
        line(format!(
            "found in {:.0} ms with {} collision checks: {motions} of {secs:.1} s{stops}",
            self.planning_ms, self.num_checks
        ));
        let (goal, turn_deg) = self.goal;
        line(format!("goal {}, rotated by {turn_deg:.0}° about the hand's axis", goal + 1));
        match &self.straight {
            None => line("the straight motion is free of collisions".to_owned()),
            Some(nearest) => line(format!("not straight, because on the straight motion {nearest}")),
        }
        for (index, part) in self.parts.iter().enumerate() {
            let tcp = self.arm.forward(&part.end).translation.vector * 1e3;
            let joints: Vec<String> = part.end.iter().map(|angle| format!("{:.1}", angle.to_degrees())).collect();
            line(format!(
                "{}. to joints ({})°, tcp ({:.0}, {:.0}, {:.0}) mm, in {:.1} s; nearest: {}",
                index + 1,
                joints.join(", "),
                tcp.x,
                tcp.y,
                tcp.z,
                part.secs,
                part.nearest
            ));
        }
        text
    }

    /// The plan as JSON, as printed by `sdg plan`.
    pub fn json(&self) -> Value {
        let degrees = |q: &JointVector| q.iter().map(|angle| angle.to_degrees()).collect::<Vec<_>>();
        let near = |nearest: &Proximity| {
            json!({
                "body": nearest.body.to_string(),
                "other": nearest.other,
                "distance_mm": nearest.distance_m * 1e3,
            })
        };
        let parts: Vec<Value> = self
            .parts
            .iter()
            .map(|part| json!({ "joints_deg": degrees(&part.end), "seconds": part.secs, "nearest": near(&part.nearest) }))
            .collect();
        json!({
            "start_deg": degrees(&self.start),
            "motions": parts,
            "seconds": self.secs,
            "seconds_with_stops": self.stopping_secs,
            "goal": self.goal.0,
            "turn_deg": self.goal.1,
            "straight_is_blocked_by": self.straight.as_ref().map(near),
            "checks": self.num_checks,
            "planning_ms": self.planning_ms,
        })
    }
}
