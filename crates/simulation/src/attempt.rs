//! One grasp attempt: the paper's sequence, judged at every step.
//!
//! ```text
//! random start ─> look ─> perceive ─> hover, turned ─> perceive ─> above ─> straight down ─> close ─> lift ─> hold
//!                             └ detect                    └ detect   └────── approach ──┘
//! ```
//! A look that does not find the part is repeated from beside, as a person would: another place shows a tall part from
//! another side, and shadows of the arm elsewhere.

mod report;

use std::time::Instant;

use nalgebra::{Isometry3, Translation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::{
    Approach, CartesianLimits, GraspSymmetry, HAND_OPENING_MAX_M, IkOptions, IkSolution, JointLimits, JointPath,
    JointVector, KinematicsError, LineOptions, Trajectory, ready_pose, with_fingers_exchanged,
};

use crate::camera::CameraView;
use crate::error::{Result, SimulationError};
use crate::panda::FINGERTIP_BEYOND_TCP_M;
use crate::perception::{GraspTarget, Perception};
use crate::record::RecordConfig;
use crate::workcell::{MotionEnd, Workcell, camera_looking_down};

pub use report::{AttemptOutcome, AttemptReport, AttemptStep};

/// Where the sequence goes and how it is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptConfig {
    /// Middle of the first look on the table, base frame, metres.
    pub look_at_m: [f64; 2],
    /// Height of the wrist camera above the table at the first look, in metres.
    pub look_height_m: f64,
    /// Height of the wrist camera above the table at the second look, in metres: that of the
    /// demonstration.
    pub hover_height_m: f64,
    /// Force of each finger when closed, in newtons.
    pub grasp_force_n: f64,
    /// How far the hand opens beyond the part's width, both sides together, in metres.
    pub opening_margin_m: f64,
    /// How far the part is lifted, in metres.
    pub lift_m: f64,
    /// The least lift that will do where the arm cannot reach further, in metres.
    pub min_lift_m: f64,
    /// How long the lifted part is held, in seconds.
    pub hold_secs: f64,
    /// Height of the part's lowest point above the table that counts as grasped, in metres.
    pub success_height_m: f64,
    /// Pictures from outside while it happens.
    pub record: Option<RecordConfig>,
}

impl Default for AttemptConfig {
    fn default() -> Self {
        Self {
            look_at_m: [0.48, 0.0],
            look_height_m: 0.58,
            hover_height_m: 0.50,
            grasp_force_n: 40.0,
            opening_margin_m: 0.045,
            lift_m: 0.45,
            min_lift_m: 0.25,
            hold_secs: 1.0,
            success_height_m: 0.10,
            record: None,
        }
    }
}

/// Why the sequence ended early.
enum Stop {
    Failed(AttemptStep, String),
    Error(SimulationError),
}

impl From<SimulationError> for Stop {
    fn from(error: SimulationError) -> Self {
        Self::Error(error)
    }
}

type Sequence<T> = std::result::Result<T, Stop>;

/// Turns a planning error into a failure of a step.
fn fails_at<T>(step: AttemptStep, planned: std::result::Result<T, KinematicsError>) -> Sequence<T> {
    planned.map_err(|error| Stop::Failed(step, error.to_string()))
}

/// Where the camera looks from, one after the other, until the part is found: shifts over the table in metres.
const LOOK_SHIFTS_M: [[f64; 2]; 3] = [[0.0, 0.0], [0.0, 0.10], [0.0, -0.10]];
/// The same from above the part, where a small shift keeps it in the middle.
const HOVER_SHIFTS_M: [[f64; 2]; 3] = [[0.0, 0.0], [-0.03, 0.03], [0.03, -0.03]];
/// Score on which perception decides.
const SURE: f64 = 0.5;
/// What lies where the first look found the part is it at a lower score already, where it lies within so many metres and
/// radians of that.
const CONFIRMED: f64 = 0.2;
const CONFIRMED_WITHIN: (f64, f64) = (0.015, 0.26);
/// How long the arm stands still before a picture, in seconds.
const SETTLE_SECS: f64 = 0.25;
/// Least height of the arm over the table on its free motions, in metres.
const CLEARANCE_M: f64 = 0.05;
/// Least distance of the finger tips to the table when closing, in metres.
const FINGERTIP_CLEARANCE_M: f64 = 0.002;

