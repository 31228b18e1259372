//! A path through waypoints with rounded corners, in joint space.
//!
//! On a straight part, q' = u is constant. Around a waypoint, q' changes from the unit direction u₀ of the previous
//! part to the direction u₁ of the next one: `q' = u₀ + (u₁ - u₀) (3x² - 2x³)`, with x from 0 to 1 over a length 2d, d
//! before the waypoint and d after it. The path is therefore twice continuously differentiable, its third derivative is
//! bounded, and each joint's q' is between its values on the two parts.
//!
//! A length is the time, in seconds, that the slowest joint takes at the Panda's full speed, for any arm: max |Δq| /
//! velocity.

use crate::joints::{JointVector, NUM_JOINTS};
use crate::path::PathPoint;

/// A path through waypoints without stops between its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundedPath {
    pieces: Vec<Piece>,
    start: JointVector,
    end: JointVector,
}

/// A part of a path that is straight, or a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Start of the piece on the path.
    pub(crate) from: f64,
    pub(crate) length: f64,
    start: JointVector,
    direction: JointVector,
    /// The change of the direction; zero on a straight part.
    change: JointVector,
}

/// The corner around a waypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    pub(crate) before: JointVector,
    pub(crate) waypoint: JointVector,
    pub(crate) after: JointVector,
}

/// The speeds that define lengths, rad/s.
const SPEEDS_RAD_S: [f64; NUM_JOINTS] = [2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100];

/// Time of the slowest joint at those speeds, s.
pub(crate) fn length_secs(from: &JointVector, to: &JointVector) -> f64 {
    (to - from).abs().component_div(&JointVector::from(SPEEDS_RAD_S)).max()
}

fn direction(from: &JointVector, to: &JointVector) -> JointVector {
    (to - from) / length_secs(from, to)
}

impl Corner {
    /// The corner that starts at the distance `size_secs` (s) before the waypoint and ends at the same distance after
    /// it.
    pub(crate) fn rounded(&self, size_secs: f64, from: f64) -> Piece {
        let (one, other) = (direction(&self.before, &self.waypoint), direction(&self.waypoint, &self.after));
        Piece {
            from,
            length: 2.0 * size_secs,
            start: self.waypoint - one * size_secs,
            direction: one,
            change: other - one,
        }
    }
}

impl Piece {
    /// Configuration and derivatives at this distance from the start of the piece.
    pub(crate) fn at(&self, along: f64) -> PathPoint {
        let x = along / self.length;
        let turned = x * x * (3.0 - 2.0 * x);
        let turned_so_far = along * x * x * (1.0 - 0.5 * x);
        PathPoint {
            q: self.start + self.direction * along + self.change * turned_so_far,
            dq: self.direction + self.change * turned,
            ddq: self.change * (6.0 * x * (1.0 - x) / self.length),
            dddq: self.change * ((6.0 - 12.0 * x) / (self.length * self.length)),
        }
    }

    /// Upper bound of the angle that each joint covers along the piece, from its largest rate.
    pub(crate) fn max_turns(&self) -> JointVector {
        self.direction.abs().sup(&(self.direction + self.change).abs()) * self.length
    }

    pub(crate) fn is_straight(&self) -> bool {
        self.change == JointVector::zeros()
    }
}

impl RoundedPath {
    /// Creates a path through waypoints (rad), no two successive ones equal. `corner_secs` has the size of the corner
    /// at each inner waypoint: the distance of the corner's start and end from the waypoint, s at full speed.
    ///
    /// # Panics
    /// If the numbers do not match, two successive waypoints are equal, a size is not positive, or corners overlap.
    pub fn new(waypoints: &[JointVector], corner_secs: &[f64]) -> Self {
        assert!(waypoints.len() >= 2 && corner_secs.len() == waypoints.len() - 2, "one corner for each inner waypoint");
        let mut pieces = Vec::with_capacity(2 * waypoints.len());
        let mut from = 0.0;
        for (index, pair) in waypoints.windows(2).enumerate() {
            let length = length_secs(&pair[0], &pair[1]);
            assert!(length > 0.0, "waypoint {index} equals the next one");
            let before = if index == 0 { 0.0 } else { corner_secs[index - 1] };
            let after = corner_secs.get(index).copied().unwrap_or(0.0);
            let straight = length - before - after;
            assert!(straight > -ROUNDING * length, "corners {corner_secs:?} overlap");
            if straight > ROUNDING * length {
                let along = direction(&pair[0], &pair[1]);
                let start = pair[0] + along * before;
                pieces.push(Piece { from, length: straight, start, direction: along, change: JointVector::zeros() });
                from += straight;
            }
            if let Some(&size_secs) = corner_secs.get(index) {
                assert!(size_secs > 0.0, "a corner's size is positive, found {size_secs}");
                let corner = Corner { before: pair[0], waypoint: pair[1], after: waypoints[index + 2] };
                let piece = corner.rounded(size_secs, from);
                from += piece.length;
                pieces.push(piece);
            }
        }
        Self { pieces, start: waypoints[0], end: waypoints[waypoints.len() - 1] }
    }

