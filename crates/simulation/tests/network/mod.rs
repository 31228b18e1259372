//! A simulated Panda on the network, and a copy of its workcell for its true state.

#![allow(clippy::unwrap_used)]
#![allow(dead_code, reason = "each test file and the example use some of it")]

pub mod relay;

use sdg_fci::server::{Pace, Server, ServerConfig};
use sdg_kinematics::{JointLimits, JointVector, Trajectory};
use sdg_robot::{Arm, FrankaArm, GraspConfig, GraspTarget, PartFinder, RobotAddress, Scheduling};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{
    AttemptConfig, PandaPlant, RenderConfig, SharedPositions, Workcell, WorkcellConfig, marked_grasp,
};

/// A server with free ports, on this computer.
pub fn serve(twin: &Workcell, pace: Pace) -> (Server, SharedPositions) {
    let plant = PandaPlant::with_positions(twin.config(), twin.data().qpos()).unwrap();
    let positions = plant.positions();
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace, ..ServerConfig::default() };
    (Server::start(plant, &config).unwrap(), positions)
}

/// The client of a server.
pub fn connect(server: &Server) -> sdg_robot::Result<FrankaArm> {
    let address = RobotAddress {
        host: server.robot_address().ip().to_string(),
        port: server.robot_address().port(),
        hand_port: server.hand_address().port(),
    };
    FrankaArm::connect(&address, Scheduling::Ordinary)
}

/// A copy of the served workcell in this process, set to its state before each query.
pub struct Twin {
    pub cell: Workcell,
    pub positions: SharedPositions,
}

impl Twin {
    fn sync(&mut self) {
        self.cell.set_positions(&self.positions.get()).unwrap();
    }

    /// Whether the part is in the air: then it is held, and contacts need not be checked.
    pub fn is_lifted(&mut self) -> bool {
        self.sync();
        self.cell.object_height_m().is_some_and(|height_m| height_m >= AttemptConfig::default().success_height_m)
    }
}

impl PartFinder<FrankaArm> for Twin {
    fn find(&mut self, _arm: &mut FrankaArm) -> sdg_robot::Result<Option<GraspTarget>> {
        self.sync();
        let spec = self.cell.config().scene.object.as_ref().map(|object| object.spec.clone());
        Ok(spec.zip(self.cell.base_from_object()).map(|(spec, pose)| marked_grasp(&spec, &pose)))
    }
}

/// A workcell with a part and at most two distractors.
pub fn cell(part: &str, seed: u64) -> Workcell {
    let spec = ObjectSpec::by_name(part).unwrap();
    let config = VariationConfig { appearance: false, distractors: 0..=2, ..VariationConfig::default() };
    let scene = SceneVariation::sample(Some(&spec), &config, seed);
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    let mut cell = Workcell::new(&WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) }).unwrap();
    cell.reset_for_attempt(&GraspConfig::default(), seed).unwrap();
    cell
}

/// A motion of two seconds from the arm's position.
pub fn some_motion(arm: &mut impl Arm) -> Trajectory {
    let start = arm.state().unwrap().q_commanded;
    let end = start + JointVector::from([0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3]);
    Trajectory::point_to_point(&start, &end, &JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap()).unwrap()
}
