//! One grasp attempt: the grasp sequence (`sdg_robot::grasp`) from a random start, judged by the true state after
//! closing, lifting and holding.

mod judge;
mod report;

use std::time::Instant;

use nalgebra::Isometry3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::collision::{Checker, CollisionModel};
use sdg_kinematics::planning::PlanOptions;
use sdg_kinematics::{CartesianLimits, JointVector, Trajectory, ready_pose};
use sdg_robot::{
    CameraPose, FREE_CLEARANCE_M, GraspConfig, GraspOutcome, GraspReport, GraspStep, LookOut, PartFinder, PlaceGoal,
    PlacingConfig, PlacingOutcome, PlacingReport, Robot, SafetyLimits, Watch,
};

use crate::error::{Result, SimulationError};
use crate::objects::GraspError;
use crate::panda::FINGERTIP_BEYOND_TCP_M;
use crate::record::RecordConfig;
use crate::workcell::Workcell;
use judge::Judge;

pub use report::AttemptReport;

/// Settings of an attempt and of its judgement.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptConfig {
    /// Settings of the grasp sequence.
    pub grasp: GraspConfig,
    /// Minimum height of the part's lowest point above the table for the part to count as lifted, in metres.
    pub success_height_m: f64,
    /// Pictures from outside during the attempt.
    pub record: Option<RecordConfig>,
    /// Target and settings for putting the part down; `None`: the part is only grasped.
    pub placing: Option<(PlaceGoal, PlacingConfig)>,
}

impl Default for AttemptConfig {
    fn default() -> Self {
        Self { grasp: GraspConfig::default(), success_height_m: 0.10, record: None, placing: None }
    }
}

/// Limit of the hand's angular velocity in rehearsals, rad/s. Franka's limit of 2.5 applies to motions commanded in
/// Cartesian space. Joint motions have limits for each joint only, and at the pace of rehearsals they rotate the hand
/// at up to twice that velocity.
const REHEARSED_ANGULAR_VELOCITY_RAD_S: f64 = 6.0;
/// Limit of the hand's angular acceleration in rehearsals, rad/s².
const REHEARSED_ANGULAR_ACCELERATION_RAD_S2: f64 = 60.0;

impl Workcell {
    /// The limits of every motion in the workcell: Franka's limits over a table at the base's height, but higher limits
    /// for the hand's rotation, as the pace of rehearsals requires.
    pub fn safety_limits() -> SafetyLimits {
        let mut cartesian = CartesianLimits::panda();
        cartesian.angular_velocity_rad_s = REHEARSED_ANGULAR_VELOCITY_RAD_S;
        cartesian.angular_acceleration_rad_s2 = REHEARSED_ANGULAR_ACCELERATION_RAD_S2;
        SafetyLimits { cartesian, fingertip_beyond_tcp_m: FINGERTIP_BEYOND_TCP_M, ..SafetyLimits::default() }
    }

    /// The pose of the wrist camera.
    pub fn wrist_camera(&self) -> CameraPose {
        CameraPose::OnFlange(self.panda.flange_from_tcp() * self.tcp_from_camera())
    }

    /// `flange_from_camera` of the wrist camera as the robot knows it, with the error of its hand-eye calibration.
    pub fn told_flange_from_camera(&self) -> Isometry3<f64> {
        let camera_from_assumed = self.config().errors.camera_from_assumed.unwrap_or_else(Isometry3::identity);
        self.panda.flange_from_tcp() * self.tcp_from_camera() * camera_from_assumed
    }