impl Workcell {
    /// Tries to grasp the part once, from a start configuration drawn from `seed`.
    ///
    /// Everything is put back to the start first, so that the same seed and perception give the same
    /// attempt.
    ///
    /// # Errors
    /// Errors of the simulation or of perception itself; a grasp that fails is a report.
    pub fn run_attempt(
        &mut self,
        perception: &mut dyn Perception,
        config: &AttemptConfig,
        seed: u64,
    ) -> Result<AttemptReport> {
        self.run_attempt_with(&mut |_, view| perception.perceive(view), config, seed)
    }

    /// As [`Workcell::run_attempt`], for a perception that may look behind the curtain.
    pub(crate) fn run_attempt_with(
        &mut self,
        perceive: &mut PerceiveFn<'_>,
        config: &AttemptConfig,
        seed: u64,
    ) -> Result<AttemptReport> {
        let started = Instant::now();
        let start = self.random_start(config, seed)?;
        self.reset(&start)?;
        if let Some(record) = &config.record {
            self.start_recording(record)?;
        }
        let base_from_object = self.base_from_object();
        let mut attempt = Attempt {
            cell: self,
            perceive,
            config,
            views: Vec::new(),
            targets: Vec::new(),
            looks: [0; 2],
            shake_amplitude_m: None,
            perception_secs: 0.0,
        };
        let ended = attempt.sequence();
        let Attempt { views, targets, looks, shake_amplitude_m, perception_secs, .. } = attempt;
        let frames = self.stop_recording();
        let outcome = match ended {
            Ok(()) => AttemptOutcome::Success,
            Err(Stop::Failed(step, why)) => AttemptOutcome::Failure { step, why },
            Err(Stop::Error(error)) => return Err(error),
        };
        Ok(AttemptReport {
            outcome,
            seed,
            base_from_object,
            views,
            targets,
            looks,
            shake_amplitude_m,
            object_height_m: self.object_height_m(),
            simulated_secs: self.data.time_secs(),
            wall_secs: started.elapsed().as_secs_f64(),
            perception_secs,
            frames,
        })
    }

    /// A configuration around the ready pose, well above the table, from which the first look can be
    /// reached without coming near the table.
    fn random_start(&self, config: &AttemptConfig, seed: u64) -> Result<JointVector> {
        const SPREAD_RAD: [f64; 7] = [0.9, 0.4, 0.5, 0.4, 0.6, 0.4, 0.9];
        const NUM_TRIES: usize = 200;
        let mut rng = Pcg64Mcg::seed_from_u64(seed ^ 0x5354_4152_545f_5144);
        let look = self.look_configuration(config)?;
        let limits = free_limits();
        for _ in 0..NUM_TRIES {
            let offset = JointVector::from_fn(|joint, _| rng.random_range(-SPREAD_RAD[joint]..SPREAD_RAD[joint]));
            let q = self.panda.limits().clamp(&(ready_pose() + offset));
            let safe = self.panda.clearance(&q, 0.0).lowest_m > 0.2
                && Trajectory::point_to_point(&q, &look, &limits)
                    .is_ok_and(|motion| motion.clearance(&self.panda, 0.0).lowest_m > CLEARANCE_M);
            if safe {
                return Ok(q);
            }
        }
        Ok(ready_pose())
    }

    fn look_configuration(&self, config: &AttemptConfig) -> Result<JointVector> {
        self.look_configuration_beside(config, [0.0; 2])
    }

    /// As [`Self::look_configuration`] with the camera shifted, in metres.
    fn look_configuration_beside(&self, config: &AttemptConfig, shift_m: [f64; 2]) -> Result<JointVector> {
        let [x, y] = [0, 1].map(|k| config.look_at_m[k] + shift_m[k]);
        let base_from_tcp = self.base_from_tcp_for_camera(&camera_looking_down(x, y, config.look_height_m, 0.0));
        self.panda.inverse(&base_from_tcp, &ready_pose(), &IkOptions::default()).map(|solution| solution.q).map_err(
            |error| SimulationError::Configuration {
                field: "look_at_m, look_height_m",
                expected: "a camera pose within the arm's reach".into(),
                found: error.to_string(),
            },
        )
    }
}

