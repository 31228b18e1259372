//! Motion along a path, `s(t)`: the moving average of a piecewise quadratic s₀ over a time window.
//!
//! With P the integral of s₀ and w the window's length, `s(t) = (P(t) - P(t - w)) / w`; its derivatives follow in the
//! same way from s₀, ṡ₀ and s̈₀. The result is exact, and continuous up to s̈.

use super::phase_plane::Phase;

/// `s` and its derivatives with respect to time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Progress {
    pub(crate) s: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

/// A profile from rest at 0 to rest at the path's end.
#[derive(Debug, Clone)]
pub(crate) struct Profile {
    knots: Vec<Knot>,
    window_secs: f64,
}

/// The start of a phase of constant s̈.
#[derive(Debug, Clone, Copy)]
struct Knot {
    time: f64,
    s: f64,
    velocity: f64,
    acceleration: f64,
    /// Integral of s up to the knot.
    integral: f64,
}

impl Knot {
    /// The integral of s, and s, ṡ and s̈, at this time after the knot.
    fn after(&self, secs: f64) -> [f64; 4] {
        let Self { s, velocity, acceleration, integral, .. } = *self;
        [
            integral + secs * (s + secs * (velocity / 2.0 + secs * acceleration / 6.0)),
            s + secs * (velocity + secs * acceleration / 2.0),
            velocity + secs * acceleration,
            acceleration,
        ]
    }
}

impl Profile {
    pub(super) fn new(phases: &[Phase], window_secs: f64) -> Self {
        let mut knots = Vec::with_capacity(phases.len() + 1);
        let mut knot = Knot { time: 0.0, s: 0.0, velocity: 0.0, acceleration: 0.0, integral: 0.0 };
        for &Phase { length, speeds: [from, to] } in phases {
            let secs = 2.0 * length / (from + to);
            (knot.velocity, knot.acceleration) = (from, (to - from) / secs);
            knots.push(knot);
            let [integral, ..] = knot.after(secs);
            knot = Knot { time: knot.time + secs, s: knot.s + length, velocity: to, acceleration: 0.0, integral };
        }
        knot.velocity = 0.0;
        knots.push(knot);
        Self { knots, window_secs }
    }

    pub(crate) fn duration_secs(&self) -> f64 {
        self.knots[self.knots.len() - 1].time + self.window_secs
    }

    /// The state at a time; at rest before the start and after the end.
    pub(crate) fn at(&self, time: f64) -> Progress {
        let [integral, s, velocity, acceleration] = self.before_mean(time);
        let [integral_before, s_before, velocity_before, acceleration_before] =
            self.before_mean(time - self.window_secs);
        let over = |now: f64, before: f64| (now - before) / self.window_secs;
        Progress {
            s: over(integral, integral_before),
            velocity: over(s, s_before),
            acceleration: over(velocity, velocity_before),
            jerk: over(acceleration, acceleration_before),
        }
    }

    /// Times between which the jerk is constant, with further ones so that successive times are at most `max_secs`
    /// apart.
    pub(super) fn times(&self, max_secs: f64) -> Vec<f64> {
        let mut jumps: Vec<f64> =
            self.knots.iter().flat_map(|knot| [knot.time, knot.time + self.window_secs]).collect();
        jumps.sort_by(f64::total_cmp);
        let mut times = Vec::with_capacity(2 * jumps.len());
        for pair in jumps.windows(2) {
            let num_parts = ((pair[1] - pair[0]) / max_secs).ceil() as usize;
            times.extend((0..num_parts).map(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / num_parts as f64));
        }
        times.push(self.duration_secs());
        times
    }

    /// The time at which `s` is reached.
    pub(super) fn time_at(&self, s: f64) -> f64 {
        /// Number of bisections of a motion's duration: an error of less than a nanosecond per minute.
        const NUM_HALVINGS: usize = 40;
        let (mut before, mut after) = (0.0, self.duration_secs());
        for _ in 0..NUM_HALVINGS {
            let middle = 0.5 * (before + after);
            if self.at(middle).s < s {
                before = middle;
            } else {
                after = middle;
            }
        }
        before
    }

    /// The indices of the phases that the average at a time includes.
    pub(super) fn phases_at(&self, time: f64) -> std::ops::RangeInclusive<usize> {
        let last = self.knots.len() - 2;
        self.index(time - self.window_secs).min(last)..=self.index(time).min(last)
    }

    fn index(&self, time: f64) -> usize {
        self.knots.partition_point(|knot| knot.time <= time).saturating_sub(1)
    }

    fn before_mean(&self, time: f64) -> [f64; 4] {
        if time <= 0.0 {
            return [0.0; 4];
        }
        let knot = &self.knots[self.index(time)];
        knot.after(time - knot.time)
    }
}
