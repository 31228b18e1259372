//! Plans a motion from a configuration to the best of several poses, around obstacles.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::corners;
use super::error::PlanError;
use super::goals::{GoalConfiguration, free_configurations, free_of};
use super::line::checked_line;
use super::rrt::{Found, Growth, Samples, Stops, rrt_connect};
use super::shortcut::{cost_secs, motion_secs, shorten};
use crate::check::check_joints;
use crate::collision::{Checker, CollisionModel};
use crate::dynamics::ArmDynamics;
use crate::error::KinematicsError;
use crate::geometry::ArmGeometry;
use crate::joints::JointVector;
use crate::limits::{CartesianLimits, JointLimits};
use crate::path::JointPath;
use crate::rounded_path::RoundedPath;
use crate::trajectory::Trajectory;

/// Options of the planner.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlanOptions {
    /// Seed of the random configurations. The same seed gives the same plan.
    pub seed: u64,
    /// Minimum distance to obstacles, and between links that may not touch, at checked configurations, m. Between
    /// checked configurations, nothing touches.
    pub margin_m: f64,
    /// Maximum length of a motion that is added to a tree at once, rad.
    pub step_rad: f64,
    /// Maximum number of configurations that each search checks.
    pub max_checks: usize,
    /// Number of attempts to shorten a path.
    pub num_shortcuts: usize,
    /// Maximum number of searches if no straight motion leads to a goal; the cheapest path is used.
    pub num_searches: usize,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self { seed: 0, margin_m: 0.003, step_rad: 3.0, max_checks: 3_000_000, num_shortcuts: 120, num_searches: 12 }
    }
}

/// The straight end of a motion: the tcp moves along its own z axis.
#[derive(Debug, Clone, Copy)]
pub struct StraightApproach<'a> {
    /// Length, m.
    pub length_m: f64,
    /// The model with the allowed contacts: the same obstacles, with more pairs that may touch.
    pub model: &'a CollisionModel,
}

/// A path around obstacles.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Configurations with start and end, connected by straight lines in joint space except for the corners, rad.
    pub waypoints: Vec<JointVector>,
    /// The path through the waypoints with rounded corners, usually in one piece. It has several pieces, each starting
    /// where the previous one ends, if a waypoint has no free rounding and the arm must stop there. It is empty if
    /// start and end are the same.
    pub ways: Vec<RoundedPath>,
    /// The straight approach, if one was requested.
    pub approach: Option<JointPath>,
    /// The index of the reached goal pose.
    pub goal_idx: usize,
    /// Number of all checked configurations.
    pub num_checks: usize,
    /// Number of configurations that were checked before the first path was shortened.
    pub num_search_checks: usize,
    /// Approximate durations, s: of the first path before it was shortened, and of the plan; both at full speed and
    /// with stops at the waypoints.
    pub cost_secs: [f64; 2],
}

impl Plan {
    /// The motions in time, each from rest to rest: one along each of [`Plan::ways`], and one along the straight
    /// approach.
    ///
    /// `dynamics` are those of the arm with its load. The torques of the approach are not checked.
    ///
    /// # Errors
    /// The errors of [`Trajectory::along_rounded_path`] and [`Trajectory::along_path`].
    pub fn trajectories(
        &self,
        limits: &JointLimits,
        cartesian_limits: &CartesianLimits,
        dynamics: &ArmDynamics,
    ) -> Result<Vec<Trajectory>, KinematicsError> {
        let ways =
            self.ways.iter().map(|way| Trajectory::along_rounded_path(way.clone(), limits, cartesian_limits, dynamics));
        let approach = self.approach.iter().map(|path| Trajectory::along_path(path.clone(), limits, cartesian_limits));
        ways.chain(approach).collect()
    }

    /// Duration of the motion without the approach if the arm stopped at each waypoint, within the same limits, s.
    ///
    /// # Errors
    /// The errors of [`Trajectory::along_rounded_path`].
    pub fn stopping_secs(
        &self,
        limits: &JointLimits,
        cartesian_limits: &CartesianLimits,
        dynamics: &ArmDynamics,
    ) -> Result<f64, KinematicsError> {
        let parts = self.waypoints.windows(2).filter(|pair| pair[0] != pair[1]);
        parts
            .map(|pair| {
                let straight = RoundedPath::new(pair, &[]);
                let motion = Trajectory::along_rounded_path(straight, limits, cartesian_limits, dynamics)?;
                Ok(motion.duration_secs())
            })
            .sum()
    }
}

