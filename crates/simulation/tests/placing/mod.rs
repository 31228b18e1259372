//! Grasps and placing with true poses, in this process and over the network, and the true final poses of the parts.

#![allow(clippy::unwrap_used)]
#![allow(dead_code, reason = "the test and the example use some of it each")]

use crate::network;
use nalgebra::Isometry3;
use sdg_fci::server::{Pace, Server, ServerConfig};
use sdg_kinematics::TCP_OFFSET_M;
use sdg_robot::{
    Arm, CameraPose, CompliantArm, FrankaArm, GraspConfig, GraspReport, GraspTarget, Load, LyingPart, PartFinder,
    Place, PlaceGoal, PlaceKind, PlacingConfig, PlacingReport, Robot, SafetyLimits, Watch, grasp, grasp_and_place,
    grasp_softly,
};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{PlacedObject, SceneVariation, VariationConfig};
use sdg_simulation::{
    AttemptErrors, PandaPlant, RenderConfig, SharedPositions, Workcell, WorkcellConfig, marked_grasp, part_shape,
};

/// Friction torque of each joint's gears.
pub const FRICTION_NM: f64 = 1.0;

/// Location of the simulated arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Where {
    /// In this process.
    Process,
    /// On the network, behind the protocol's server in lockstep.
    Lockstep,
}

/// A tray for parts as long as the spring clip, beside the parts.
pub fn tray() -> Place {
    tray_of([0.10, 0.055])
}

/// A tray with another pitch, m.
pub fn tray_of(pitch_m: [f64; 2]) -> Place {
    Place {
        name: "tray".to_owned(),
        at_m: [0.32, -0.40],
        yaw_rad: 0.0,
        surface_m: 0.0,
        kind: PlaceKind::Tray { cells: [4, 5], pitch_m },
    }
}

/// A scene of a seed with the part beside the tray, and parts that are already placed.
pub fn cell(spec: &ObjectSpec, seed: u64, lying: &[Isometry3<f64>]) -> Workcell {
    let config = VariationConfig {
        appearance: false,
        distractors: 0..=0,
        object_x_m: 0.38..0.58,
        object_y_m: 0.0..0.22,
        ..VariationConfig::default()
    };
    let mut scene = SceneVariation::sample(Some(spec), &config, seed);
    scene.instances =
        lying.iter().map(|&base_from_object| PlacedObject { spec: spec.clone(), base_from_object }).collect();
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, width: 64, height: 48, ..RenderConfig::default() };
    let errors = AttemptErrors { joint_friction_nm: FRICTION_NM, ..AttemptErrors::default() };
    let mut cell = Workcell::new(&WorkcellConfig { wrist_render, errors, ..WorkcellConfig::new(scene) }).unwrap();
    cell.reset_for_attempt(&GraspConfig::default(), seed).unwrap();
    cell
}

/// Perception that knows the true poses, but places them too low by an error of the table's height.
struct Told<F> {
    finder: F,
    lower_m: f64,
}

impl<A: Arm, F: PartFinder<A>> PartFinder<A> for Told<F> {
    fn find(&mut self, arm: &mut A) -> sdg_robot::Result<Option<GraspTarget>> {
        Ok(self.finder.find(arm)?.map(|mut target| {
            target.base_from_tcp.translation.z -= self.lower_m;
            target
        }))
    }
}

struct Truth;

impl PartFinder<Workcell> for Truth {
    fn find(&mut self, cell: &mut Workcell) -> sdg_robot::Result<Option<GraspTarget>> {
        let spec = cell.config().scene.object.as_ref().map(|object| object.spec.clone());
        Ok(spec.zip(cell.base_from_object()).map(|(spec, pose)| marked_grasp(&spec, &pose)))
    }
}

pub fn config(spec: &ObjectSpec) -> GraspConfig {
    let load = Some(Load { mass_kg: spec.mass_kg, center_in_flange_m: [0.0, 0.0, TCP_OFFSET_M] });
    let radius = |p: &nalgebra::Point2<f64>| {
        (p.coords - nalgebra::center(&spec.grasp_start, &spec.grasp_end).xy().coords).norm()
    };
    let part_radius_m = spec.footprint.iter().map(radius).fold(0.0, f64::max);
    GraspConfig { load, part_radius_m, part: Some(part_shape(spec).unwrap()), ..GraspConfig::default() }
}

/// The result of placing a part, and the final poses.
pub struct Placing {
    pub report: sdg_robot::Result<PlacingReport>,
    /// The true pose of the part.
    pub base_from_object: Isometry3<f64>,
    /// Largest movement of the already placed parts, m.
    pub moved_m: f64,
}

/// Grasps the part of a cell and places it.
pub fn place(cell: Workcell, at: Where, goal: &PlaceGoal, config: &GraspConfig, placing: &PlacingConfig) -> Placing {
    let limits = Workcell::safety_limits();
    let lying: Vec<Isometry3<f64>> =
        cell.config().scene.instances.iter().map(|instance| instance.base_from_object).collect();
    // The sequence knows the parts that are already placed.
    let known = |instance: &PlacedObject| LyingPart {
        base_from_part: marked_grasp(&instance.spec, &instance.base_from_object).base_from_tcp,
        shape: part_shape(&instance.spec).unwrap(),
    };
    let config = GraspConfig { lying: cell.config().scene.instances.iter().map(known).collect(), ..config.clone() };
    let (report, cell) = run(cell, at, 0.0, &mut |arm| arm.place(limits.clone(), &config, goal, placing));
    let moved = |(index, before): (usize, &Isometry3<f64>)| {
        let body = cell.data().model().id(&format!("instance_{index}")).unwrap();
        (cell.data().world_from_body(body).translation.vector - before.translation.vector).norm()
    };
    Placing {
        report,
        base_from_object: cell.base_from_object().unwrap(),
        moved_m: lying.iter().enumerate().map(moved).fold(0.0, f64::max),
    }
}