/// Perception that may also look at the physics.
pub(crate) type PerceiveFn<'a> = dyn FnMut(&Workcell, &CameraView) -> std::result::Result<Option<GraspTarget>, Box<dyn std::error::Error + Send + Sync>>
    + 'a;

struct Attempt<'a, 'p> {
    cell: &'a mut Workcell,
    perceive: &'a mut PerceiveFn<'p>,
    config: &'a AttemptConfig,
    views: Vec<CameraView>,
    targets: Vec<Option<GraspTarget>>,
    looks: [usize; 2],
    shake_amplitude_m: Option<f64>,
    perception_secs: f64,
}

impl Attempt<'_, '_> {
    fn sequence(&mut self) -> Sequence<()> {
        let first = self.look_around()?;
        let second = self.look_from_above(&first)?;
        let approach = self.go_above(&second)?;
        self.come_down(approach)?;
        self.close()?;
        self.lift()?;
        self.shake()?;
        self.hold()
    }

    fn look_around(&mut self) -> Sequence<GraspTarget> {
        let mut looks = 0;
        for shift_m in LOOK_SHIFTS_M {
            let arrived = match self.cell.look_configuration_beside(self.config, shift_m) {
                Ok(q) => self.move_freely(&q, AttemptStep::Detect),
                Err(error) => Err(Stop::Error(error)),
            };
            match arrived {
                Err(stop) if looks == 0 => return Err(stop),
                // A place that cannot be reached is not looked from.
                Err(_) => continue,
                Ok(()) => self.cell.wait(SETTLE_SECS)?,
            }
            looks += 1;
            self.looks[0] = looks;
            if let Some(target) = self.perceive(|target| target.score >= SURE)? {
                return Ok(target);
            }
        }
        Err(Stop::Failed(AttemptStep::Detect, format!("the part was not found in {looks} looks")))
    }

    /// Looks again from above what the first look found: nearer to the middle of the picture, errors are smaller.
    fn look_from_above(&mut self, first: &GraspTarget) -> Sequence<GraspTarget> {
        let mut looks = 0;
        for shift_m in HOVER_SHIFTS_M {
            match self.hover(first, shift_m) {
                Err(stop) if looks == 0 => return Err(stop),
                Err(_) => continue,
                Ok(()) => looks += 1,
            }
            self.looks[1] = looks;
            if let Some(target) = self.perceive(|target| target.score >= SURE || confirms(first, target))? {
                return Ok(target);
            }
        }
        Err(Stop::Failed(AttemptStep::Detect, format!("the part was not found in {looks} looks from above it")))
    }

    /// Takes a picture and asks perception; a target that no hand can take is a failure.
    fn perceive(&mut self, is_accepted: impl Fn(&GraspTarget) -> bool) -> Sequence<Option<GraspTarget>> {
        let mut view = self.cell.wrist_view()?;
        if let Some(camera_from_told) = self.cell.config().errors.camera_from_told {
            view.camera.world_from_camera *= camera_from_told;
        }
        let started = Instant::now();
        let best = (self.perceive)(self.cell, &view).map_err(|error| SimulationError::Perception(error.to_string()))?;
        let target = best.filter(is_accepted);
        self.perception_secs += started.elapsed().as_secs_f64();
        self.views.push(view);
        self.targets.push(target);
        let Some(found) = target else { return Ok(None) };
        let failed = |why: String| Stop::Failed(AttemptStep::Detect, why);
        let p = found.base_from_tcp.translation.vector;
        if !(p.iter().all(|value| value.is_finite()) && found.jaw_width_m.is_finite()) {
            return Err(failed("the grasp that was found is not finite".into()));
        }
        if found.jaw_width_m > HAND_OPENING_MAX_M {
            return Err(failed(format!(
                "the part is {:.0} mm wide, the hand opens {:.0} mm",
                found.jaw_width_m * 1e3,
                HAND_OPENING_MAX_M * 1e3
            )));
        }
        Ok(Some(found))
    }