impl ArmGeometry {
    /// Plans a motion from `start` to one of several goal poses, around the obstacles of a model.
    ///
    /// All poses of `goals` (rotations of a symmetric part, exchanged fingers) are tried with every branch of the arm
    /// and many angles of joint 7. The result is the fastest straight motion to one of them, or else the cheapest path
    /// found by at most [`PlanOptions::num_searches`] searches towards them. With an approach, the path ends where the
    /// approach starts, at a configuration from which the whole approach is free.
    ///
    /// # Units and frames
    /// `start` in rad, `goals` as `base_from_tcp` in m.
    ///
    /// # Errors
    /// [`PlanError`] names the cause: a limit, a pair of bodies, an obstacle.
    pub fn plan(
        &self,
        model: &CollisionModel,
        start: &JointVector,
        goals: &[Isometry3<f64>],
        approach: Option<&StraightApproach<'_>>,
        options: &PlanOptions,
    ) -> Result<Plan, PlanError> {
        check_options(options, approach)?;
        let mut checker = Checker::new(model, options.margin_m);
        self.check_start(&mut checker, start)?;
        let (goals, approaches) = match approach {
            None => (free_configurations(self, &mut checker, start, goals)?, Vec::new()),
            Some(approach) => self.approaches(&mut checker, start, goals, approach)?,
        };

        self.search(checker, start, goals, approaches, options)
    }

    /// Like [`ArmGeometry::plan`], to one of several configurations (rad).
    ///
    /// # Errors
    /// The errors of [`ArmGeometry::plan`].
    pub fn plan_to(
        &self,
        model: &CollisionModel,
        start: &JointVector,
        configurations: &[JointVector],
        options: &PlanOptions,
    ) -> Result<Plan, PlanError> {
        check_options(options, None)?;
        let mut checker = Checker::new(model, options.margin_m);
        self.check_start(&mut checker, start)?;
        let reaching = configurations.iter().enumerate().map(|(pose_idx, &q)| GoalConfiguration { q, pose_idx });
        for goal in configurations {
            let kinematics = |cause| PlanError::Kinematics { what: "the goal".to_owned(), cause };
            self.check_configuration(goal).map_err(kinematics)?;
        }
        let goals = free_of(self, &mut checker, start, reaching.collect())?;
        self.search(checker, start, goals, Vec::new(), options)
    }

    /// The cheapest path to one of the goals, which are sorted, the fastest first.
    fn search(
        &self,
        mut checker: Checker<'_>,
        start: &JointVector,
        goals: Vec<GoalConfiguration>,
        approaches: Vec<JointPath>,
        options: &PlanOptions,
    ) -> Result<Plan, PlanError> {
        let mut stops = Stops::default();
        let mut rng = Pcg64Mcg::seed_from_u64(options.seed);
        let mut growth = Growth { step_rad: options.step_rad, max_checks: options.max_checks };
        let first = match straight(&mut checker, start, &goals) {
            Some(found) => found,
            None => {
                let samples = Samples::everywhere(&self.limits);
                rrt_connect(&mut checker, &samples, start, &roots(&goals), growth, &mut rng, &mut stops)
                    .ok_or_else(|| not_found(&checker, &stops))?
            }
        };
        let num_search_checks = checker.num_checked();
        let first_secs = cost_secs(&first.waypoints, &self.limits);
        let is_straight = first.waypoints.len() == 2;
        let mut best = first;
        shorten(&mut checker, &self.limits, &mut best.waypoints, options.num_shortcuts, &mut rng);
        // A further search may need more checks than the first one, because it searches for a better path.
        growth.step_rad = growth.step_rad.min(FURTHER_STEP_RAD);
        growth.max_checks = growth.max_checks.min(MIN_FURTHER_CHECKS + FURTHER_CHECKS_RATIO * num_search_checks);
        for _ in 1..if is_straight { 1 } else { options.num_searches } {
            let best_secs = cost_secs(&best.waypoints, &self.limits);
            // Goals are sorted, the fastest first. Goals that take longer than the best path even on a straight line
            // cannot improve the result.
            let num_quicker = goals.partition_point(|goal| motion_secs(start, &goal.q, &self.limits) < best_secs);
            if num_quicker == 0 {
                break;
            }
            let quicker = roots(&goals[..num_quicker]);
            let samples = Samples::on_quicker_ways(&self.limits, start, &quicker, best_secs);
            let further = rrt_connect(&mut checker, &samples, start, &quicker, growth, &mut rng, &mut stops);
            let Some(mut further) = further else { continue };
            shorten(&mut checker, &self.limits, &mut further.waypoints, options.num_shortcuts, &mut rng);
            if cost_secs(&further.waypoints, &self.limits) < best_secs {
                best = further;
            }
        }
        let Found { waypoints, goal_idx } = best;
        let ways = corners::round(&mut checker, &waypoints);
        Ok(Plan {
            cost_secs: [first_secs, cost_secs(&waypoints, &self.limits)],
            waypoints,
            ways,
            approach: approaches.into_iter().nth(goal_idx),
            goal_idx: goals[goal_idx].pose_idx,
            num_checks: checker.num_checked(),
            num_search_checks,
        })
    }

