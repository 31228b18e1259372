//! Faults of a simulated arm: it stops, reports the reason in one line, and nothing moves by itself afterwards.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Isometry3;
use sdg_kinematics::collision::{Obstacle, Shape};
use sdg_kinematics::{JointLimits, JointVector, Trajectory, ready_pose};
use sdg_robot::{
    Arm, GraspConfig, GraspOutcome, GraspReport, GraspStep, GraspTarget, HandCommand, PartFinder, Robot, RobotError,
    STOP_SECS, StopReason, Watch, grasp,
};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{ArmFault, ArmFaultKind, AttemptErrors, RenderConfig, Workcell, WorkcellConfig, marked_grasp};

/// Perception that knows the part's pose and takes no picture.
struct Truth;

impl PartFinder<Workcell> for Truth {
    fn find(&mut self, cell: &mut Workcell) -> sdg_robot::Result<Option<GraspTarget>> {
        let object = cell.config().scene.object.clone().unwrap();
        Ok(Some(marked_grasp(&object.spec, &cell.base_from_object().unwrap())))
    }
}

fn cell(arm_fault: Option<ArmFault>) -> Workcell {
    let spec = ObjectSpec::by_name("pendulum").unwrap();
    let scene = SceneVariation::nominal(Some((&spec, spec.base_from_object(0.5, 0.05, 0.4))));
    let errors = AttemptErrors { arm_fault, ..AttemptErrors::default() };
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    Workcell::new(&WorkcellConfig { errors, wrist_render, ..WorkcellConfig::new(scene) }).unwrap()
}

fn run(robot: &mut Robot<'_, Workcell>) -> sdg_robot::Result<GraspReport> {
    let mount = robot.arm().wrist_camera();
    grasp(robot, &mut Truth, &mut (), mount, &GraspConfig::default())
}