    /// Tries to grasp the part once, from a start configuration drawn from `seed`.
    ///
    /// Everything is first reset to the start, so that the same seed and finder give the same
    /// attempt.
    ///
    /// # Errors
    /// Errors of the simulation, of perception and of a stopped arm; a failed grasp is not an error, but is reported.
    pub fn run_attempt(
        &mut self,
        finder: &mut dyn PartFinder<Self>,
        config: &AttemptConfig,
        seed: u64,
    ) -> Result<AttemptReport> {
        let started = Instant::now();
        self.reset_for_attempt(&config.grasp, seed)?;
        if let Some(record) = &config.record {
            self.start_recording(record)?;
        }
        let base_from_object = self.base_from_object();
        let mut judge = Judge::new(config.success_height_m);
        let camera = self.wrist_camera();
        let mut robot = Robot::new(self, Self::safety_limits(), Watch::default());
        let ended = match &config.placing {
            None => sdg_robot::grasp(&mut robot, finder, &mut judge, camera, &config.grasp),
            Some((goal, placing)) => {
                sdg_robot::grasp_and_place(&mut robot, finder, &mut judge, camera, &config.grasp, goal, placing).map(
                    |PlacingReport { grasp, outcome, .. }| match outcome {
                        PlacingOutcome::Placed => grasp,
                        PlacingOutcome::Failed { step, why } => {
                            GraspReport { outcome: GraspOutcome::Failed { step, why }, ..grasp }
                        }
                    },
                )
            }
        };
        let frames = self.stop_recording();
        let grasp = ended.map_err(SimulationError::from)?;
        let found_nothing = grasp.found_nothing();
        let GraspReport { mut outcome, targets, looks, hand_verdicts, .. } = grasp;
        let placed = config.placing.as_ref().zip(self.true_place_error(config));
        if let (true, Some(((goal, placing), error))) = (outcome.is_held(), placed)
            && let Some(why) = self.why_not_placed(goal, placing, &error)
        {
            // The measurement by a picture may be wrong; the true position decides.
            outcome = GraspOutcome::Failed { step: GraspStep::Check, why };
        }
        Ok(AttemptReport {
            outcome,
            seed,
            base_from_object,
            targets,
            found_nothing,
            looks,
            place_error: placed.map(|(_, error)| error),
            shake_amplitude_m: judge.shake_amplitude_m,
            hand_verdicts,
            object_height_m: self.object_height_m(),
            simulated_secs: self.data.time_secs(),
            wall_secs: started.elapsed().as_secs_f64(),
            frames,
        })
    }

    /// The true offset of the part from its place.
    fn true_place_error(&self, config: &AttemptConfig) -> Option<GraspError> {
        let (goal, _) = config.placing.as_ref()?;
        let spec = &self.config().scene.object.as_ref()?.spec;
        Some(spec.grasp_error(&self.base_from_object()?, &goal.base_from_part(0.0, 0.0)))
    }

    /// The reason why the part is not at its place, of which it has this true offset; `None` if it is there.
    fn why_not_placed(&self, goal: &PlaceGoal, placing: &PlacingConfig, error: &GraspError) -> Option<String> {
        let (distance_mm, angle_deg) = (error.distance_m * 1e3, error.angle_rad.to_degrees());
        if goal.bin_m.is_none() {
            let is_beside = error.distance_m > placing.tolerance_m || error.angle_rad > placing.tolerance_rad;
            let why = || format!("the part really lies {distance_mm:.1} mm and {angle_deg:.1}° beside its place");
            return is_beside.then(why);
        }
        let spec = &self.config().scene.object.as_ref()?.spec;
        let (grasp, _) = spec.grasp_in_base(&self.base_from_object()?);
        let outside_mm = goal.outside_bin_m([grasp.x, grasp.y])? * 1e3;
        (outside_mm > 0.0).then(|| format!("the part really lies {outside_mm:.1} mm outside the bin"))
    }

    /// Resets everything to the start of an attempt: the arm at rest in a configuration drawn from `seed`.
    ///
    /// # Errors
    /// An error if the arm cannot reach the first look-out pose, or if obstacles block every start; the errors of
    /// [`Workcell::reset`].
    pub fn reset_for_attempt(&mut self, config: &GraspConfig, seed: u64) -> Result<()> {
        let start = self.random_start(config, seed)?;
        self.reset(&start)
    }