    fn check_start(&self, checker: &mut Checker<'_>, start: &JointVector) -> Result<(), PlanError> {
        let kinematics = |cause| PlanError::Kinematics { what: "the start".to_owned(), cause };
        self.check_configuration(start).map_err(kinematics)?;
        if let Some((obstacle, depth_m)) = checker.model().overlap_with_column() {
            return Err(PlanError::EnclosesRobot { obstacle, depth_m });
        }
        if !checker.is_free(start) {
            let nearest = checker.model().nearest(start);
            return Err(PlanError::StartBlocked { nearest, margin_m: checker.margin_m() });
        }
        Ok(())
    }

    fn check_configuration(&self, q: &JointVector) -> Result<(), KinematicsError> {
        check_joints("joint positions", q)?;
        match self.limits.worst_violation(q, LIMIT_ROUNDING_RAD) {
            None => Ok(()),
            Some(violation) => Err(KinematicsError::JointOutOfRange { what: "joint positions", violation }),
        }
    }

    /// Configurations at which a free approach can start, and the approaches.
    fn approaches(
        &self,
        checker: &mut Checker<'_>,
        start: &JointVector,
        goals: &[Isometry3<f64>],
        approach: &StraightApproach<'_>,
    ) -> Result<(Vec<GoalConfiguration>, Vec<JointPath>), PlanError> {
        let before: Vec<Isometry3<f64>> =
            goals.iter().map(|goal| goal * Translation3::new(0.0, 0.0, -approach.length_m)).collect();
        let mut on_approach = Checker::new(approach.model, checker.margin_m());
        let (mut kept, mut paths) = (Vec::new(), Vec::new());
        let mut best = (0.0, "no part of it is free".to_owned());
        for goal in free_configurations(self, checker, start, &before)? {
            let line = checked_line(self, &mut on_approach, &goal.q, &goals[goal.pose_idx])
                .map_err(|cause| PlanError::Kinematics { what: "the approach".to_owned(), cause })?;
            match line.path {
                Some(path) => {
                    kept.push(goal);
                    paths.push(path);
                }
                None if line.share >= best.0 => best = (line.share, line.blocked_by.unwrap_or_default()),
                None => {}
            }
        }
        if kept.is_empty() {
            return Err(PlanError::ApproachBlocked { share: best.0, why: best.1 });
        }
        Ok((kept, paths))
    }
}

/// A further search may do this number of checks plus [`FURTHER_CHECKS_RATIO`] times those of the first search.
const MIN_FURTHER_CHECKS: usize = 1000;
/// Factor of the first search's checks, see [`MIN_FURTHER_CHECKS`].
const FURTHER_CHECKS_RATIO: usize = 2;
/// Maximum length of a motion that a further search adds at once, rad. Shorter motions than those of the first search
/// find narrower and faster paths.
const FURTHER_STEP_RAD: f64 = 2.0;

/// The straight motion to the fastest goal that can be reached in this way. Goals are sorted, the fastest first.
fn straight(checker: &mut Checker<'_>, start: &JointVector, goals: &[GoalConfiguration]) -> Option<Found> {
    let goal_idx = goals.iter().position(|goal| checker.is_edge_free(start, &goal.q))?;
    Some(Found { waypoints: vec![*start, goals[goal_idx].q], goal_idx })
}

fn roots(goals: &[GoalConfiguration]) -> Vec<JointVector> {
    goals.iter().map(|goal| goal.q).collect()
}

/// Positions up to this far beyond a limit are rounding errors, rad.
const LIMIT_ROUNDING_RAD: f64 = 1e-9;

fn not_found(checker: &Checker<'_>, stops: &Stops) -> PlanError {
    /// Maximum number of pairs that a message names.
    const MAX_REPORTED: usize = 3;
    let mut counts = BTreeMap::<String, usize>::new();
    for q in stops.configurations() {
        let nearest = checker.model().nearest(q);
        *counts.entry(format!("{} and {}", nearest.body, nearest.other)).or_default() += 1;
    }
    let total = stops.configurations().len().max(1) as f64;
    let mut blockers: Vec<(String, f64)> =
        counts.into_iter().map(|(pair, count)| (pair, count as f64 / total)).collect();
    blockers.sort_by(|a, b| b.1.total_cmp(&a.1));
    blockers.truncate(MAX_REPORTED);
    PlanError::NotFound { num_checks: checker.num_checked(), blockers }
}

fn check_options(options: &PlanOptions, approach: Option<&StraightApproach<'_>>) -> Result<(), PlanError> {
    for (option, found, max, expected) in [
        ("margin_m", options.margin_m, 0.1, "above 0 and at most 0.1 m"),
        ("step_rad", options.step_rad, 10.0, "above 0 and at most 10 rad"),
        ("length_m", approach.map_or(0.1, |approach| approach.length_m), 1.0, "above 0 and at most 1 m"),
    ] {
        if !(found > 0.0 && found <= max) {
            return Err(PlanError::InvalidOption { option, expected, found });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