/// A motion that rotates joint 1 from the arm's position.
fn rotation_by(robot: &mut Robot<'_, Workcell>, angle_rad: f64) -> Trajectory {
    let start = robot.arm().state().unwrap().q_commanded;
    let end = start + JointVector::from([angle_rad, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    Trajectory::point_to_point(&start, &end, &JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap()).unwrap()
}

/// A safe motion from the arm's position.
fn some_motion(robot: &mut Robot<'_, Workcell>) -> Trajectory {
    rotation_by(robot, 0.1)
}

/// Checks that motions and commands of the hand are refused, and that the arm does not move while time passes.
fn assert_stands_still(robot: &mut Robot<'_, Workcell>) {
    let motion = some_motion(robot);
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
    let open = HandCommand::Move { opening_m: 0.08, speed_m_s: 0.1 };
    assert!(matches!(robot.start_hand(open), Err(RobotError::Latched(_))));
    let place = |robot: &mut Robot<'_, Workcell>| {
        let cell = robot.arm();
        cell.panda_ids().position(cell.data())
    };
    let before = place(robot);
    for _ in 0..10 {
        // A persistent fault is detected again; the arm is still at rest.
        let _ = robot.wait(0.05);
    }
    // The controller's remaining error after a stop decays within a tenth of a second.
    assert!((place(robot) - before).amax() < 2e-3, "{}", place(robot) - before);
}

#[test]
fn nothing_is_wrong_without_a_fault() {
    let mut cell = cell(None);
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
    let report = run(&mut robot).unwrap();
    assert_eq!(report.outcome, GraspOutcome::Held);
    assert_eq!(report.hand_verdicts, [GraspStep::Close, GraspStep::Lift, GraspStep::Hold].map(|step| (step, None)));
    assert_eq!(robot.latched(), None);
}

#[test]
fn the_obstacle_that_blocks_the_arm_is_named() {
    // "linkage" begins like the arm's "link1".
    for name in ["wall", "linkage"] {
        // 80 mm from the hand, which has its fingers along y.
        let obstacle = Obstacle {
            name: name.to_owned(),
            shape: Shape::Box { half_m: [0.2, 0.02, 0.2] },
            base_from_obstacle: Isometry3::translation(0.4, 0.2, 0.5),
        };
        let scene = SceneVariation::nominal(None);
        let config = WorkcellConfig { obstacles: vec![obstacle], ..WorkcellConfig::new(scene) };
        let mut cell = Workcell::new(&config).unwrap();
        let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
        let motion = rotation_by(&mut robot, 0.8);
        let error = robot.follow(motion).unwrap_err();
        let RobotError::Blocked(by) = &error else { panic!("{error}") };
        assert!(by.contains(&format!(" on {name}")) && !by.contains("the table"), "{by}");
    }
}

#[test]
fn a_state_that_cannot_be_stops_the_arm_for_good() {
    for (kind, expected) in [
        (ArmFaultKind::NotANumber, "the arm was stopped: its state is implausible: joint 4 is at NaN"),
        (ArmFaultKind::Jump, "the arm was stopped: its state is implausible: joint 4 jumped by 1.00"),
    ] {
        // The fault occurs in the first motion.
        let mut cell = cell(Some(ArmFault { at_secs: 0.3, kind }));
        let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
        let error = run(&mut robot).unwrap_err();
        assert!(matches!(error, RobotError::Stopped(StopReason::Implausible(_))), "{error}");
        let line = error.to_string();
        assert!(line.starts_with(expected) && !line.contains('\n'), "{line}");
        let stopped_after_secs = robot.arm().data().time_secs() - 0.3;
        assert!(stopped_after_secs <= STOP_SECS + 0.002, "{stopped_after_secs} s");
        assert_stands_still(&mut robot);
        // The last states are available for writing to a file.
        assert!(robot.watch().states().len() > 500);
    }
}

#[test]
fn after_a_reflex_a_person_decides() {
    let mut cell = cell(Some(ArmFault { at_secs: 0.3, kind: ArmFaultKind::Reflex }));
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
    let error = run(&mut robot).unwrap_err();
    assert_eq!(error.to_string(), "the arm stopped itself: an injected reflex");
    assert_stands_still(&mut robot);
    assert!(robot.latched().unwrap().contains("an injected reflex"));
    // The cause of the reflex persists.
    assert!(robot.recover().is_err());
    assert_stands_still(&mut robot);
}

#[test]
fn a_program_that_starts_anew_finds_the_arm_in_reflex() {
    let mut cell = cell(Some(ArmFault { at_secs: 0.3, kind: ArmFaultKind::Reflex }));
    run(&mut Robot::new(&mut cell, Workcell::safety_limits(), Watch::default())).unwrap_err();
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
    let error = run(&mut robot).unwrap_err().to_string();
    assert!(error.contains("a person has checked the arm and recovers it") && error.contains("in reflex"), "{error}");
}

#[test]
fn a_hand_that_does_nothing_is_noticed() {
    // The hand fails before it opens to the part's width, or later, before it closes.
    for (at_secs, expected) in [(0.5, "the hand failed: the opening should be"), (3.0, "do not press")] {
        let mut cell = cell(Some(ArmFault { at_secs, kind: ArmFaultKind::HandStuck }));
        let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
        match run(&mut robot) {
            Ok(GraspReport { outcome: GraspOutcome::Failed { step: GraspStep::Close, why }, .. }) => {
                assert!(why.contains(expected), "{why}");
            }
            Err(error) => {
                assert!(error.to_string().starts_with(expected), "{error}");
                assert_stands_still(&mut robot);
            }
            other => panic!("at {at_secs}: {other:?}"),
        }
    }
}

#[test]
fn a_part_that_slips_is_felt_by_the_hand() {
    let mut cell = cell(None);
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
    // The force is too small for the part's weight.
    let config = GraspConfig { grasp_force_n: 0.3, ..GraspConfig::default() };
    let mount = robot.arm().wrist_camera();
    let report = grasp(&mut robot, &mut Truth, &mut (), mount, &config).unwrap();
    let GraspOutcome::Failed { step, why } = report.outcome else { panic!("0.3 N hold nothing") };
    assert!(matches!(step, GraspStep::Lift | GraspStep::Hold), "{step}: {why}");
    assert!(why.contains("slipped"), "{why}");
}

#[test]
fn a_person_stops_the_arm_on_its_path() {
    let mut cell = cell(None);
    let pressed = Arc::new(AtomicBool::new(false));
    let (asked, mut cycles) = (pressed.clone(), 0);
    let watch = Watch::new(Box::new(move || {
        cycles += 1;
        asked.fetch_or(cycles == 400, Ordering::SeqCst);
        asked.load(Ordering::SeqCst).then_some(StopReason::Interrupted)
    }));
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), watch);
    let error = run(&mut robot).unwrap_err();
    assert_eq!(error.to_string(), "the arm was stopped: a person requested it");
    let state = robot.arm().state().unwrap();
    assert!(state.dq.amax() < 0.02, "{}", state.dq);
    assert_stands_still(&mut robot);
    // A person has checked the arm, so that it moves again.
    pressed.store(false, Ordering::SeqCst);
    robot.recover().unwrap();
    let motion = some_motion(&mut robot);
    let end = *motion.end();
    robot.follow(motion).unwrap();
    assert!((robot.arm().state().unwrap().q - end).amax() < 1e-3);
}

#[test]
fn a_motion_from_elsewhere_is_not_begun() {
    let mut cell = cell(None);
    let mut robot = Robot::new(&mut cell, Workcell::safety_limits(), Watch::default());
    let mut start = ready_pose();
    start[1] += 1.0;
    let slow = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
    let motion = Trajectory::point_to_point(&start, &ready_pose(), &slow).unwrap();
    let error = robot.follow(motion).unwrap_err().to_string();
    assert!(error.contains("starts 1.000 rad from the position of joint 2"), "{error}");
    // The motion was not started, so that no person needs to check the arm.
    assert_eq!(robot.latched(), None);
    let motion = some_motion(&mut robot);
    robot.follow(motion).unwrap();
}
