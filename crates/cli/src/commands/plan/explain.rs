//! A plan in words and as JSON.

use std::fmt::Write;

use sdg_kinematics::collision::{Checker, CollisionModel, Proximity};
use sdg_kinematics::planning::Plan;
use sdg_kinematics::{JointVector, Panda, Trajectory};
use serde_json::{Value, json};

/// Places on each motion at which distances are looked at.
const NUM_PLACES: usize = 64;

/// A straight part of the path.
struct Part {
    end: JointVector,
    secs: f64,
    /// What the arm comes nearest to on it.
    nearest: Proximity,
}

/// What there is to say of a plan.
pub(super) struct Explained {
    start: JointVector,
    parts: Vec<Part>,
    /// What is in the way of the straight motion, where that is not the plan.
    straight: Option<Proximity>,
    /// Number of the goal as it was given, from 0, and its turn, degrees.
    goal: (usize, f64),
    num_checks: usize,
    planning_ms: f64,
}

impl Explained {
    pub(super) fn new(
        model: &CollisionModel,
        plan: &Plan,
        motions: &[Trajectory],
        turns: u32,
        planning_ms: f64,
    ) -> Self {
        let parts = motions
            .iter()
            .map(|motion| {
                let nearest = nearest_on(model, motion.start(), motion.end());
                Part { end: *motion.end(), secs: motion.duration_secs(), nearest }
            })
            .collect();
        let (start, end) = (plan.waypoints[0], plan.waypoints[plan.waypoints.len() - 1]);
        let turns = turns as usize;
        Self {
            start,
            parts,
            straight: (plan.waypoints.len() > 2).then(|| nearest_on(model, &start, &end)),
            goal: (plan.goal_idx / turns, 360.0 * (plan.goal_idx % turns) as f64 / turns as f64),
            num_checks: plan.num_checks,
            planning_ms,
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |what: String| writeln!(text, "  {what}").expect("a string takes any text");
        let total_secs: f64 = self.parts.iter().map(|part| part.secs).sum();
        line(format!(
            "found in {:.0} ms with {} collision checks: {} straight motions in joint space, {total_secs:.1} s",
            self.planning_ms,
            self.num_checks,
            self.parts.len()
        ));
        let (goal, turn_deg) = self.goal;
        line(format!("goal {}, turned by {turn_deg:.0}° about the hand's axis", goal + 1));
        match &self.straight {
            None => line("nothing is in the way of the straight motion".to_owned()),
            Some(nearest) => line(format!("not straight, for on the straight motion {nearest}")),
        }
        for (index, part) in self.parts.iter().enumerate() {
            let tcp = Panda::new().forward(&part.end).translation.vector * 1e3;
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

    pub(super) fn json(&self) -> Value {
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
            "goal": self.goal.0,
            "turn_deg": self.goal.1,
            "straight_is_blocked_by": self.straight.as_ref().map(near),
            "checks": self.num_checks,
            "planning_ms": self.planning_ms,
        })
    }
}

/// What the arm comes nearest to on a straight motion.
fn nearest_on(model: &CollisionModel, from: &JointVector, to: &JointVector) -> Proximity {
    let places: Vec<JointVector> =
        (0..=NUM_PLACES).map(|place| from + (to - from) * (place as f64 / NUM_PLACES as f64)).collect();
    // The margin plays no part in distances.
    let distances = Checker::new(model, 1e-3).distances_m(&places);
    let place = (0..places.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
    model.nearest(&places[place])
}
