//! Motions around what stands in the cell.

use nalgebra::Isometry3;
use sdg_kinematics::collision::{Body, Capsule, CollisionError, CollisionModel, Obstacle, Shape};
use sdg_kinematics::planning::{Plan, PlanError, PlanOptions, StraightApproach};
use sdg_kinematics::{ArmGeometry, JointLimits, JointPath, JointVector, NUM_JOINTS, Trajectory};

use crate::arm::Arm;
use crate::error::{Result, RobotError};
use crate::lying_part::LyingPart;
use crate::robot::Robot;

/// The table's name among the obstacles.
pub(crate) const TABLE: &str = "table";
/// Searches whose ways are tried where the limits of every motion, of which the planner knows nothing, refuse one: the workspace above all.
const NUM_SEEDS: u64 = 5;
/// Checks of a search before it gives up: a second or so, and some ten times what difficult ways take.
const MAX_CHECKS: usize = 50_000;
/// What the start keeps of its height over the table beside the planner's margin, m.
const START_ROOM_M: f64 = 0.002;
/// How far the hand's capsules reach below the tcp of a hand that points down, m.
const HAND_BELOW_TCP_M: f64 = 0.010;

/// The arm with its fingers at an opening (m), the table and obstacles.
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
    // Link 1 turns about the vertical only: a table that is higher than the base's foot is around it, not in its way.
    model.allow(Body::link(1), TABLE)?;
    Ok(model)
}

/// Where a motion is to end.
#[derive(Debug, Clone, Copy)]
pub enum Destination<'a> {
    /// A configuration, rad.
    Configuration(&'a JointVector),
    /// The best of several poses of the tcp in the base frame.
    Poses(&'a [Isometry3<f64>]),
    /// As [`Destination::Poses`], at the end of a straight approach along the tcp's z axis of a length, m.
    Approached(&'a [Isometry3<f64>], f64),
}

/// What stands around the arm, and what it holds; by default nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Surroundings<'a> {
    /// What stands in the cell besides the table.
    pub obstacles: &'a [Obstacle],
    /// Parts that lie: fingers and what they hold keep off them, and on straight ways fingers may come between them.
    pub lying: &'a [LyingPart],
    /// The part in the hand, in the tcp's frame; empty without one.
    pub held: &'a [Capsule],
    /// How far the hand is open on straight ways, m; elsewhere it may be open as far as it goes.
    pub opening_m: f64,
    /// Height over the table that is kept on the way, where start and destination are as high, m.
    pub table_clearance_m: f64,
}

/// A way around what stands in the cell.
#[derive(Debug, Clone)]
pub struct Way {
    /// Motions one after the other, each from rest to rest: one, unless the arm has to stop at a waypoint; none where it is there already.
    pub motions: Vec<Trajectory>,
    /// The straight approach, where one was asked for.
    pub approach: Option<JointPath>,
    /// Which of the poses is reached.
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

    /// The same where the hand may touch the table, and the held part whatever it is lifted from, put on or comes beside: it is not known as well as
    /// the fingers are, and whether it has room in a tray is judged before.
    pub(crate) fn contact_model(&self, arm: &ArmGeometry, table_height_m: f64) -> Result<CollisionModel> {
        let lying = self.lying.iter().enumerate().map(|(number, part)| part.obstacle_beside_fingers(number));
        let opening_m = self.opening_m.clamp(0.0, arm.hand.opening_max_m);
        let mut model = self.model_with(arm, table_height_m, lying.collect(), opening_m)?;
        let names: Vec<String> = model.obstacles().iter().map(|obstacle| obstacle.name.clone()).collect();
        let device = |error: CollisionError| RobotError::Device(Box::new(error));
        model.allow(Body::HAND, TABLE).map_err(device)?;
        for name in names {
            model.allow(Body::HELD_PART, &name).map_err(device)?;
        }
        Ok(model)
    }

    /// How high the table stands for a free motion: higher than it is by the clearance, as far as both ends let it.
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

/// The lowest point of the arm's moving capsules from link 2 on, base frame, m.
fn lowest_m(model: &CollisionModel, arm: &ArmGeometry, q: &JointVector) -> f64 {
    let frames = arm.frames(q);
    let links = (2..=NUM_JOINTS).map(|number| (Body::link(number), number));
    // Hand and held part have their capsules in link 7's frame.
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
    /// A way around what stands in the cell, whose motions keep to the limits.
    ///
    /// # Errors
    /// [`RobotError::NoWay`] with what blocks; [`RobotError::Unsafe`] where every way that was found breaks a limit.
    pub fn plan_around(
        &mut self,
        surroundings: &Surroundings<'_>,
        to: &Destination<'_>,
        joints: &JointLimits,
    ) -> Result<Way> {
        let start = self.commanded()?;
        let table_m = self.limits().table_height_m;
        let raised_m = surroundings.table_for_motion_m(self.geometry(), table_m, &start, to)?;
        let model = surroundings.model(self.geometry(), raised_m)?;
        let on_approach = surroundings.contact_model(self.geometry(), table_m)?;
        let mut refused = None;
        for seed in 0..NUM_SEEDS {
            let mut options = PlanOptions::default();
            (options.seed, options.max_checks) = (seed, MAX_CHECKS);
            let Plan { ways, approach, goal_idx, .. } = match to {
                Destination::Configuration(q) => self.geometry().plan_to(&model, &start, &[**q], &options),
                Destination::Poses(poses) => self.geometry().plan(&model, &start, poses, None, &options),
                Destination::Approached(poses, length_m) => {
                    let straight = StraightApproach { length_m: *length_m, model: &on_approach };
                    self.geometry().plan(&model, &start, poses, Some(&straight), &options)
                }
            }?;
            let motions = ways.iter().map(|way| self.plan_through(way, joints)).collect::<Result<Vec<_>>>()?;
            let refuse = |motion: &Trajectory| self.limits_from(motion.start()).check(motion.clone()).err();
            match motions.iter().find_map(refuse) {
                None => return Ok(Way { motions, approach, goal_idx }),
                Some(violation) => refused = refused.or(Some(violation)),
            }
        }
        Err(refused.map_or_else(|| PlanError::NoGoal.into(), RobotError::Unsafe))
    }
}

#[cfg(test)]
mod tests;
