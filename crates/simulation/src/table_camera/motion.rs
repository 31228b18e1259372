//! The motion of an object on the table: straight for a while, then in another direction, always within its bounds.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Range of the duration of one direction, in seconds.
const STRAIGHT_SECS: Range<f64> = 0.6..1.6;

/// The allowed range of an object, in the robot's base frame, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) x_m: [f64; 2],
    pub(super) y_m: [f64; 2],
}

impl Bounds {
    /// The bounds reduced by a distance on every side, at most to their centre.
    pub(super) fn shrunk(&self, by_m: f64) -> Self {
        let shrunk = |[low, high]: [f64; 2]| {
            let middle = 0.5 * (low + high);
            [(low + by_m).min(middle), (high - by_m).max(middle)]
        };
        Self { x_m: shrunk(self.x_m), y_m: shrunk(self.y_m) }
    }

    fn any_place(&self, rng: &mut Pcg64Mcg) -> Point2<f64> {
        let mut between = |[low, high]: [f64; 2]| low + (high - low) * rng.random_range(0.0..1.0);
        Point2::new(between(self.x_m), between(self.y_m))
    }
}

/// A moving object.
#[derive(Debug, Clone)]
pub(super) struct Mover {
    bounds: Bounds,
    speed_m_s: f64,
    turn_rad_s: f64,
    rng: Pcg64Mcg,
    pub(super) place: Point2<f64>,
    pub(super) yaw_rad: f64,
    direction: Vector2<f64>,
    turn_sign: f64,
    straight_secs: f64,
}

impl Mover {
    pub(super) fn new(bounds: Bounds, speed_m_s: f64, turn_rad_s: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let place = bounds.any_place(&mut rng);
        let yaw_rad = rng.random_range(-PI..PI);
        let mut made = Self {
            bounds,
            speed_m_s,
            turn_rad_s,
            rng,
            place,
            yaw_rad,
            direction: Vector2::zeros(),
            turn_sign: 1.0,
            straight_secs: 0.0,
        };
        made.change_direction();
        made
    }

    fn change_direction(&mut self) {
        let heading = self.rng.random_range(-PI..PI);
        self.direction = Vector2::new(heading.cos(), heading.sin());
        self.turn_sign = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        self.straight_secs = self.rng.random_range(STRAIGHT_SECS);
    }

    /// Moves the object for `secs`.
    pub(super) fn advance(&mut self, secs: f64) {
        self.straight_secs -= secs;
        if self.straight_secs <= 0.0 {
            self.change_direction();
        }
        self.yaw_rad += self.turn_sign * self.turn_rad_s * secs;
        self.place += self.direction * (self.speed_m_s * secs);
        for (k, [low, high]) in [(0, self.bounds.x_m), (1, self.bounds.y_m)] {
            if !(low..=high).contains(&self.place[k]) {
                self.place[k] = self.place[k].clamp(low, high);
                self.direction[k] = -self.direction[k];
            }
        }
    }

    /// Moves the object to a random position within its bounds, at a random angle.
    pub(super) fn put_elsewhere(&mut self) {
        self.place = self.bounds.any_place(&mut self.rng);
        self.yaw_rad = self.rng.random_range(-PI..PI);
        self.change_direction();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { x_m: [0.3, 0.6], y_m: [-0.1, 0.2] };

    #[test]
    fn it_goes_at_its_speed_turns_and_stays_within_its_bounds() {
        let mut mover = Mover::new(BOUNDS, 0.05, 0.5, 3);
        let mut changes = 0;
        for _ in 0..2000 {
            let (place, yaw, direction) = (mover.place, mover.yaw_rad, mover.direction);
            mover.advance(0.01);
            assert!(
                (mover.place - place).norm() <= 0.0005 + 1e-12 && ((mover.yaw_rad - yaw).abs() - 0.005).abs() < 1e-12
            );
            assert!(BOUNDS.x_m[0] <= mover.place.x && mover.place.x <= BOUNDS.x_m[1]);
            assert!(BOUNDS.y_m[0] <= mover.place.y && mover.place.y <= BOUNDS.y_m[1]);
            changes += usize::from(mover.direction != direction);
        }
        // In 20 seconds, the direction changes every 0.6 to 1.6 s, and at the borders.
        assert!((12..=40).contains(&changes), "{changes}");
    }

    #[test]
    fn bounds_too_small_leave_their_middle() {
        let none = BOUNDS.shrunk(1.0);
        assert!((none.x_m[0] - 0.45).abs() < 1e-12 && none.x_m[0] == none.x_m[1]);
        let mut mover = Mover::new(none, 0.05, 0.5, 3);
        mover.advance(0.01);
        assert!((mover.place - Point2::new(0.45, 0.05)).norm() < 1e-12);
    }
}
