//! Compliant descents over the network, in lockstep, onto a table that is higher than the given height.

use crate::network::connect;
use sdg_fci::server::{Pace, Server, ServerConfig};
use sdg_kinematics::{ArmGeometry, CartesianLimits, JointLimits, LineOptions, Trajectory};
use sdg_robot::{
    Arm, ArmMode, ContactSensitivity, FrankaArm, Robot, RobotError, SafetyLimits, StopReason, TouchDown, Watch,
};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{FINGERTIP_BEYOND_TCP_M, PandaPlant, Workcell, WorkcellConfig};

/// Friction of each joint's gears.
const FRICTION_NM: f64 = 1.0;
/// Height of the table above the table height in the limits.
const HIGHER_M: f64 = 0.005;
/// Start of the tcp's descent, m: the finger tips are 20 mm above the table.
const ABOVE_M: [f64; 3] = [0.45, 0.0, 0.024];
/// Largest static force that does not damage part or table.
const MAX_STATIC_N: f64 = 10.0;
const MAX_PEAK_N: f64 = 25.0;
/// Largest deviation of the tcp from its reference in free air.
const MAX_FREE_AIR_M: f64 = 1.5e-3;
const MAX_FREE_AIR_DEG: f64 = 0.5;

fn serve(friction_nm: f64) -> Server {
    let config = WorkcellConfig::new(SceneVariation::nominal(None));
    let plant = PandaPlant::new(&config).unwrap().with_friction_nm(friction_nm);
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace: Pace::LOCKSTEP, ..ServerConfig::default() };
    Server::start(plant, &config).unwrap()
}

fn limits() -> SafetyLimits {
    SafetyLimits { table_height_m: -HIGHER_M, ..Workcell::safety_limits() }
}

/// A straight motion of the tcp to a position.
fn line_to(robot: &mut Robot<'_, FrankaArm>, to_m: [f64; 3]) -> Trajectory {
    let (panda, start) = (ArmGeometry::panda(), robot.commanded().unwrap());
    let mut base_from_tcp = panda.forward(&start);
    base_from_tcp.translation = to_m.into();
    let path = panda.straight_path(&start, &base_from_tcp, &LineOptions::default()).unwrap();
    let slow = CartesianLimits::panda().scaled(0.1, 0.1, 0.05).unwrap();
    Trajectory::along_path(path, &JointLimits::panda(), &slow).unwrap()
}

fn go_above(robot: &mut Robot<'_, FrankaArm>) {
    let motion = line_to(robot, ABOVE_M);
    robot.follow(motion).unwrap();
}

#[test]
fn a_soft_tcp_finds_a_table_that_is_higher_than_told_and_presses_little() {
    for friction_nm in [0.0, FRICTION_NM] {
        let server = serve(friction_nm);
        let mut arm = connect(&server).unwrap();
        let mut robot = Robot::new(&mut arm, limits(), Watch::default());
        go_above(&mut robot);
        let told = TouchDown::default();
        let touched = robot.touch_down(&told).unwrap();
        assert!(touched.is_contact, "friction {friction_nm}: {touched:?}");
        println!("friction {friction_nm}: {touched:?}");
        let [beside_reference_m, turned_rad] = touched.free_air_error;
        assert!(beside_reference_m < MAX_FREE_AIR_M, "friction {friction_nm}: {touched:?}");
        assert!(turned_rad.to_degrees() < MAX_FREE_AIR_DEG, "friction {friction_nm}: {touched:?}");
        let beside_m = touched.tcp_height_m - FINGERTIP_BEYOND_TCP_M;
        assert!(beside_m.abs() < 1e-3, "friction {friction_nm}: {touched:?}");
        assert!((touched.force_n - told.press_n).abs() < 2.0, "friction {friction_nm}: {touched:?}");
        assert!(touched.force_n < MAX_STATIC_N && touched.peak_n < MAX_PEAK_N, "friction {friction_nm}: {touched:?}");
        // The arm is at rest, without an error, and the next motion starts at its position.
        let state = robot.state().unwrap();
        assert_eq!(state.mode, ArmMode::Idle);
        assert!((state.q - state.q_commanded).amax() < 2e-3);
        go_above(&mut robot);
        assert_eq!(robot.latched(), None);
    }
}

#[test]
fn joint_positions_press_on_the_same_table_until_the_robot_stops() {
    let server = serve(FRICTION_NM);
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, limits(), Watch::default());
    go_above(&mut robot);
    robot.set_contact_sensitivity(ContactSensitivity::Contact).unwrap();
    // The motion ends 1.5 mm above the contact with a table at the given height.
    let motion = line_to(&mut robot, [ABOVE_M[0], ABOVE_M[1], FINGERTIP_BEYOND_TCP_M - HIGHER_M + 0.0015]);
    let error = robot.follow(motion).unwrap_err();
    assert!(matches!(error, RobotError::Reflex(_)), "{error}");
}

#[test]
fn a_way_down_on_which_nothing_is_felt_ends_and_says_so() {
    let server = serve(FRICTION_NM);
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, limits(), Watch::default());
    go_above(&mut robot);
    let touched = robot.touch_down(&TouchDown { max_way_m: 0.008, ..TouchDown::default() }).unwrap();
    assert!(!touched.is_contact && touched.peak_n < TouchDown::default().contact_n, "{touched:?}");
    assert!(touched.tcp_height_m > FINGERTIP_BEYOND_TCP_M + 0.005, "{touched:?}");
    go_above(&mut robot);
}

#[test]
fn ctrl_c_on_the_way_down_stops_the_arm_and_what_makes_no_sense_is_refused() {
    let server = serve(FRICTION_NM);
    let mut arm = connect(&server).unwrap();
    go_above(&mut Robot::new(&mut arm, limits(), Watch::default()));
    let mut cycles = 0;
    let watch = Watch::new(Box::new(move || {
        cycles += 1;
        (cycles == 700).then_some(StopReason::Interrupted)
    }));
    let mut robot = Robot::new(&mut arm, limits(), watch);
    for touch_down in [
        TouchDown { speed_m_s: 0.2, ..TouchDown::default() },
        TouchDown { press_n: f64::NAN, ..TouchDown::default() },
        TouchDown { max_way_m: 0.0, ..TouchDown::default() },
    ] {
        assert!(matches!(robot.touch_down(&touch_down), Err(RobotError::Configuration { .. })), "{touch_down:?}");
    }
    let too_deep = TouchDown { max_way_m: 0.1, ..TouchDown::default() };
    assert!(matches!(robot.touch_down(&too_deep), Err(RobotError::Unsafe(_))));
    assert_eq!(robot.latched(), None);

    let error = robot.touch_down(&TouchDown::default()).unwrap_err();
    assert_eq!(error.to_string(), "the arm was stopped: a person requested it");
    assert!(matches!(robot.touch_down(&TouchDown::default()), Err(RobotError::Latched(_))));
    let before = robot.arm().state().unwrap();
    robot.arm().wait(0.3, &mut Watch::default()).unwrap();
    let after = robot.arm().state().unwrap();
    assert_eq!(after.mode, ArmMode::Idle);
    assert!((after.q - before.q).amax() < 2e-3);
}
