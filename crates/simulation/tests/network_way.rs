//! A planned path around a wall, over TCP and UDP in lockstep: one test follows it without stops at its waypoints, the
//! other stops half-way.

use crate::network::{connect, serve};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use sdg_fci::server::Pace as ServerPace;
use sdg_kinematics::collision::{Obstacle, Shape};
use sdg_kinematics::{HAND_OPENING_MAX_M, JointVector, Trajectory};
use sdg_robot::{
    Destination, FREE_CLEARANCE_M, FrankaArm, GraspConfig, Pace, Robot, RobotError, StopReason, Surroundings, Watch,
};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{CollisionWorld, Workcell, WorkcellConfig};

/// Largest difference between a joint's position and its reference during motion, rad.
const TRACKING_RAD: f64 = 0.02;

fn wall() -> Obstacle {
    Obstacle {
        name: "wall".to_owned(),
        shape: Shape::Box { half_m: [0.2, 0.02, 0.2] },
        base_from_obstacle: Isometry3::translation(0.5, 0.0, 0.2),
    }
}

fn beside_the_wall(y: f64) -> Isometry3<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::new(0.45, y, 0.15), down)
}

fn cell() -> Workcell {
    let config = WorkcellConfig { obstacles: vec![wall()], ..WorkcellConfig::new(SceneVariation::nominal(None)) };
    let mut cell = Workcell::new(&config).unwrap();
    cell.reset_for_attempt(&GraspConfig::default(), 1).unwrap();
    cell
}

/// Plans a path to a pose beside the wall; the path must be a single motion.
fn plan(robot: &mut Robot<FrankaArm>, y: f64) -> Trajectory {
    let obstacles = [wall()];
    let surroundings = Surroundings {
        obstacles: &obstacles,
        lying: &[],
        held: &[],
        may_start_near: false,
        opening_m: HAND_OPENING_MAX_M,
        support: None,
        table_clearance_m: FREE_CLEARANCE_M,
    };
    let goal = [beside_the_wall(y)];
    let way = robot
        .plan_around(&surroundings, &Destination::Poses(&goal), &Pace::REHEARSED.free_limits(robot.geometry()))
        .unwrap();
    assert_eq!(way.motions.len(), 1, "the way has no stop");
    way.motions.into_iter().next().unwrap()
}

/// Largest deviation of a motion from a straight line in joint space, rad.
fn bend_rad(motion: &Trajectory) -> f64 {
    let (start, way) = (motion.start(), motion.end() - motion.start());
    let off = |share: usize| {
        let q = motion.sample(motion.duration_secs() * share as f64 / 100.0).0;
        (start + way * ((q - start).dot(&way) / way.norm_squared()) - q).norm()
    };
    (0..=100).map(off).fold(0.0, f64::max)
}

#[test]
fn a_way_over_a_wall_is_followed_in_one_motion() {
    let cell = cell();
    let (server, positions) = serve(&cell, ServerPace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let there = plan(&mut robot, 0.25);
    robot.follow(there).unwrap();
    let mut world = CollisionWorld::new(&[wall()], HAND_OPENING_MAX_M).unwrap();
    let mut most_bent_rad: f64 = 0.0;
    for y in [-0.25, 0.25] {
        let motion = plan(&mut robot, y);
        most_bent_rad = most_bent_rad.max(bend_rad(&motion));
        robot.follow(motion.clone()).unwrap();
        for state in robot.watch().states() {
            assert!((state.q - state.q_commanded).amax() < TRACKING_RAD);
            assert_eq!(world.deepest(&state.q).unwrap(), None);
        }
        let q = JointVector::from_column_slice(&positions.get()[..7]);
        assert!((q - motion.end()).amax() < TRACKING_RAD, "{q}");
    }
    // One of the two motions may be straight.
    assert!(most_bent_rad > 0.1, "{most_bent_rad}");
    drop(arm);
    server.stop().unwrap();
}

#[test]
fn a_stop_on_the_way_over_the_wall_stays_on_the_way() {
    let cell = cell();
    let (server, _positions) = serve(&cell, ServerPace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let there = plan(&mut robot, 0.25);
    robot.follow(there).unwrap();
    let motion = plan(&mut robot, -0.25);
    drop(robot);

    let half_way = (motion.duration_secs() * 0.5e3) as usize;
    let mut num_cycles = 0;
    let watch = Watch::new(Box::new(move || {
        num_cycles += 1;
        (num_cycles > half_way).then_some(StopReason::Interrupted)
    }));
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), watch);
    let stopped = robot.follow(motion.clone()).unwrap_err();
    assert!(matches!(stopped, RobotError::Stopped(StopReason::Interrupted)), "{stopped}");
    let places: Vec<JointVector> =
        (0..=4000).map(|step| motion.sample(motion.duration_secs() * f64::from(step) / 4000.0).0).collect();
    let mut world = CollisionWorld::new(&[wall()], HAND_OPENING_MAX_M).unwrap();
    let states: Vec<_> = robot.watch().states().copied().collect();
    assert!(states.len() > 600);
    for state in &states {
        let off_way = places.iter().map(|place| (place - state.q_commanded).amax()).fold(f64::INFINITY, f64::min);
        assert!(off_way < 2e-3, "{off_way} rad off the way at {:.3} s", state.time_secs);
        assert_eq!(world.deepest(&state.q).unwrap(), None);
    }
    let last = states[states.len() - 1];
    assert!(last.dq.amax() < 0.02, "{}", last.dq);
    let left = (motion.end() - last.q).amax();
    assert!(left > 0.1, "the arm stopped {left} rad before the end");
    drop(robot);
    drop(arm);
    server.stop().unwrap();
}
