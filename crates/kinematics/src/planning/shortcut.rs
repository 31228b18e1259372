//! Shortens a path by replacing parts of it with straight motions.

use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::collision::Checker;
use crate::joints::JointVector;
use crate::limits::JointLimits;

/// Approximate time that a stop at a waypoint costs: braking from a large fraction of the full speed and accelerating
/// to it, s.
const STOP_SECS: f64 = 0.15;
/// Minimum gain of a replacement, s. Smaller gains do not justify the checks.
const MIN_GAIN_SECS: f64 = 0.01;

/// Approximate duration of a path with a stop at every waypoint, at full speed, s.
pub(super) fn cost_secs(waypoints: &[JointVector], limits: &JointLimits) -> f64 {
    let motion_secs: f64 = waypoints.windows(2).map(|pair| motion_secs(&pair[0], &pair[1], limits)).sum();
    motion_secs + STOP_SECS * waypoints.len().saturating_sub(2) as f64
}

/// Duration of the motion of the slowest joint at its full speed, s.
pub(super) fn motion_secs(from: &JointVector, to: &JointVector, limits: &JointLimits) -> f64 {
    (to - from).abs().component_div(&limits.velocity_max).max()
}

/// Replaces parts of a path with straight motions: first from waypoint to waypoint, then in at most `attempts` attempts
/// between random points. Most attempts also try to move a waypoint.
pub(super) fn shorten(
    checker: &mut Checker<'_>,
    limits: &JointLimits,
    waypoints: &mut Vec<JointVector>,
    attempts: usize,
    rng: &mut Pcg64Mcg,
) {
    skip_waypoints(checker, waypoints);
    for _ in 0..attempts {
        if waypoints.len() <= 2 {
            return;
        }
        let total = waypoints.windows(2).map(|pair| motion_secs(&pair[0], &pair[1], limits)).sum::<f64>();
        let (a, b) = (rng.random_range(0.0..1.0) * total, rng.random_range(0.0..1.0) * total);
        let (first, second) = (place(waypoints, limits, a.min(b)), place(waypoints, limits, a.max(b)));
        if first.0 == second.0 {
            continue;
        }
        let mut shorter = waypoints[..=first.0].to_vec();
        shorter.extend([first.1, second.1]);
        shorter.extend_from_slice(&waypoints[second.0 + 1..]);
        if cost_secs(&shorter, limits) < cost_secs(waypoints, limits) - MIN_GAIN_SECS
            && checker.is_edge_free(&first.1, &second.1)
        {
            *waypoints = shorter;
            skip_waypoints(checker, waypoints);
        }
        move_waypoint(checker, limits, waypoints, rng);
    }
}

/// Moves a random waypoint to a random point nearby if the path is then faster. This tightens the path around an edge
/// of an obstacle.
fn move_waypoint(checker: &mut Checker<'_>, limits: &JointLimits, waypoints: &mut [JointVector], rng: &mut Pcg64Mcg) {
    /// Maximum movement of a joint, as its duration at full speed, s.
    const MAX_MOVE_SECS: f64 = 0.3;
    /// Number of points that are compared by cost. Only the best one is checked for collisions.
    const NUM_PLACES: usize = 16;
    if waypoints.len() <= 2 {
        return;
    }
    let moved = rng.random_range(1..waypoints.len() - 1);
    let [before, here, after] = [moved - 1, moved, moved + 1].map(|index| waypoints[index]);
    let secs = |place: &JointVector| motion_secs(&before, place, limits) + motion_secs(place, &after, limits);
    let reach_secs = MAX_MOVE_SECS * rng.random_range(0.0..1.0f64).powi(2);
    let mut best = (secs(&here) - MIN_GAIN_SECS, None);
    for _ in 0..NUM_PLACES {
        let offset = JointVector::from_fn(|joint, _| limits.velocity_max[joint] * rng.random_range(-1.0..=1.0));
        let place = (here + offset * reach_secs).sup(&limits.position_min).inf(&limits.position_max);
        if secs(&place) < best.0 {
            best = (secs(&place), Some(place));
        }
    }
    if let Some(place) = best.1
        && checker.is_edge_free(&before, &place)
        && checker.is_edge_free(&place, &after)
    {
        waypoints[moved] = place;
    }
}

/// Skips waypoints: from each waypoint, the path goes straight to the last waypoint that can be reached in this way.
fn skip_waypoints(checker: &mut Checker<'_>, waypoints: &mut Vec<JointVector>) {
    let mut kept = vec![waypoints[0]];
    let mut at = 0;
    while at + 1 < waypoints.len() {
        let next = (at + 2..waypoints.len())
            .rev()
            .find(|&next| checker.is_edge_free(&waypoints[at], &waypoints[next]))
            .unwrap_or(at + 1);
        kept.push(waypoints[next]);
        at = next;
    }
    *waypoints = kept;
}

/// The index of the last waypoint before a time (s, at full speed), and the configuration at that time.
fn place(waypoints: &[JointVector], limits: &JointLimits, mut secs: f64) -> (usize, JointVector) {
    for (index, pair) in waypoints.windows(2).enumerate() {
        let duration_secs = motion_secs(&pair[0], &pair[1], limits);
        if secs <= duration_secs && duration_secs > 0.0 {
            return (index, pair[0] + (pair[1] - pair[0]) * (secs / duration_secs));
        }
        secs -= duration_secs;
    }
    (waypoints.len() - 2, waypoints[waypoints.len() - 1])
}
