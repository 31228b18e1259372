//! Rounds corners: the arm then follows a path without stopping at waypoints, where this is free of collisions.

use crate::collision::Checker;
use crate::joints::JointVector;
use crate::rounded_path::{Corner, RoundedPath, length_secs};

/// Factor between the sizes that are tried for a corner, down to the minimum. Below the minimum the arm stops instead.
const SMALLER: f64 = 0.7;
const MIN_SIZE_SECS: f64 = 2e-3;
/// Minimum increase, as a factor of the known free size, for which a larger size is checked.
const MIN_GROWTH: f64 = 1.15;

/// The path through waypoints, with corners as large as the space and the obstacles allow, each proven to be free as a
/// whole. If no rounding of a waypoint is free, there are several paths, each starting where the previous one ends.
pub(super) fn round(checker: &mut Checker<'_>, waypoints: &[JointVector]) -> Vec<RoundedPath> {
    let mut waypoints = waypoints.to_vec();
    waypoints.dedup_by(|next, before| length_secs(before, next) < MIN_LENGTH_SECS);
    if waypoints.len() < 2 {
        return Vec::new();
    }
    let lengths: Vec<f64> = waypoints.windows(2).map(|pair| length_secs(&pair[0], &pair[1])).collect();
    let corners: Vec<Corner> =
        waypoints.windows(3).map(|three| Corner { before: three[0], waypoint: three[1], after: three[2] }).collect();
    let last = corners.len();
    let mut sizes = vec![0.0; corners.len()];
    // First, each corner gets half of the straight parts beside it, or all of a part that starts or ends the path. Then
    // it gets the length that its neighbours did not use.
    for index in 0..last {
        let before = lengths[index] * if index == 0 { 1.0 } else { 0.5 };
        let after = lengths[index + 1] * if index + 1 == last { 1.0 } else { 0.5 };
        sizes[index] = largest_free(checker, &corners[index], before.min(after), 0.0);
    }
    for index in 0..last {
        let before = lengths[index] - if index == 0 { 0.0 } else { sizes[index - 1] };
        let after = lengths[index + 1] - sizes.get(index + 1).copied().unwrap_or(0.0);
        sizes[index] = largest_free(checker, &corners[index], before.min(after), sizes[index]);
    }
    split_at_stops(&waypoints, &sizes)
}

/// The largest of the tried sizes up to `room` for which the corner is free; otherwise `known_free`, which is 0 if no
/// size is known to be free.
fn largest_free(checker: &mut Checker<'_>, corner: &Corner, room: f64, known_free: f64) -> f64 {
    let mut size = room;
    while size > (known_free * MIN_GROWTH).max(MIN_SIZE_SECS) {
        let piece = corner.rounded(size, 0.0);
        let at = |share: f64| piece.at(share * piece.length).q;
        if checker.blocked_share_of_curve(at, &piece.max_turns()).is_none() {
            return size;
        }
        size *= SMALLER;
    }
    known_free
}

fn split_at_stops(waypoints: &[JointVector], sizes: &[f64]) -> Vec<RoundedPath> {
    let mut ways = Vec::new();
    let mut first = 0;
    for (index, size) in sizes.iter().enumerate() {
        if *size == 0.0 {
            ways.push(RoundedPath::new(&waypoints[first..=index + 1], &sizes[first..index]));
            first = index + 1;
        }
    }
    ways.push(RoundedPath::new(&waypoints[first..], &sizes[first..]));
    ways
}

/// Waypoints closer together than this are one waypoint.
const MIN_LENGTH_SECS: f64 = 1e-9;
