use super::*;
use crate::part_shape::PartShape;
use crate::planned_arm::PlannedArm;
use crate::safety::SafetyLimits;
use crate::watch::Watch;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use sdg_kinematics::ready_pose;

fn wall(name: &str, half_m: [f64; 3], at: [f64; 3]) -> Obstacle {
    let base_from_obstacle = Isometry3::translation(at[0], at[1], at[2]);
    Obstacle { name: name.to_owned(), shape: Shape::Box { half_m }, base_from_obstacle }
}

fn down(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}

fn plan(obstacles: &[Obstacle], start: &JointVector, to: &Destination<'_>) -> Result<Way> {
    let mut arm = PlannedArm::new(ArmGeometry::panda(), *start, 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let joints = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
    let surroundings = Surroundings { obstacles, opening_m: 0.08, table_clearance_m: 0.05, ..Default::default() };
    robot.plan_around(&surroundings, to, &joints)
}

#[test]
fn a_wall_is_gone_around_and_nothing_is_touched() {
    // A wall between start and goal, 0.45 m high.
    let obstacles = [wall("wall", [0.2, 0.02, 0.225], [0.5, 0.0, 0.225])];
    let panda = ArmGeometry::panda();
    let start = panda.inverse(&down(0.45, 0.3, 0.25), &ready_pose(), &Default::default()).unwrap().q;
    let goals = [down(0.45, -0.3, 0.02)];
    let way = plan(&obstacles, &start, &Destination::Approached(&goals, 0.2)).unwrap();
    assert_eq!(way.motions.len(), 1, "the corners are round");
    let (start, end) = (way.motions[0].start(), way.motions[0].end());
    let bent = (0..100).map(|step| {
        let q = way.motions[0].sample(way.motions[0].duration_secs() * f64::from(step) / 100.0).0;
        let along = (q - start).dot(&(end - start)) / (end - start).norm_squared();
        (start + (end - start) * along - q).norm()
    });
    assert!(bent.fold(0.0, f64::max) > 0.1, "the way is not straight");
    let model = collision_model(&ArmGeometry::panda(), 0.0, &obstacles, 0.08).unwrap();
    let mut checker = Checker::new(&model, 1e-3);
    for motion in &way.motions {
        for step in 0..=200 {
            let q = motion.sample(motion.duration_secs() * f64::from(step) / 200.0).0;
            assert!(checker.is_free(&q), "{}", model.nearest(&q));
            assert!(lowest_m(&model, &panda, &q) > 0.04, "{}", lowest_m(&model, &panda, &q));
        }
    }
    let tcp = panda.forward(way.approach.unwrap().end());
    assert!((tcp.translation.vector - goals[0].translation.vector).norm() < 1e-5, "{tcp}");
}

#[test]
fn what_blocks_is_named() {
    let start = ready_pose();
    let at_goal = [wall("press", [0.1, 0.1, 0.2], [0.45, -0.3, 0.2])];
    let error = plan(&at_goal, &start, &Destination::Poses(&[down(0.45, -0.3, 0.15)])).unwrap_err();
    assert!(error.to_string().contains("press") && !error.latches(), "{error}");
    let around = [wall("cage", [0.3, 0.3, 0.1], [0.0, 0.0, 0.3])];
    let error = plan(&around, &start, &Destination::Configuration(&start)).unwrap_err().to_string();
    assert!(error.contains("the obstacle \"cage\" encloses the robot"), "{error}");
    let at_start = [wall("box", [0.05, 0.05, 0.05], [0.307, 0.0, 0.48])];
    let error = plan(&at_start, &start, &Destination::Poses(&[down(0.45, -0.3, 0.15)])).unwrap_err().to_string();
    assert!(error.contains("the start is not free") && error.contains("box"), "{error}");
    let error = plan(&[], &start, &Destination::Poses(&[down(1.5, 0.0, 0.15)])).unwrap_err().to_string();
    assert!(error.contains("the pose is out of reach"), "{error}");
    let error = plan(&[], &start, &Destination::Poses(&[down(f64::NAN, 0.0, 0.15)])).unwrap_err().to_string();
    assert!(error.contains("must be finite"), "{error}");
}

#[test]
fn a_hand_that_begins_near_the_table_may_leave_it() {
    let start = ArmGeometry::panda().inverse(&down(0.45, 0.2, 0.012), &ready_pose(), &Default::default()).unwrap().q;
    let way = plan(&[], &start, &Destination::Configuration(&ready_pose())).unwrap();
    assert!((way.motions.last().unwrap().end() - ready_pose()).amax() < 1e-9);
}

#[test]
fn fingers_may_touch_only_the_obstacle_under_the_grasp() {
    let panda = ArmGeometry::panda();
    let q = panda.inverse(&down(0.45, 0.2, 0.038), &ready_pose(), &Default::default()).unwrap().q;
    let is_free = |height_m: f64, support: Option<Point3<f64>>| {
        let obstacles = [wall("box", [0.1, 0.1, 0.5 * height_m], [0.45, 0.2, 0.5 * height_m])];
        let surroundings = Surroundings { obstacles: &obstacles, opening_m: 0.08, support, ..Default::default() };
        let model = surroundings.contact_model(&panda, 0.0).unwrap();
        let mut checker = Checker::new(&model, 0.003);
        checker.is_free(&q)
    };
    let support = Some(Point3::new(0.45, 0.2, 0.030));
    assert!(is_free(0.030, support));
    assert!(!is_free(0.030, None));
    // The surface is inside the box, not on it.
    assert!(!is_free(0.040, support));
}

fn bar_at(x: f64, y: f64) -> LyingPart {
    // Along the hand's x, 20 mm wide and 14 mm high.
    let corners = [[-0.045, -0.01], [0.045, -0.01], [0.045, 0.01], [-0.045, 0.01]].map(nalgebra::Point2::from);
    let shape = PartShape::new(corners, 0.020, 0.014, 0.007).unwrap();
    LyingPart { base_from_part: down(x, y, 0.007), shape }
}

#[test]
fn fingers_come_down_between_parts_that_lie_as_far_as_they_are_open() {
    let lying = [bar_at(0.45, 0.153), bar_at(0.45, 0.247)];
    let start = ArmGeometry::panda().inverse(&down(0.45, 0.2, 0.30), &ready_pose(), &Default::default()).unwrap().q;
    let goals = [down(0.45, 0.2, 0.007)];
    let approach = |opening_m: f64| {
        let mut arm = PlannedArm::new(ArmGeometry::panda(), start, 0.08);
        let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
        let joints = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
        let surroundings = Surroundings { lying: &lying, opening_m, table_clearance_m: 0.05, ..Default::default() };
        robot.plan_around(&surroundings, &Destination::Approached(&goals, 0.2), &joints)
    };
    // The gap of 74 mm is that of a tray: 20 mm of part, 20 mm of opening, and on each side 15 mm of finger and 2 mm.
    assert!(approach(0.040).unwrap().approach.is_some());
    let error = approach(0.060).unwrap_err().to_string();
    assert!(error.contains("the hand is") && error.contains("at (0.45, "), "{error}");
}

#[test]
fn what_is_held_is_carried_around_parts_that_lie() {
    // A part so high that the held part would collide with it.
    let tall = PartShape::new(bar_at(0.0, 0.0).shape.outline().to_vec(), 0.02, 0.30, 0.15).unwrap();
    let lying = [LyingPart { base_from_part: down(0.45, 0.0, 0.15), shape: tall }];
    let panda = ArmGeometry::panda();
    let start = panda.inverse(&down(0.45, 0.25, 0.20), &ready_pose(), &Default::default()).unwrap().q;
    let held = [Capsule::new([-0.03, 0.0, 0.0], [0.03, 0.0, 0.0], 0.01)];
    let mut arm = PlannedArm::new(ArmGeometry::panda(), start, 0.02);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let joints = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
    let surroundings = Surroundings { lying: &lying, held: &held, table_clearance_m: 0.05, ..Default::default() };
    let goals = [down(0.45, -0.25, 0.20)];
    let way = robot.plan_around(&surroundings, &Destination::Poses(&goals), &joints).unwrap();
    let mut model = collision_model(&ArmGeometry::panda(), 0.0, &[lying[0].obstacle(0)], 0.08).unwrap();
    model.hold(&held).unwrap();
    let mut checker = Checker::new(&model, 1e-3);
    for motion in &way.motions {
        for step in 0..=200 {
            let q = motion.sample(motion.duration_secs() * f64::from(step) / 200.0).0;
            assert!(checker.is_free(&q), "{}", model.nearest(&q));
        }
    }
}
