//! A plan in words and as JSON.

use std::fmt::Write;

use sdg_kinematics::collision::{Checker, CollisionModel, Proximity};
use sdg_kinematics::planning::Plan;
use sdg_kinematics::{JointVector, Panda, Trajectory};
use serde_json::{Value, json};

/// Places on the straight motion at which distances are looked at.
const NUM_PLACES: usize = 64;

/// The path from one waypoint to the next, each as near as its rounded corner comes.
struct Part {
    /// The waypoint at its end.
    end: JointVector,
    secs: f64,
    /// What the arm comes nearest to on it.
    nearest: Proximity,
}

/// What there is to say of a plan.
pub(super) struct Explained {
    start: JointVector,
    parts: Vec<Part>,
    /// Motions from rest to rest that the parts are followed in.
    num_motions: usize,
    /// How long they take, and how long with a stop at every waypoint.
    secs: f64,
    stopping_secs: f64,
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
        stopping_secs: f64,
        turns: u32,
        planning_ms: f64,
    ) -> Self {
        let parts = parts(model, plan, motions);
        let (start, end) = (plan.waypoints[0], plan.waypoints[plan.waypoints.len() - 1]);
        let turns = turns as usize;
        Self {
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

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |what: String| writeln!(text, "  {what}").expect("a string takes any text");
        let (secs, num_motions) = (self.secs, self.num_motions);
        let motions = match num_motions {
            0 => "the arm is there already, a motion".to_owned(),
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

/// What happens between waypoints: a motion is past one where it is nearest to it.
fn parts(model: &CollisionModel, plan: &Plan, motions: &[Trajectory]) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut waypoints = plan.waypoints[1..].iter();
    for motion in motions {
        let samples: Vec<JointVector> = (0..=NUM_SAMPLES).map(|sample| at_share(motion, sample).0).collect();
        let mut from = 0;
        while from < NUM_SAMPLES
            && let Some(waypoint) = waypoints.next()
        {
            let is_end = (motion.end() - waypoint).amax() < SAME_RAD;
            let distance = |sample: &usize| (samples[*sample] - waypoint).norm();
            let nearest = (from + 1..=NUM_SAMPLES).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let to = if is_end { NUM_SAMPLES } else { nearest.unwrap_or(NUM_SAMPLES) };
            let secs = at_share(motion, to).1 - at_share(motion, from).1;
            parts.push(Part { end: *waypoint, secs, nearest: nearest_of(model, &samples[from..=to]) });
            from = to;
        }
    }
    parts
}

/// Places on a motion at which its nearest place to a waypoint is sought.
const NUM_SAMPLES: usize = 1000;
/// Configurations that are nearer to each other are the same.
const SAME_RAD: f64 = 1e-9;

fn at_share(motion: &Trajectory, sample: usize) -> (JointVector, f64) {
    let secs = motion.duration_secs() * sample as f64 / NUM_SAMPLES as f64;
    (motion.sample(secs).0, secs)
}

/// What the arm comes nearest to on a straight motion.
fn nearest_on(model: &CollisionModel, from: &JointVector, to: &JointVector) -> Proximity {
    let places: Vec<JointVector> =
        (0..=NUM_PLACES).map(|place| from + (to - from) * (place as f64 / NUM_PLACES as f64)).collect();
    nearest_of(model, &places)
}

/// What the arm comes nearest to at some configurations.
fn nearest_of(model: &CollisionModel, places: &[JointVector]) -> Proximity {
    // The margin plays no part in distances.
    let distances = Checker::new(model, 1e-3).distances_m(places);
    let place = (0..places.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
    model.nearest(&places[place])
}
