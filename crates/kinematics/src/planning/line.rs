//! Straight motions of the tcp among obstacles, for approach and retreat.

use nalgebra::Isometry3;

use crate::collision::Checker;
use crate::error::KinematicsError;
use crate::geometry::ArmGeometry;
use crate::joints::JointVector;
use crate::path::{JointPath, LineOptions};

/// A straight motion of the tcp, and its free fraction.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedLine {
    /// Fraction of the motion that can be followed without a forbidden contact and within the joint limits, 0 to 1.
    pub share: f64,
    /// The whole motion, if [`CheckedLine::share`] is 1.
    pub path: Option<JointPath>,
    /// The reason why the motion is blocked, if the fraction is below 1.
    pub blocked_by: Option<String>,
}

/// Follows the straight line from the tcp's pose at `start` to a pose, and checks it with the checker's model.
///
/// The model defines the allowed contacts (of the fingers with the part, of the part with the table), see
/// [`crate::collision::CollisionModel::allow`].
///
/// # Errors
/// [`KinematicsError`] for invalid input. A line that cannot be followed is not an error: its fraction is below 1.
pub fn checked_line(
    arm: &ArmGeometry,
    checker: &mut Checker<'_>,
    start: &JointVector,
    base_from_tcp_end: &Isometry3<f64>,
) -> Result<CheckedLine, KinematicsError> {
    let whole = arm.straight_path(start, base_from_tcp_end, &LineOptions::default());
    let (path, reached_share, ended_by) = match whole {
        Ok(path) => (Some(path), 1.0, None),
        Err(
            error @ (KinematicsError::PathJointLimit { at_share, .. } | KinematicsError::PathBlocked { at_share, .. }),
        ) => {
            // The path up to that point may be blocked as well.
            let base_from_start = arm.forward(start);
            let share = at_share * FOLLOWED_AGAIN;
            let end = base_from_start.lerp_slerp(base_from_tcp_end, share);
            (arm.straight_path(start, &end, &LineOptions::default()).ok(), share, Some(error.to_string()))
        }
        Err(error) => return Err(error),
    };
    let Some(path) = path else {
        return Ok(CheckedLine { share: 0.0, path: None, blocked_by: ended_by });
    };
    Ok(match first_blocked(checker, &path) {
        Some((share, why)) => CheckedLine { share: share * reached_share, path: None, blocked_by: Some(why) },
        None if ended_by.is_some() => CheckedLine { share: reached_share, path: None, blocked_by: ended_by },
        None => CheckedLine { share: 1.0, path: Some(path), blocked_by: None },
    })
}

/// If only a part of a path can be followed, this fraction of the part is followed again for the check, because at the
/// part's end a joint reaches its limit or the arm a singularity.
const FOLLOWED_AGAIN: f64 = 0.98;

/// The start of the first blocked piece of a path, as a fraction of the path, and the reason.
fn first_blocked(checker: &mut Checker<'_>, path: &JointPath) -> Option<(f64, String)> {
    let margin_mm = checker.margin_m() * 1e3;
    let why = |checker: &Checker<'_>, q: &JointVector| {
        format!("{}, at least {margin_mm:.1} mm are required", checker.model().nearest(q))
    };
    let waypoints: Vec<&JointVector> = path.waypoints().collect();
    if !checker.is_free(waypoints[0]) {
        return Some((0.0, why(checker, waypoints[0])));
    }
    let num_pieces = waypoints.len() - 1;
    for (piece, pair) in waypoints.windows(2).enumerate() {
        // Between waypoints, the joints' path is straight except for a few µm.
        if let Some(share) = checker.blocked_share(pair[0], pair[1]) {
            let q = pair[0] + (pair[1] - pair[0]) * share;
            return Some((piece as f64 / num_pieces as f64, why(checker, &q)));
        }
    }
    None
}
