//! Motions around the obstacles of the cell.

use nalgebra::{Isometry3, Point3};
use sdg_kinematics::collision::{Body, Capsule, Checker, CollisionError, CollisionModel, Obstacle, Shape};
use sdg_kinematics::planning::{CheckedLine, Plan, PlanError, PlanOptions, StraightApproach, checked_line};
use sdg_kinematics::{ArmGeometry, CartesianLimits, JointLimits, JointPath, JointVector, NUM_JOINTS, Trajectory};

use crate::arm::Arm;
use crate::error::{Result, RobotError};
use crate::lying_part::LyingPart;
use crate::robot::Robot;

/// The table's name among the obstacles.
pub(crate) const TABLE: &str = "table";
/// Minimum distance from the obstacles of the cell on straight motions, m.
pub(crate) const LINE_MARGIN_M: f64 = 0.003;
/// Maximum number of searches: a path may violate a limit that the planner does not know, mainly the workspace.
const NUM_SEEDS: u64 = 5;
/// Maximum number of collision checks of a search: about one second, and ten times as many as difficult paths need.
const MAX_CHECKS: usize = 50_000;
/// Distance between the raised table and the lowest point at start and destination, and between a held part and the
/// obstacles at the start, in addition to the planner's margin, m.
const START_ROOM_M: f64 = 0.002;
/// Extent of the hand's capsules below the tcp while the hand points down, m.
const HAND_BELOW_TCP_M: f64 = 0.010;
/// Distance that obstacles nearer than this at the start of a straight motion up may keep, m: it becomes at most
/// [`START_ROOM_M`] smaller.
pub(crate) const NEAR_AT_START_M: f64 = LINE_MARGIN_M + START_ROOM_M;
/// The obstacle under a surface contains the point this far below the surface, m.
const BELOW_SUPPORT_M: f64 = 0.001;
/// The obstacle under a surface does not contain the point this far above the surface, m: a solid around the surface is
/// no support, and files describe obstacles with some margin.
const ABOVE_SUPPORT_M: f64 = 0.003;

/// Collision model of the arm with its fingers at an opening (m), the table and the obstacles.
pub(crate) fn collision_model(
    arm: &ArmGeometry,
    table_height_m: f64,
    obstacles: &[Obstacle],
    opening_m: f64,
) -> std::result::Result<CollisionModel, CollisionError> {
    let table = Obstacle {
        name: TABLE.to_owned(),
        shape: Shape::Plane,
        base_from_obstacle: Isometry3::translation(0.0, 0.0, table_height_m),
    };
    let mut model = CollisionModel::new(arm, [&[table], obstacles].concat(), opening_m)?;
    // Link 1 rotates only about the vertical: a table higher than the foot of the base surrounds it and is no obstacle.
    model.allow(Body::link(1), TABLE)?;
    Ok(model)
}

