//! Finds configurations that reach a goal: all branches of the arm at many angles of joint 7. Only the
//! collision-free ones are kept.

use nalgebra::Isometry3;

use super::error::PlanError;
use super::shortcut::motion_secs;
use crate::analytic::analytic_solutions;
use crate::check::check_pose;
use crate::collision::Checker;
use crate::geometry::ArmGeometry;
use crate::ik::IkOptions;
use crate::joints::JointVector;

/// Number of angles of joint 7 that are tried.
const NUM_ANGLES: usize = 48;
/// Maximum number of configurations that are kept, the fastest to reach.
const MAX_KEPT: usize = 24;
/// Minimum difference between configurations that are kept, rad.
const MIN_APART_RAD: f64 = 0.25;
/// Positions up to this far beyond a limit are rounding errors, rad.
const LIMIT_ROUNDING_RAD: f64 = 1e-9;

/// A configuration that reaches a goal.
#[derive(Debug, Clone, Copy)]
pub(super) struct GoalConfiguration {
    pub(super) q: JointVector,
    /// The index of the goal pose.
    pub(super) pose_idx: usize,
}

/// The collision-free configurations of all poses, the fastest to reach from `start` first.
///
/// # Errors
/// A pose is invalid, no pose can be reached, or all configurations are blocked.
pub(super) fn free_configurations(
    arm: &ArmGeometry,
    checker: &mut Checker<'_>,
    start: &JointVector,
    poses: &[Isometry3<f64>],
) -> Result<Vec<GoalConfiguration>, PlanError> {
    if poses.is_empty() {
        return Err(PlanError::NoGoal);
    }
    let mut reaching = Vec::new();
    for (pose_idx, pose) in poses.iter().enumerate() {
        check_pose("the pose", pose).map_err(|cause| PlanError::Kinematics { what: "the goal".to_owned(), cause })?;
        reaching.extend(configurations(arm, start, pose).into_iter().map(|q| GoalConfiguration { q, pose_idx }));
    }
    if reaching.is_empty() {
        // The grid may miss poses that are reached only in a narrow range of angles. Inverse kinematics searches more
        // finely, and gives the reason of a failure.
        for (pose_idx, pose) in poses.iter().enumerate() {
            match arm.inverse(pose, start, &IkOptions::default()) {
                Ok(solution) => reaching.push(GoalConfiguration { q: solution.q, pose_idx }),
                Err(cause) if pose_idx + 1 == poses.len() && reaching.is_empty() => {
                    return Err(PlanError::Kinematics { what: "the goal".to_owned(), cause });
                }
                Err(_) => {}
            }
        }
    }
    free_of(arm, checker, start, reaching)
}

/// The collision-free ones of these configurations, the fastest to reach from `start` first: at most [`MAX_KEPT`], all
/// at least [`MIN_APART_RAD`] apart.
///
/// # Errors
/// There are no configurations, or all are blocked.
pub(super) fn free_of(
    arm: &ArmGeometry,
    checker: &mut Checker<'_>,
    start: &JointVector,
    reaching: Vec<GoalConfiguration>,
) -> Result<Vec<GoalConfiguration>, PlanError> {
    if reaching.is_empty() {
        return Err(PlanError::NoGoal);
    }
    let configurations: Vec<JointVector> = reaching.iter().map(|goal| goal.q).collect();
    let distances = checker.distances_m(&configurations);
    let mut free: Vec<GoalConfiguration> = reaching
        .iter()
        .zip(&distances)
        .filter(|(_, distance_m)| **distance_m >= checker.margin_m())
        .map(|(goal, _)| *goal)
        .collect();
    if free.is_empty() {
        let freest = (0..distances.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let freest = freest.expect("configurations that reach the goal were found above");
        return Err(PlanError::GoalBlocked {
            num_configurations: reaching.len(),
            nearest: checker.model().nearest(&configurations[freest]),
            margin_m: checker.margin_m(),
        });
    }
    let secs = |goal: &GoalConfiguration| motion_secs(start, &goal.q, &arm.limits);
    free.sort_by(|a, b| secs(a).total_cmp(&secs(b)));
    let mut kept: Vec<GoalConfiguration> = Vec::new();
    for goal in free {
        if kept.len() < MAX_KEPT && kept.iter().all(|other| (other.q - goal.q).norm() >= MIN_APART_RAD) {
            kept.push(goal);
        }
    }
    Ok(kept)
}

fn configurations(arm: &ArmGeometry, start: &JointVector, pose: &Isometry3<f64>) -> Vec<JointVector> {
    if arm.closed_form.is_none() {
        let solutions = arm.inverse_all(pose, start, &IkOptions::default());
        return solutions.map_or_else(|_| Vec::new(), |found| found.into_iter().map(|solution| solution.q).collect());
    }
    let limits = &arm.limits;
    let base_from_flange = pose * arm.flange_from_tcp().inverse();
    let (low, high) = (limits.position_min[6], limits.position_max[6]);
    let grid = (0..NUM_ANGLES).map(|i| low + (high - low) * (i as f64 + 0.5) / NUM_ANGLES as f64);
    grid.flat_map(|q7| analytic_solutions(arm, &base_from_flange, q7, start[0]))
        .flatten()
        .filter(|solution| solution.infeasibility <= 0.0)
        .map(|solution| solution.q)
        .filter(|q| limits.worst_violation(q, LIMIT_ROUNDING_RAD).is_none())
        .collect()
}
