//! The time optimum along a path without a jerk limit.
//!
//! Backwards from rest at the end: at each point, the largest ṡ² from which the end can be reached. Forwards from rest
//! at the start: always the largest s̈ that keeps ṡ² below that bound. Constraints hold at both ends of a part.
//!
//! # Source
//! H. Pham, Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis", IEEE
//! Transactions on Robotics 2018. The linear programs have two variables; the largest ṡ² is found by Newton's method
//! from above on a concave piecewise linear function.

use super::grid::{Grid, NUM_ROWS, Row, Tightening};
use crate::error::KinematicsError;

/// A part of the path with constant s̈.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase {
    pub(super) length: f64,
    /// ṡ at the start and at the end.
    pub(super) speeds: [f64; 2],
}

/// Constraints between a point and the next: those of both ends, and the bound of ṡ² at the end.
struct Part {
    rows: [Row; 2 * NUM_ROWS + 1],
    length: f64,
}

/// A bound on s̈ that is linear in ṡ²: its value and its slope.
type Bound = (f64, f64);

/// A row with a smaller slope only bounds ṡ².
const FLAT: f64 = 1e-9;
/// If the lower bound on s̈ exceeds the upper one by less than this, the difference is a rounding error.
const ROUNDING: f64 = 1e-10;
const MAX_STEPS: usize = 60;

/// The fastest phases from rest to rest.
///
/// # Errors
/// [`KinematicsError::Trajectory`] if the arm cannot leave a point.
pub(super) fn fastest(grid: &Grid, tightening: &Tightening) -> Result<Vec<Phase>, KinematicsError> {
    let num_parts = grid.places.len() - 1;
    let mut parts: Vec<Part> = (0..num_parts).map(|index| Part::new(grid, index, tightening.shares[index])).collect();
    let mut most = tightening.max_squared.clone();
    most[num_parts] = 0.0;
    for (index, part) in parts.iter_mut().enumerate().rev() {
        part.end_below(most[index + 1]);
        most[index] = part.largest_squared(most[index]);
    }
    let mut squared = 0.0;
    let mut phases = Vec::with_capacity(num_parts);
    for (index, part) in parts.iter().enumerate() {
        let ([_, (acceleration, _)], _) = part.bounds(squared);
        let next = (squared + 2.0 * part.length * acceleration).clamp(0.0, most[index + 1]);
        if squared + next <= 0.0 {
            let reason = format!("the arm cannot continue after {:.1} % of the path within its limits", {
                let end = grid.places[num_parts].s;
                100.0 * grid.places[index].s / end
            });
            return Err(KinematicsError::Trajectory { reason });
        }
        phases.push(Phase { length: part.length, speeds: [squared.sqrt(), next.sqrt()] });
        squared = next;
    }
    Ok(phases)
}

impl Part {
    fn new(grid: &Grid, index: usize, share: f64) -> Self {
        let (here, next) = (&grid.places[index], &grid.places[index + 1]);
        let length = next.s - here.s;
        let mut rows = [Row { slope: 2.0 * length, curvature: 1.0, low: 0.0, high: f64::INFINITY }; 2 * NUM_ROWS + 1];
        for (row, at) in here.rows.iter().enumerate() {
            rows[row] = Row { low: at.low * share, high: at.high * share, ..*at };
        }
        for (row, at) in next.rows.iter().enumerate() {
            // At the end, ṡ² is larger by twice the length times s̈.
            let slope = at.slope + 2.0 * length * at.curvature;
            rows[NUM_ROWS + row] = Row { slope, curvature: at.curvature, low: at.low * share, high: at.high * share };
        }
        Self { rows, length }
    }

    /// Adds an upper bound of ṡ² at the end.
    fn end_below(&mut self, squared: f64) {
        self.rows[2 * NUM_ROWS].high = squared;
    }

    /// The lower and the upper bound on s̈ at a ṡ², and the maximum ṡ² of the rows that only bound ṡ².
    fn bounds(&self, squared: f64) -> ([Bound; 2], f64) {
        let (mut low, mut high) = ((f64::NEG_INFINITY, 0.0), (f64::INFINITY, 0.0));
        let mut most = f64::INFINITY;
        for row in &self.rows {
            if row.slope.abs() < FLAT {
                let limit = if row.curvature > 0.0 { row.high } else { row.low };
                if row.curvature.abs() > FLAT {
                    most = most.min(limit / row.curvature);
                }
                continue;
            }
            let (below, above) = if row.slope > 0.0 { (row.low, row.high) } else { (row.high, row.low) };
            let rate = -row.curvature / row.slope;
            let (below, above) = (below / row.slope + rate * squared, above / row.slope + rate * squared);
            if below > low.0 {
                low = (below, rate);
            }
            if above < high.0 {
                high = (above, rate);
            }
        }
        ([low, high], most)
    }

    /// The largest ṡ² up to `most` for which some s̈ satisfies all rows.
    fn largest_squared(&self, most: f64) -> f64 {
        let mut squared = most.min(self.bounds(0.0).1);
        for _ in 0..MAX_STEPS {
            let ([low, high], _) = self.bounds(squared);
            let gap = high.0 - low.0;
            if gap >= -ROUNDING {
                return squared;
            }
            // The gap is concave, so its tangent lies above it, and the step does not pass the largest valid ṡ².
            let rate = high.1 - low.1;
            if rate >= 0.0 {
                return 0.0;
            }
            squared -= gap / rate;
            if squared <= 0.0 {
                return 0.0;
            }
        }
        squared
    }
}