    /// Puts the camera over the grasp or shifted from there, the hand turned as for the grasp or by half a turn more.
    fn hover(&mut self, target: &GraspTarget, shift_m: [f64; 2]) -> Sequence<()> {
        let seed = self.cell.commanded();
        let grasp = target.base_from_tcp.translation;
        let [x, y] = [grasp.x + shift_m[0], grasp.y + shift_m[1]];
        let mut best: Option<IkSolution> = None;
        let mut first_error = None;
        for base_from_grasp in [target.base_from_tcp, with_fingers_exchanged(&target.base_from_tcp)] {
            // The picture's up is the hand's x.
            let up = base_from_grasp.rotation * Vector3::x();
            let base_from_camera = camera_looking_down(x, y, self.config.hover_height_m, up.y.atan2(up.x));
            let base_from_tcp = self.cell.base_from_tcp_for_camera(&base_from_camera);
            match self.cell.panda.inverse(&base_from_tcp, &seed, &IkOptions::default()) {
                Ok(solution) if best.as_ref().is_none_or(|best| solution.cost < best.cost) => best = Some(solution),
                Ok(_) => {}
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        let solution = best.ok_or_else(|| {
            let why = first_error.map_or_else(String::new, |error| error.to_string());
            Stop::Failed(AttemptStep::Hover, format!("the part at ({x:.2}, {y:.2}) m is out of reach: {why}"))
        })?;
        self.move_freely(&solution.q, AttemptStep::Hover)?;
        Ok(self.cell.wait(SETTLE_SECS)?)
    }

    /// Puts the open hand above the grasp, as high as a straight way down exists from.
    fn go_above(&mut self, target: &GraspTarget) -> Sequence<Approach> {
        let mut base_from_grasp = target.base_from_tcp;
        let lowest = FINGERTIP_BEYOND_TCP_M + FINGERTIP_CLEARANCE_M;
        base_from_grasp.translation.z = base_from_grasp.translation.z.max(lowest);

        self.cell.gripper.move_to((target.jaw_width_m + self.config.opening_margin_m).min(HAND_OPENING_MAX_M));
        let seed = self.cell.commanded();
        let here = self.cell.panda.forward(&seed).translation.z;
        let mut first_error = None;
        for height in [here - base_from_grasp.translation.z, 0.25, 0.15, 0.10] {
            let base_from_pregrasp = above(&base_from_grasp, height.max(0.05));
            let planned = self.cell.panda.approach(
                &base_from_pregrasp,
                &base_from_grasp,
                GraspSymmetry::HalfTurn,
                &seed,
                &IkOptions::default(),
                &LineOptions::default(),
            );
            match planned {
                Ok(approach) => {
                    self.move_freely(&approach.pregrasp.q, AttemptStep::Approach)?;
                    return Ok(approach);
                }
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        let p = base_from_grasp.translation.vector;
        let why = first_error.map_or_else(String::new, |error| error.to_string());
        Err(Stop::Failed(
            AttemptStep::Approach,
            format!("no straight way down to ({:.2}, {:.2}, {:.3}) m: {why}", p.x, p.y, p.z),
        ))
    }

    fn come_down(&mut self, approach: Approach) -> Sequence<()> {
        self.move_along(approach.path, [0.18, 0.10, 0.05], AttemptStep::Approach)?;
        Ok(self.cell.wait(0.1)?)
    }

    fn close(&mut self) -> Sequence<()> {
        self.cell.gripper.grasp(self.config.grasp_force_n);
        // Up to 0.04 m of each finger at 0.05 m/s, and time for the force to build up.
        const LONGEST_SECS: f64 = 1.6;
        const LOOK_SECS: f64 = 0.05;
        let mut still_secs = 0.0;
        let mut closing_secs = 0.0;
        while still_secs < 0.2 && closing_secs < LONGEST_SECS {
            let before = self.cell.opening_m();
            self.cell.wait(LOOK_SECS)?;
            closing_secs += LOOK_SECS;
            still_secs = if (self.cell.opening_m() - before).abs() < 1e-4 { still_secs + LOOK_SECS } else { 0.0 };
        }
        match self.cell.fingers_on_object() {
            [true, true] => Ok(()),
            [false, false] => Err(Stop::Failed(
                AttemptStep::Close,
                format!("the fingers closed to {:.1} mm without touching the part", self.cell.opening_m() * 1e3),
            )),
            [left, _] => Err(Stop::Failed(
                AttemptStep::Close,
                format!("only the {} finger touches the part", if left { "left" } else { "right" }),
            )),
        }
    }

    fn lift(&mut self) -> Sequence<()> {
        let start = self.cell.commanded();
        let base_from_tcp = self.cell.panda.forward(&start);
        let mut lift_m = self.config.lift_m;
        let path = loop {
            match self.cell.panda.straight_path(&start, &above(&base_from_tcp, lift_m), &LineOptions::default()) {
                Ok(path) => break path,
                Err(_) if lift_m - 0.05 >= self.config.min_lift_m - 1e-9 => lift_m -= 0.05,
                failed @ Err(_) => return fails_at(AttemptStep::Lift, failed.map(|_| ())),
            }
        };
        self.move_along(path, [0.25, 0.10, 0.05], AttemptStep::Lift)?;
        self.judge(AttemptStep::Lift)
    }

    /// Shakes the part where the workcell's errors ask for it.
    fn shake(&mut self) -> Sequence<()> {
        if let Some(shake) = self.cell.config().errors.shake {
            self.shake_amplitude_m = Some(self.cell.shake(&shake)?);
        }
        Ok(())
    }

    fn hold(&mut self) -> Sequence<()> {
        self.cell.wait(self.config.hold_secs)?;
        self.judge(AttemptStep::Hold)
    }

    /// Is the part up and between both fingers?
    fn judge(&self, step: AttemptStep) -> Sequence<()> {
        let height = self.cell.object_height_m().unwrap_or(0.0);
        let fingers = self.cell.fingers_on_object();
        if height >= self.config.success_height_m && fingers == [true, true] {
            return Ok(());
        }
        let touch = match fingers {
            [true, true] => "between both fingers",
            [true, false] => "on the left finger only",
            [false, true] => "on the right finger only",
            [false, false] => "out of the hand",
        };
        Err(Stop::Failed(step, format!("the part is {:.0} mm above the table, {touch}", height * 1e3)))
    }

    /// Goes to a configuration in joint space, keeping off the table.
    fn move_freely(&mut self, q: &JointVector, step: AttemptStep) -> Sequence<()> {
        let motion = fails_at(step, Trajectory::point_to_point(&self.cell.commanded(), q, &free_limits()))?;
        let clearance = motion.clearance(&self.cell.panda, 0.0);
        // The end is wanted, whatever its height; on the way the arm must not come lower.
        let allowed = CLEARANCE_M.min(self.cell.panda.clearance(q, 0.0).lowest_m - 1e-3);
        if clearance.lowest_m < allowed {
            return Err(Stop::Failed(
                step,
                format!("the way there passes {:.0} mm over the table", clearance.lowest_m * 1e3),
            ));
        }
        self.follow(&motion, step)
    }

    /// Goes along a straight line with a share of Franka's Cartesian velocity, acceleration and jerk.
    fn move_along(
        &mut self,
        path: JointPath,
        [velocity, acceleration, jerk]: [f64; 3],
        step: AttemptStep,
    ) -> Sequence<()> {
        let cartesian = fails_at(step, CartesianLimits::franka().scaled(velocity, acceleration, jerk))?;
        let motion = fails_at(step, Trajectory::along_path(path, &JointLimits::franka(), &cartesian))?;
        self.follow(&motion, step)
    }

    fn follow(&mut self, motion: &Trajectory, step: AttemptStep) -> Sequence<()> {
        match self.cell.follow(motion)? {
            MotionEnd::Arrived => Ok(()),
            MotionEnd::Blocked(by) => Err(Stop::Failed(step, format!("the arm was held up: {by}"))),
        }
    }
}

/// Whether a second look sees what the first one saw.
fn confirms(first: &GraspTarget, second: &GraspTarget) -> bool {
    let apart = first.base_from_tcp.inverse() * second.base_from_tcp;
    second.score >= CONFIRMED
        && apart.translation.vector.norm() <= CONFIRMED_WITHIN.0
        && apart.rotation.angle() <= CONFIRMED_WITHIN.1
}

/// The limits of motions in free space: brisk, far from Franka's own.
fn free_limits() -> JointLimits {
    JointLimits::franka().scaled(0.6, 0.4, 0.2).unwrap_or_else(|_| JointLimits::franka())
}

fn above(base_from_tcp: &Isometry3<f64>, height_m: f64) -> Isometry3<f64> {
    Translation3::new(0.0, 0.0, height_m) * base_from_tcp
}