    /// Length: the time of the slowest joint at the Panda's full speed, s.
    pub fn length_secs(&self) -> f64 {
        self.pieces.last().map_or(0.0, |last| last.from + last.length)
    }

    /// The start, rad.
    pub fn start(&self) -> &JointVector {
        &self.start
    }

    /// The end, rad.
    pub fn end(&self) -> &JointVector {
        &self.end
    }

    /// The configuration and its derivatives at a length (s), which is clamped to the path: rad, rad/s, rad/s², rad/s³,
    /// as if the path were followed at full speed.
    pub fn at(&self, length_secs: f64) -> PathPoint {
        let along = length_secs.clamp(0.0, self.length_secs());
        let next = self.pieces.partition_point(|piece| piece.from <= along);
        let piece = &self.pieces[next.saturating_sub(1)];
        piece.at((along - piece.from).min(piece.length))
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }
}

/// A straight part shorter than this fraction of the distance between two waypoints is a rounding error.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_poses::random_configuration;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn a_right_angle_of_two_joints_is_rounded_as_computed_by_hand() {
        // Joints 1 and 2 rotate one after the other for a second each at 2.175 rad/s; the corner begins half a second
        // before the waypoint.
        let zero = JointVector::zeros();
        let (mut middle, mut end) = (zero, zero);
        middle[0] = 2.175;
        (end[0], end[1]) = (2.175, 2.175);
        let path = RoundedPath::new(&[zero, middle, end], &[0.5]);
        assert!((path.length_secs() - 2.0).abs() < 1e-12);
        // At the middle of the corner, x = 1/2 and 0.5 s after its start, joint 2 has moved as in 0.5 s · (1/4) · (3/4)
        // = 0.09375 s at full speed; joint 1 is short of the waypoint by the same time.
        let half = path.at(1.0);
        assert!((half.q[0] - 2.175 * (1.0 - 0.09375)).abs() < 1e-12, "{}", half.q);
        assert!((half.q[1] - 2.175 * 0.09375).abs() < 1e-12, "{}", half.q);
        assert!((half.dq[0] - 2.175 * 0.5).abs() < 1e-12 && (half.ddq[1] - 2.175 * 1.5).abs() < 1e-12);
        assert_eq!((path.at(-1.0).q, (path.at(5.0).q - end).amax() < 1e-12), (zero, true));
    }

    #[test]
    fn derivatives_agree_with_differences_and_corners_keep_to_their_rates() {
        const STEP: f64 = 1e-6;
        let mut rng = Pcg64Mcg::seed_from_u64(51);
        for _ in 0..30 {
            let waypoints: Vec<JointVector> = (0..5).map(|_| random_configuration(&mut rng)).collect();
            let lengths: Vec<f64> = waypoints.windows(2).map(|pair| length_secs(&pair[0], &pair[1])).collect();
            let sizes: Vec<f64> = lengths.windows(2).map(|two| 0.5 * two[0].min(two[1])).collect();
            let path = RoundedPath::new(&waypoints, &sizes);
            for _ in 0..100 {
                let at = rng.random_range(STEP..path.length_secs() - STEP);
                let [before, here, after] = [-STEP, 0.0, STEP].map(|step| path.at(at + step));
                assert!(((after.q - before.q) / (2.0 * STEP) - here.dq).amax() < 1e-4);
                assert!((after.dq - before.dq).amax() < 3.0 * STEP * here.ddq.amax().max(1e3));
            }
            for piece in path.pieces() {
                for share in [0.0, 0.2, 0.5, 0.9, 1.0] {
                    let rate = piece.at(share * piece.length).dq.abs() * piece.length;
                    assert!((piece.max_turns() - rate).min() > -1e-9);
                }
                let (from, to) = (path.at(piece.from - STEP), path.at(piece.from + STEP));
                assert!((from.q - to.q).amax() < 1e-4 && (from.dq - to.dq).amax() < 1e-3);
            }
        }
    }
}
