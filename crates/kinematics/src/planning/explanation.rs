//! A plan part by part: how long each takes, and what the arm comes nearest to on it.

use crate::collision::{Checker, CollisionModel, Proximity};
use crate::planning::plan::Plan;
use crate::{JointVector, Trajectory};

/// Places on the straight motion at which distances are looked at.
const NUM_PLACES: usize = 64;

/// The path from one waypoint to the next, each as near as its rounded corner comes.
#[derive(Debug, Clone)]
pub struct PlanPart {
    /// The waypoint at its end.
    pub end: JointVector,
    /// How long it takes.
    pub secs: f64,
    /// What the arm comes nearest to on it.
    pub nearest: Proximity,
}

/// What happens between waypoints: a motion is past one where it is nearest to it.
pub fn plan_parts(model: &CollisionModel, plan: &Plan, motions: &[Trajectory]) -> Vec<PlanPart> {
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
            parts.push(PlanPart { end: *waypoint, secs, nearest: nearest_of(model, &samples[from..=to]) });
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
pub fn nearest_on(model: &CollisionModel, from: &JointVector, to: &JointVector) -> Proximity {
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