/// The end of a motion.
#[derive(Debug, Clone, Copy)]
pub enum Destination<'a> {
    /// A configuration, rad.
    Configuration(&'a JointVector),
    /// The best of several poses of the tcp in the base frame.
    Poses(&'a [Isometry3<f64>]),
    /// As [`Destination::Poses`], at the end of a straight approach of this length along the tcp's z axis, m.
    Approached(&'a [Isometry3<f64>], f64),
}

/// The obstacles around the arm, and the held part; by default nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Surroundings<'a> {
    /// Obstacles in the cell besides the table.
    pub obstacles: &'a [Obstacle],
    /// Lying parts. On free motions the arm and the held part avoid them. On straight paths they are made thinner, so
    /// that fingers can move between them, and the held part may touch them.
    pub lying: &'a [LyingPart],
    /// The part in the hand, in the tcp's frame; empty without one.
    pub held: &'a [Capsule],
    /// Whether obstacles may be nearer to `held` at the start of a free motion than the planner allows, because only the
    /// largest extent of the part is known. Such an obstacle does not touch the part, and must not prevent the motion
    /// away from it; the part gets at most 5 mm nearer to it than at the start. On straight paths this applies to the
    /// hand, which may be lower than planned after a contact; it gets at most 2 mm nearer.
    pub may_start_near: bool,
    /// Opening of the hand on straight paths, m; on free motions the hand is assumed to be fully open.
    pub opening_m: f64,
    /// Point on the surface under the grasp or the place, base frame, m. On straight paths the hand may touch the
    /// obstacle with this surface, as it may touch the table.
    pub support: Option<Point3<f64>>,
    /// Minimum height above the table during the motion, m; less if start or destination is lower.
    pub table_clearance_m: f64,
}

/// A path around the obstacles of the cell.
#[derive(Debug, Clone)]
pub struct Way {
    /// Motions in sequence, each from rest to rest: usually one, several if the arm has to stop at waypoints, none if
    /// the arm is at the destination already.
    pub motions: Vec<Trajectory>,
    /// The straight approach, if one was requested.
    pub approach: Option<JointPath>,
    /// Index of the pose that is reached.
    pub goal_idx: usize,
}

impl Surroundings<'_> {
    fn model(&self, arm: &ArmGeometry, table_height_m: f64) -> Result<CollisionModel> {
        let lying = self.lying.iter().enumerate().map(|(number, part)| part.obstacle(number));
        self.model_with(arm, table_height_m, lying.collect(), arm.hand.opening_max_m)
    }

    fn model_with(
        &self,
        arm: &ArmGeometry,
        table_height_m: f64,
        lying: Vec<Obstacle>,
        opening_m: f64,
    ) -> Result<CollisionModel> {
        let device = |error: CollisionError| RobotError::Device(Box::new(error));
        let obstacles = [self.obstacles, &lying].concat();
        let mut model = collision_model(arm, table_height_m, &obstacles, opening_m).map_err(device)?;
        if !self.held.is_empty() {
            model.hold(self.held).map_err(device)?;
        }
        Ok(model)
    }

    /// The collision model of straight paths: the hand may touch the table and the obstacle under the grasp or the
    /// place. The held part may touch every obstacle, because the part's shape is known less exactly than that of the
    /// fingers, and because its room in a tray was checked before.
    pub(crate) fn contact_model(&self, arm: &ArmGeometry, table_height_m: f64) -> Result<CollisionModel> {
        let lying = self.lying.iter().enumerate().map(|(number, part)| part.obstacle_beside_fingers(number));
        let opening_m = self.opening_m.clamp(0.0, arm.hand.opening_max_m);
        let mut model = self.model_with(arm, table_height_m, lying.collect(), opening_m)?;
        let names: Vec<String> = model.obstacles().iter().map(|obstacle| obstacle.name.clone()).collect();
        let device = |error: CollisionError| RobotError::Device(Box::new(error));
        model.allow(Body::HAND, TABLE).map_err(device)?;
        for support in self.obstacles.iter().filter(|obstacle| self.is_support(obstacle)) {
            model.allow(Body::HAND, &support.name).map_err(device)?;
        }
        for name in names {
            model.allow(Body::HELD_PART, &name).map_err(device)?;
        }
        Ok(model)
    }

    /// Whether the surface under the grasp or the place is that of an obstacle.
    fn is_support(&self, obstacle: &Obstacle) -> bool {
        let Some(support) = self.support else { return false };
        let distance_m = |up_m: f64| {
            let p = Point3::new(support.x, support.y, support.z + up_m);
            obstacle.shape.signed_distance_m(&(obstacle.base_from_obstacle.inverse() * p))
        };
        distance_m(-BELOW_SUPPORT_M) <= 0.0 && distance_m(ABOVE_SUPPORT_M) > 0.0
    }

    /// Height of the table for a free motion: raised by the clearance, as far as both ends allow it.
    fn table_for_motion_m(
        &self,
        arm: &ArmGeometry,
        table_height_m: f64,
        start: &JointVector,
        to: &Destination<'_>,
    ) -> Result<f64> {
        let model = self.model(arm, table_height_m)?;
        let hang_m = self.held.iter().map(|capsule| capsule.from.z.max(capsule.to.z) + capsule.radius_m);
        let below_tcp_m = hang_m.fold(HAND_BELOW_TCP_M, f64::max);
        let before_m = |poses: &[Isometry3<f64>], length_m: f64| {
            poses.iter().map(|pose| pose.translation.z + length_m - below_tcp_m).fold(f64::INFINITY, f64::min)
        };
        let end_m = match to {
            Destination::Configuration(q) => lowest_m(&model, arm, q),
            Destination::Poses(poses) => before_m(poses, 0.0),
            Destination::Approached(poses, length_m) => before_m(poses, *length_m),
        };
        let room_m = PlanOptions::default().margin_m + START_ROOM_M;
        let lower_m = lowest_m(&model, arm, start).min(end_m) - room_m;
        Ok((table_height_m + self.table_clearance_m).min(lower_m))
    }
}

