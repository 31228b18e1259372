//! Explains a plan part by part: the duration of each part, and the closest body during it.

use crate::collision::{Checker, CollisionModel, Proximity};
use crate::planning::plan::Plan;
use crate::{JointVector, Trajectory};

/// Number of equal parts of a straight motion, at whose ends distances are computed.
const NUM_PLACES: usize = 64;

/// The part of a motion from one waypoint to the next. A waypoint is passed where the motion is closest to it.
#[derive(Debug, Clone)]
pub struct PlanPart {
    /// The waypoint at the end.
    pub end: JointVector,
    /// Duration.
    pub secs: f64,
    /// The closest body during the part.
    pub nearest: Proximity,
}

/// Divides the motions of a plan into parts.
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

/// Number of equal parts of a motion's duration; a waypoint counts as passed at the part's end that is closest to it.
const NUM_SAMPLES: usize = 1000;
/// Configurations closer together than this are equal, rad.
const SAME_RAD: f64 = 1e-9;

fn at_share(motion: &Trajectory, sample: usize) -> (JointVector, f64) {
    let secs = motion.duration_secs() * sample as f64 / NUM_SAMPLES as f64;
    (motion.sample(secs).0, secs)
}

/// The closest body during a straight motion.
pub fn nearest_on(model: &CollisionModel, from: &JointVector, to: &JointVector) -> Proximity {
    let places: Vec<JointVector> =
        (0..=NUM_PLACES).map(|place| from + (to - from) * (place as f64 / NUM_PLACES as f64)).collect();
    nearest_of(model, &places)
}

/// The closest body at any of the configurations.
fn nearest_of(model: &CollisionModel, places: &[JointVector]) -> Proximity {
    // The margin does not affect distances.
    let distances = Checker::new(model, 1e-3).distances_m(places);
    let place = (0..places.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
    model.nearest(&places[place])
}