/// Grasps the part of a cell on a table whose given height is too low, compliantly or in joint positions. Returns also
/// whether the part is lifted, and the largest vertical force on the hand until it closed, N (NaN over the network).
pub fn grasp_on_other_table(
    cell: Workcell,
    at: Where,
    lower_m: f64,
    config: &GraspConfig,
) -> (sdg_robot::Result<GraspReport>, bool, f64) {
    let limits = SafetyLimits { table_height_m: -lower_m, ..Workcell::safety_limits() };
    let ((report, peak_n), cell) = run(cell, at, lower_m, &mut |arm| arm.grasp(limits.clone(), config));
    let is_lifted = cell.object_height_m().is_some_and(|height_m| height_m >= 0.10);
    (report, is_lifted, peak_n)
}

/// An arm with its perception.
trait Sequence {
    fn place(
        &mut self,
        limits: SafetyLimits,
        config: &GraspConfig,
        goal: &PlaceGoal,
        placing: &PlacingConfig,
    ) -> sdg_robot::Result<PlacingReport>;
    fn grasp(&mut self, limits: SafetyLimits, config: &GraspConfig) -> (sdg_robot::Result<GraspReport>, f64);
}

struct With<'a, A: CompliantArm> {
    arm: &'a mut A,
    finder: &'a mut dyn PartFinder<A>,
    mount: CameraPose,
    peak_n: fn(&mut A) -> f64,
}

/// Measures the largest force until the hand has closed.
struct Peak<A>(fn(&mut A) -> f64, Option<f64>);

impl<A: Arm> sdg_robot::StepObserver<A> for Peak<A> {
    fn after(&mut self, arm: &mut A, _step: sdg_robot::GraspStep) -> sdg_robot::Result<Option<String>> {
        let peak_n = (self.0)(arm);
        self.1.get_or_insert(peak_n);
        Ok(None)
    }
}

impl<A: CompliantArm> Sequence for With<'_, A> {
    fn place(
        &mut self,
        limits: SafetyLimits,
        config: &GraspConfig,
        goal: &PlaceGoal,
        placing: &PlacingConfig,
    ) -> sdg_robot::Result<PlacingReport> {
        let mut robot = Robot::new(self.arm, limits, Watch::default());
        grasp_and_place(&mut robot, self.finder, &mut (), self.mount, config, goal, placing)
    }

    fn grasp(&mut self, limits: SafetyLimits, config: &GraspConfig) -> (sdg_robot::Result<GraspReport>, f64) {
        let mut peak = Peak(self.peak_n, None);
        let mut robot = Robot::new(self.arm, limits, Watch::default());
        let report = match config.soft_approach {
            Some(_) => grasp_softly(&mut robot, self.finder, &mut peak, self.mount, config),
            None => grasp(&mut robot, self.finder, &mut peak, self.mount, config),
        };
        let last_n = (self.peak_n)(self.arm);
        (report, peak.1.unwrap_or(last_n))
    }
}

/// Runs a function with a cell's arm, in this process or over the network; returns also the final state of the cell.
fn run<T>(
    mut cell: Workcell,
    at: Where,
    lower_m: f64,
    sequence: &mut dyn FnMut(&mut dyn Sequence) -> T,
) -> (T, Workcell) {
    let mount = cell.wrist_camera();
    match at {
        Where::Process => {
            let mut finder = Told { finder: Truth, lower_m };
            let peak_n = Workcell::take_peak_felt_n;
            let ended = sequence(&mut With { arm: &mut cell, finder: &mut finder, mount, peak_n });
            (ended, cell)
        }
        Where::Lockstep => {
            let (server, positions) = serve(&cell);
            let mut arm = network::connect(&server).unwrap();
            let twin = network::Twin { cell, positions: positions.clone() };
            let mut finder = Told { finder: twin, lower_m };
            let peak_n = |_: &mut FrankaArm| f64::NAN;
            let ended = sequence(&mut With { arm: &mut arm, finder: &mut finder, mount, peak_n });
            drop(arm);
            server.stop().unwrap();
            let mut cell = finder.finder.cell;
            cell.set_positions(&positions.get()).unwrap();
            (ended, cell)
        }
    }
}

fn serve(cell: &Workcell) -> (Server, SharedPositions) {
    let plant = PandaPlant::with_positions(cell.config(), cell.data().qpos()).unwrap().with_friction_nm(FRICTION_NM);
    let positions = plant.positions();
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace: Pace::LOCKSTEP, ..ServerConfig::default() };
    (Server::start(plant, &config).unwrap(), positions)
}

/// The true offset of a part from its goal: m and rad, up to its symmetry.
pub fn beside(spec: &ObjectSpec, base_from_object: &Isometry3<f64>, goal: &PlaceGoal) -> (f64, f64) {
    let error = spec.grasp_error(base_from_object, &goal.base_from_part(0.0, 0.0));
    (error.distance_m, error.angle_rad)
}
