//! Runs a hundred thousand cycles of the simulated robot with many invalid requests and commands: there must be no
//! panic, and no NaN in a state.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_fci::Limits;
use sdg_fci::server::{HandCore, Plant, RobotCore};
use sdg_fci::wire::{
    COMMAND_SIZE_V5, CollisionBehavior, Command, ControllerMode, Deviation, HandRequest, Load, MotionCommand,
    MotionGeneratorMode, MoveRequest, Request, RobotCommand, RobotMode, RobotState, Status, Version,
};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{PandaPlant, WorkcellConfig};

const NUM_CYCLES: usize = 100_000;

fn any_number(rng: &mut Pcg64Mcg) -> f64 {
    match rng.random_range(0..6) {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => -1e300,
        3 => 1e-300,
        4 => f64::from_bits(rng.random()),
        _ => rng.random_range(-3.0..3.0),
    }
}

fn any_request(rng: &mut Pcg64Mcg) -> Request {
    let generators = [
        MotionGeneratorMode::JointPosition,
        MotionGeneratorMode::JointVelocity,
        MotionGeneratorMode::CartesianPosition,
        MotionGeneratorMode::CartesianVelocity,
    ];
    let controllers = [ControllerMode::JointImpedance, ControllerMode::CartesianImpedance, ControllerMode::External];
    let deviation = Deviation { translation: 10.0, rotation: 3.0, elbow: 6.0 };
    match rng.random_range(0..12) {
        0..=5 => Request::Move(MoveRequest {
            controller: controllers[rng.random_range(0..controllers.len())],
            generator: generators[rng.random_range(0..generators.len())],
            max_path_deviation: deviation,
            max_goal_deviation: deviation,
        }),
        6 => Request::StopMove,
        7 => Request::SetLoad(Load { mass: any_number(rng), center: [any_number(rng); 3], inertia: [0.0; 9] }),
        8 => Request::SetNeToEe(std::array::from_fn(|_| any_number(rng))),
        9 => Request::SetCollisionBehavior(CollisionBehavior::new(
            [any_number(rng); 7],
            [any_number(rng).abs(); 7],
            [any_number(rng); 6],
            [any_number(rng).abs(); 6],
        )),
        10 => Request::SetJointImpedance([any_number(rng); 7]),
        _ => Request::SetCartesianImpedance([any_number(rng); 6]),
    }
}

/// Commands that hold the arm in place, with a few errors.
fn any_command(state: &RobotState, rng: &mut Pcg64Mcg) -> Option<RobotCommand> {
    let motion = MotionCommand {
        q: state.q_desired,
        base_from_ee: state.base_from_ee_commanded,
        elbow: state.elbow_commanded,
        finished: rng.random_bool(0.02),
        ..MotionCommand::default()
    };
    let command =
        RobotCommand { message_id: state.message_id, motion, torque: state.torque_desired, torque_finished: false };
    let mut bytes = command.encode(Version::V5);
    if rng.random_bool(0.05) {
        let at = 8 + 8 * rng.random_range(0..38);
        bytes[at..at + 8].copy_from_slice(&any_number(rng).to_le_bytes());
    }
    if rng.random_bool(0.05) {
        let at = rng.random_range(0..COMMAND_SIZE_V5);
        bytes[at] ^= 1 << rng.random_range(0..8);
    }
    RobotCommand::decode(&bytes, Version::V5).ok().filter(|_| rng.random_bool(0.98))
}

#[test]
fn mistakes_stop_the_robot_and_nothing_else() {
    let rng = &mut Pcg64Mcg::seed_from_u64(3);
    let mut plant = PandaPlant::new(&WorkcellConfig::new(SceneVariation::nominal(None))).unwrap();
    let mut robot = RobotCore::new(&mut plant, Limits::PANDA);
    let mut hand = HandCore::default();
    let (mut num_motions, mut num_reflexes, mut num_finished) = (0, 0, 0);
    for cycle in 0..NUM_CYCLES {
        let state = robot.state(&plant);
        let numbers = [&state.q[..], &state.dq, &state.q_desired, &state.torque, &state.base_from_ee_commanded];
        assert!(numbers.iter().all(|numbers| numbers.iter().all(|number| number.is_finite())), "{state:?}");
        match state.robot_mode {
            RobotMode::Reflex => {
                num_reflexes += 1;
                robot.request(&plant, 0, &Request::AutomaticErrorRecovery);
            }
            RobotMode::Idle => robot.request(&plant, 1, &any_request(rng)),
            _ if rng.random_bool(0.002) => robot.request(&plant, 2, &any_request(rng)),
            _ => {}
        }
        if cycle % 500 == 0 {
            let (width, speed, force) = (any_number(rng), any_number(rng), any_number(rng));
            let request = match rng.random_range(0..4) {
                0 => HandRequest::Homing,
                1 => HandRequest::Move { width, speed },
                2 => HandRequest::Grasp { width, epsilon_inner: width, epsilon_outer: speed, speed, force },
                _ => HandRequest::Stop,
            };
            hand.request(&mut plant, 3, &request);
        }
        let command = if state.robot_mode == RobotMode::Move { any_command(&state, rng) } else { None };
        robot.cycle(&mut plant, command.as_ref()).unwrap();
        hand.cycle(&mut plant);
        hand.take_responses();
        for outgoing in robot.take_responses() {
            num_motions += u32::from(outgoing.response.status == Status::MotionStarted);
            num_finished += u32::from(outgoing.command == Command::Move && outgoing.response.status == Status::Success);
        }
        // An arm that an error has set in motion is soon near the end of a joint's range, where no further cases would
        // be tested.
        let q = plant.observe().q;
        if (q - nalgebra::SVector::<f64, 7>::from(sdg_kinematics::READY_RAD)).amax() > 0.5 {
            plant = PandaPlant::new(&WorkcellConfig::new(SceneVariation::nominal(None))).unwrap();
            robot = RobotCore::new(&mut plant, Limits::PANDA);
        }
    }
    assert!(
        num_motions > 100 && num_reflexes > 100 && num_finished > 10,
        "{num_motions} {num_reflexes} {num_finished}"
    );
}