/// z of the lowest point of the capsules from link 2 to the held part, base frame, m.
fn lowest_m(model: &CollisionModel, arm: &ArmGeometry, q: &JointVector) -> f64 {
    let frames = arm.frames(q);
    let links = (2..=NUM_JOINTS).map(|number| (Body::link(number), number));
    // The capsules of hand and held part are in link 7's frame.
    let bodies = links.chain([(Body::HAND, NUM_JOINTS), (Body::HELD_PART, NUM_JOINTS)]);
    bodies
        .flat_map(|(body, number)| {
            let base_from_link = frames.base_from_link[number - 1];
            model.capsules(body).iter().map(move |capsule| {
                let [from, to] = [capsule.from, capsule.to].map(|end| (base_from_link * end).z);
                from.min(to) - capsule.radius_m
            })
        })
        .fold(f64::INFINITY, f64::min)
}

impl<A: Arm> Robot<'_, A> {
    /// A path around the obstacles of the cell, whose motions satisfy the limits.
    ///
    /// # Errors
    /// [`RobotError::NoWay`] with the cause, such as the blocking obstacle; [`RobotError::Planning`];
    /// [`RobotError::Unsafe`] if every path that was found violates a limit; [`RobotError::Device`] for invalid
    /// obstacles; the errors of [`Robot::commanded`].
    pub fn plan_around(
        &mut self,
        surroundings: &Surroundings<'_>,
        to: &Destination<'_>,
        joints: &JointLimits,
    ) -> Result<Way> {
        let start = self.commanded()?;
        let table_m = self.limits().table_height_m;
        let raised_m = surroundings.table_for_motion_m(self.geometry(), table_m, &start, to)?;
        let mut model = surroundings.model(self.geometry(), raised_m)?;
        if surroundings.may_start_near {
            model.allow_overlaps_at(Body::HELD_PART, &start, PlanOptions::default().margin_m + START_ROOM_M);
        }
        let on_approach = surroundings.contact_model(self.geometry(), table_m)?;
        let mut refused = None;
        for seed in 0..NUM_SEEDS {
            let mut options = PlanOptions::default();
            (options.seed, options.max_checks) = (seed, MAX_CHECKS);
            let planned = match to {
                Destination::Configuration(q) => self.geometry().plan_to(&model, &start, &[**q], &options),
                Destination::Poses(poses) => self.geometry().plan(&model, &start, poses, None, &options),
                Destination::Approached(poses, length_m) => {
                    let straight = StraightApproach { length_m: *length_m, model: &on_approach };
                    self.geometry().plan(&model, &start, poses, Some(&straight), &options)
                }
            };
            let Plan { ways, approach, goal_idx, .. } = match planned {
                // A violated limit is a clearer reason than a later search that found no path.
                Err(_) if refused.is_some() => continue,
                planned => planned?,
            };
            let motions = ways.iter().map(|way| self.plan_through(way, joints)).collect::<Result<Vec<_>>>()?;
            let refuse = |motion: &Trajectory| self.limits_from(motion.start()).check(motion.clone()).err();
            match motions.iter().find_map(refuse) {
                None => return Ok(Way { motions, approach, goal_idx }),
                Some(violation) => refused = refused.or(Some(violation)),
            }
        }
        Err(refused.map_or_else(|| PlanError::NoGoal.into(), RobotError::Unsafe))
    }

    /// The straight motion up by `up_m` of an arm that is lower than the limits allow, after a program ended during a
    /// compliant descent; `None` for an arm within the limits. [`Robot::follow`] then allows this motion. Obstacles may
    /// be near arm and held part at the start; the motion brings them at most 2 mm nearer.
    ///
    /// # Errors
    /// [`RobotError::Unsafe`] if the arm is more than 10 mm lower than the limits allow;
    /// [`RobotError::BlockedAbove`]; [`RobotError::Planning`]; [`RobotError::Device`] for invalid obstacles; the errors
    /// of [`Robot::commanded`].
    pub fn plan_ascent(
        &mut self,
        surroundings: &Surroundings<'_>,
        up_m: f64,
        cartesian: &CartesianLimits,
    ) -> Result<Option<Trajectory>> {
        let Some(motion) = self.plan_ascent_within_limits(up_m, cartesian)? else { return Ok(None) };
        let (arm, start) = (self.geometry(), motion.start());
        let mut model = surroundings.model(arm, self.limits().table_height_m)?;
        for body in (1..=NUM_JOINTS).map(Body::link).chain([Body::HAND, Body::HELD_PART]) {
            model.allow_overlaps_at(body, start, NEAR_AT_START_M);
        }
        let mut checker = Checker::new(&model, LINE_MARGIN_M);
        let CheckedLine { share, path, blocked_by } =
            checked_line(arm, &mut checker, start, &arm.forward(motion.end()))?;
        match path {
            Some(_) => Ok(Some(motion)),
            None => Err(RobotError::BlockedAbove { share, why: blocked_by.unwrap_or_default() }),
        }
    }
}

#[cfg(test)]
mod tests;