    /// A random configuration near the ready pose, well above the table, from which the arm reaches the first look-out
    /// pose without coming near the table; the ready pose itself if no such configuration is found. Among obstacles,
    /// the start is one from which motions can be planned.
    fn random_start(&self, config: &GraspConfig, seed: u64) -> Result<JointVector> {
        const SPREAD_RAD: [f64; 7] = [0.9, 0.4, 0.5, 0.4, 0.6, 0.4, 0.9];
        const NUM_TRIES: usize = 200;
        let mut rng = Pcg64Mcg::seed_from_u64(seed ^ 0x5354_4152_545f_5144);
        let first = config.look_outs.first().copied().unwrap_or(LookOut::Joints(ready_pose()));
        let look = first.configuration(&self.panda, &self.wrist_camera(), 0.0)?;
        let limits = config.pace.free_limits(&self.panda);
        let model = CollisionModel::new(&self.panda, config.obstacles.clone(), self.panda.hand.opening_max_m)
            .map_err(|error| SimulationError::Robot(error.to_string()))?;
        let margin_m = PlanOptions::default().margin_m;
        let mut checker = Checker::new(&model, margin_m);
        // Without obstacles nothing is planned, and the starts of stored attempts stay the same.
        let mut is_free = |q: &JointVector| config.obstacles.is_empty() || checker.is_free(q);
        for _ in 0..NUM_TRIES {
            let offset = JointVector::from_fn(|joint, _| rng.random_range(-SPREAD_RAD[joint]..SPREAD_RAD[joint]));
            let q = self.panda.limits.clamp(&(ready_pose() + offset));
            let safe = self.panda.clearance(&q, 0.0).lowest_m > 0.2
                && Trajectory::point_to_point(&q, &look, &limits)
                    .is_ok_and(|motion| motion.clearance(&self.panda, 0.0).lowest_m > FREE_CLEARANCE_M);
            if safe && is_free(&q) {
                return Ok(q);
            }
        }
        let ready = ready_pose();
        if !is_free(&ready) {
            return Err(SimulationError::Configuration {
                field: "obstacles",
                expected: format!("{:.0} mm between the arm and everything else at its ready pose", margin_m * 1e3),
                found: model.nearest(&ready).to_string(),
            });
        }
        Ok(ready)
    }
}

#[cfg(test)]
mod tests {
    use sdg_kinematics::collision::{Obstacle, Shape};

    use super::*;
    use crate::scene::SceneVariation;
    use crate::workcell::WorkcellConfig;

    /// Settings with a box at a position in the base frame.
    fn beside(name: &str, half_m: [f64; 3], [x, y, z]: [f64; 3]) -> GraspConfig {
        let (shape, base_from_obstacle) = (Shape::Box { half_m }, Isometry3::translation(x, y, z));
        let obstacle = Obstacle { name: name.to_owned(), shape, base_from_obstacle };
        GraspConfig { obstacles: vec![obstacle], ..GraspConfig::default() }
    }

    #[test]
    fn starts_are_free_of_obstacles() {
        let cell = Workcell::new(&WorkcellConfig::new(SceneVariation::nominal(None))).unwrap();
        let config = beside("wall", [1.0, 0.01, 1.0], [0.4, -0.3, 0.5]);
        let model = CollisionModel::new(&cell.panda, config.obstacles.clone(), cell.panda.hand.opening_max_m).unwrap();
        let mut checker = Checker::new(&model, PlanOptions::default().margin_m);
        let mut num_replaced = 0;
        for seed in 1..=50 {
            let without = cell.random_start(&GraspConfig::default(), seed).unwrap();
            let start = cell.random_start(&config, seed).unwrap();
            assert!(checker.is_free(&start), "seed {seed}: {}", model.nearest(&start));
            // A start that is free anyway stays the same.
            assert_eq!(start != without, !checker.is_free(&without), "seed {seed}");
            num_replaced += usize::from(start != without);
        }
        assert!(num_replaced > 0);
    }

    #[test]
    fn an_obstacle_at_every_start_is_named() {
        let cell = Workcell::new(&WorkcellConfig::new(SceneVariation::nominal(None))).unwrap();
        let config = beside("cupboard", [0.5, 0.9, 0.5], [0.4, 0.0, 0.6]);
        let error = cell.random_start(&config, 1).unwrap_err().to_string();
        assert!(error.starts_with("obstacles: expected 3 mm ") && error.contains("inside cupboard"), "{error}");
    }
}
