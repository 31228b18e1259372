//! The fastest timing along a rounded path: `s(t)` from rest to rest within all limits.
//!
//! ```text
//! path ──► grid of linear constraints on (s̈, ṡ²) ──► backward and forward pass ──► mean over a window ──► stretched until all limits are kept
//!               ▲                                                                        │
//!               └──────────────── limits lowered where the mean violates one ◄───────────┘
//! ```
//!
//! Without a jerk limit, the time optimum along a path is known up to the resolution of the grid (phase_plane.rs), but
//! s̈ jumps. With the mean of s̈ over a moving time window (profile.rs), the jerk is at most the jump divided by the
//! window's length, and the motion takes longer only by that length: 2 or 4 ms with Franka's limits. Limits
//! that the mean violates, mainly in corners, are lowered there for another pass; remaining violations are removed by
//! stretching the time of the whole motion.

mod check;
mod grid;
mod limits;
mod phase_plane;
mod profile;

use check::Worst;
use grid::{Grid, Tightening};
pub(crate) use limits::MotionLimits;
pub(crate) use profile::Profile;

use crate::error::KinematicsError;
use crate::rounded_path::RoundedPath;

/// `s(t)` on a path.
#[derive(Debug, Clone)]
pub(crate) struct Timing {
    pub(crate) profile: Profile,
    /// Duration of the motion divided by the duration of the profile.
    pub(crate) stretch: f64,
    /// Duration of the time optimum without a jerk limit, s.
    pub(crate) jerkless_secs: f64,
}

/// Maximum number of passes, including the first, which has no lowered limits; most motions need three or four.
const MAX_PASSES: usize = 6;
/// Limits violated by less than this fraction are left to the stretching.
const TOLERANCE: f64 = 1e-3;
/// Maximum time between checked points, s.
const COARSE_SECS: f64 = 4e-3;
const FINE_SECS: f64 = 1e-3;
/// Margin between the checked maximum and the limit, for values between checked points.
const HEADROOM: f64 = 1.0005;

/// Computes the timing of a path.
///
/// # Errors
/// [`KinematicsError::Trajectory`] if the arm cannot hold its own weight and load on the path, or cannot continue at a
/// point of it within its limits.
pub(crate) fn time(path: &RoundedPath, limits: &MotionLimits<'_>) -> Result<Timing, KinematicsError> {
    let grid = Grid::new(path, limits)?;
    let mut tightening = Tightening::none(&grid);
    let ramp_secs = limits.joints.acceleration_max.component_div(&limits.joints.jerk_max).max();
    // The time from zero to the full acceleration; twice as long for a change from one extreme to the other.
    let mut window_secs = ramp_secs;
    let mut jerkless_secs = None;
    let mut best: Option<(f64, Profile)> = None;
    for _ in 0..MAX_PASSES {
        let phases = match phase_plane::fastest(&grid, &tightening) {
            // A motion within lowered limits is only used if it is better.
            Err(_) if best.is_some() => break,
            phases => phases?,
        };
        let profile = Profile::new(&phases, window_secs);
        let optimum_secs = *jerkless_secs.get_or_insert(profile.duration_secs() - window_secs);
        let worst = Worst::of(path, &profile, limits, COARSE_SECS, &mut tightening, &grid);
        let secs = profile.duration_secs() * worst.stretch();
        if best.as_ref().is_none_or(|(best_secs, _)| secs < *best_secs) {
            best = Some((secs, profile));
        }
        if worst.stretch() < 1.0 + TOLERANCE || secs < optimum_secs * (1.0 + TOLERANCE) {
            break;
        }
        if window_secs == ramp_secs && worst.is_jump() {
            window_secs = 2.0 * ramp_secs;
            tightening = Tightening::none(&grid);
        }
    }
    let (_, profile) = best.expect("there is at least one pass");
    let stretch = Worst::of(path, &profile, limits, FINE_SECS, &mut tightening, &grid).stretch() * HEADROOM;
    Ok(Timing { profile, stretch, jerkless_secs: jerkless_secs.unwrap_or(0.0) })
}

#[cfg(test)]
mod tests;
