use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::collision::{Body, Capsule, Obstacle, Shape};
use crate::geometry::pose_error;
use crate::joints::ready_pose;
use crate::test_poses::top_grasp;

fn obstacle(name: &str, shape: Shape, at: [f64; 3]) -> Obstacle {
    Obstacle { name: name.to_owned(), shape, base_from_obstacle: Isometry3::translation(at[0], at[1], at[2]) }
}

fn table() -> Obstacle {
    obstacle("table", Shape::Plane, [0.0, 0.0, 0.0])
}

/// A wall as high as the elbow, which divides the table into two sides.
fn wall() -> Obstacle {
    obstacle("wall", Shape::Box { half_m: [0.25, 0.02, 0.25] }, [0.55, 0.0, 0.25])
}

fn cell(obstacles: Vec<Obstacle>) -> CollisionModel {
    CollisionModel::new(&ArmGeometry::panda(), obstacles, 0.08).unwrap()
}

/// The hand is low on one side of the wall.
fn start() -> JointVector {
    let pose = top_grasp(0.5, 0.3, 0.15, 0.0);
    ArmGeometry::panda().inverse(&pose, &ready_pose(), &Default::default()).unwrap().q
}

fn plan(model: &CollisionModel, goals: &[Isometry3<f64>], seed: u64) -> Result<Plan, PlanError> {
    let options = PlanOptions { seed, max_checks: 200_000, ..PlanOptions::default() };
    ArmGeometry::panda().plan(model, &start(), goals, None, &options)
}

fn motions(plan: &Plan) -> Vec<Trajectory> {
    plan.trajectories(&JointLimits::panda(), &CartesianLimits::panda(), &ArmDynamics::new(&ArmGeometry::panda(), 0.08))
        .unwrap()
}

#[test]
fn corners_are_round_free_and_quicker_than_stops() {
    // Every stop requires braking and accelerating, which takes at least 0.2 s at full speed.
    const MIN_SAVED_SECS: f64 = 0.1;
    let model = cell(vec![table(), wall()]);
    let goal = top_grasp(0.5, -0.3, 0.15, 0.0);
    let (joints, cartesian, dynamics) =
        (JointLimits::panda(), CartesianLimits::panda(), ArmDynamics::new(&ArmGeometry::panda(), 0.08));
    let (mut num_corners, mut num_stops) = (0, 0);
    for seed in 0..5 {
        let found = plan(&model, &[goal], seed).unwrap();
        num_corners += found.waypoints.len() - 2;
        num_stops += found.ways.len() - 1;
        assert_eq!(
            (*found.ways[0].start(), *found.ways.last().unwrap().end()),
            (found.waypoints[0], *found.waypoints.last().unwrap())
        );
        assert!(found.ways.windows(2).all(|pair| pair[0].end() == pair[1].start()));
        let mut checker = Checker::new(&model, 0.001);
        for way in &found.ways {
            let q: Vec<JointVector> =
                (0..=2000).map(|step| way.at(way.length_secs() * f64::from(step) / 2000.0).q).collect();
            let least_m = checker.distances_m(&q).into_iter().fold(f64::INFINITY, f64::min);
            assert!(least_m > 0.0, "seed {seed}: {least_m} m");
        }
        let secs: f64 = motions(&found).iter().map(Trajectory::duration_secs).sum();
        let stopping_secs = found.stopping_secs(&joints, &cartesian, &dynamics).unwrap();
        println!(
            "seed {seed}: {secs:.2} s, {stopping_secs:.2} s with stops at {} waypoints",
            found.waypoints.len() - 2
        );
        if found.ways.len() < found.waypoints.len() - 1 {
            assert!(secs < stopping_secs - MIN_SAVED_SECS, "seed {seed}: {secs} s, {stopping_secs} s with stops");
        }
    }
    assert!(num_corners >= 5 && num_stops * 4 < num_corners, "{num_stops} stops at {num_corners} waypoints");
}

#[test]
fn a_plan_that_stays_where_it_is_has_no_motion() {
    let model = cell(vec![table()]);
    let found = ArmGeometry::panda().plan_to(&model, &start(), &[start()], &PlanOptions::default()).unwrap();
    assert!(found.ways.is_empty() && motions(&found).is_empty());
}

#[test]
fn a_way_leads_over_the_wall_and_touches_nothing() {
    let panda = ArmGeometry::panda();
    let model = cell(vec![table(), wall()]);
    let goal = top_grasp(0.5, -0.3, 0.15, 0.0);
    let mut costs = Vec::new();
    for seed in 0..5 {
        let found = plan(&model, &[goal], seed).unwrap();
        assert_eq!(found, plan(&model, &[goal], seed).unwrap(), "the same seed gives the same plan");
        assert_eq!(found.waypoints[0], start());
        let end = found.waypoints[found.waypoints.len() - 1];
        assert!(pose_error(&panda.forward(&end), &goal).norm() < 1e-8);
        assert!(found.waypoints.len() > 2 && found.cost_secs[1] <= found.cost_secs[0]);
        let mut checker = Checker::new(&model, 0.001);
        for motion in motions(&found) {
            let num_cycles = (motion.duration_secs() / 0.001) as usize;
            let q: Vec<JointVector> = (0..=num_cycles).map(|i| motion.sample(i as f64 * 0.001).0).collect();
            let min_m = checker.distances_m(&q).into_iter().fold(f64::INFINITY, f64::min);
            assert!(min_m > 0.0, "seed {seed}: {min_m} m");
        }
        costs.push(found.cost_secs[1]);
    }
    assert!(costs.iter().any(|cost| *cost != costs[0]), "other seeds give other plans");
}

#[test]
fn the_cheapest_of_several_goals_wins() {
    let model = cell(vec![table()]);
    let far = top_grasp(0.3, -0.5, 0.3, 2.5);
    let near = top_grasp(0.5, 0.25, 0.2, 0.1);
    let found = plan(&model, &[far, near], 1).unwrap();
    assert_eq!((found.goal_idx, found.waypoints.len()), (1, 2));
}

#[test]
fn an_approach_ends_at_the_grasp_and_may_touch_what_is_allowed() {
    let part = obstacle("part", Shape::Box { half_m: [0.02, 0.02, 0.03] }, [0.5, -0.3, 0.03]);
    let model = cell(vec![table(), wall(), part]);
    let grasp = top_grasp(0.5, -0.3, 0.03, 0.0);
    let with = |model: &CollisionModel, on_approach: &CollisionModel| {
        let approach = StraightApproach { length_m: 0.1, model: on_approach };
        ArmGeometry::panda().plan(model, &start(), &[grasp], Some(&approach), &PlanOptions::default())
    };
    let mut allowed = model.clone();
    allowed.allow(Body::HAND, "part").unwrap();
    let found = with(&model, &allowed).unwrap();
    let path = found.approach.as_ref().unwrap();
    assert!((path.distance_m() - 0.1).abs() < 1e-9);
    assert_eq!(path.start(), &found.waypoints[found.waypoints.len() - 1]);
    assert!(pose_error(&ArmGeometry::panda().forward(path.end()), &grasp).norm() < 1e-8);
    // A plate above the part, in the path of the fingers.
    let plate = obstacle("plate", Shape::Box { half_m: [0.06, 0.06, 0.003] }, [0.5, -0.3, 0.1]);
    let mut covered = cell(vec![table(), plate, model.obstacles()[2].clone()]);
    covered.allow(Body::HAND, "part").unwrap();
    let approach = StraightApproach { length_m: 0.2, model: &covered };
    let error =
        ArmGeometry::panda().plan(&covered, &start(), &[grasp], Some(&approach), &PlanOptions::default()).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, PlanError::ApproachBlocked { share, .. } if share > 0.2 && share < 0.9), "{text}");
    assert!(text.contains("the hand is") && text.contains("plate"), "{text}");
}

#[test]
fn a_held_part_is_carried_around_obstacles() {
    let goal = top_grasp(0.5, -0.3, 0.3, 0.0);
    let shelf = obstacle("shelf", Shape::Box { half_m: [0.25, 0.6, 0.01] }, [0.55, -0.3, 0.19]);
    let mut model = cell(vec![table(), shelf]);
    let free = ArmGeometry::panda().plan(&model, &ready_pose(), &[goal], None, &PlanOptions::default());
    assert!(free.is_ok(), "{free:?}");
    model.hold(&[Capsule::new([0.0, 0.0, 0.0], [0.0, 0.0, 0.15], 0.02)]).unwrap();
    let error = ArmGeometry::panda().plan(&model, &ready_pose(), &[goal], None, &PlanOptions::default()).unwrap_err();
    assert!(error.to_string().contains("the held part is") && error.to_string().contains("shelf"), "{error}");
}

#[test]
fn bad_input_is_named() {
    let goal = top_grasp(0.5, -0.3, 0.15, 0.0);
    let empty = cell(vec![table()]);
    let refused = |model: &CollisionModel, start: &JointVector, goals: &[Isometry3<f64>]| {
        ArmGeometry::panda().plan(model, start, goals, None, &PlanOptions::default()).unwrap_err().to_string()
    };
    let ball = |at| cell(vec![table(), obstacle("ball", Shape::Capsule { radius_m: 0.1, half_length_m: 0.0 }, at)]);

    let in_start = refused(&ball([0.5, 0.3, 0.15]), &start(), &[goal]);
    assert!(in_start.contains("the start is not free: the hand is") && in_start.contains("inside ball"), "{in_start}");
    let in_goal = refused(&ball([0.5, -0.3, 0.15]), &start(), &[goal]);
    assert!(in_goal.contains("the goal is not free") && in_goal.contains("inside ball"), "{in_goal}");
    let out_of_reach = refused(&empty, &start(), &[top_grasp(1.3, 0.0, 0.2, 0.0)]);
    assert!(out_of_reach.contains("the goal: the pose is out of reach"), "{out_of_reach}");
    let below = refused(&empty, &start(), &[top_grasp(0.5, 0.0, -0.05, 0.0)]);
    assert!(below.contains("the goal is not free") && below.contains("table"), "{below}");
    let shell = cell(vec![obstacle("hall", Shape::Box { half_m: [2.0; 3] }, [0.0; 3])]);
    let enclosed = refused(&shell, &start(), &[goal]);
    assert!(enclosed.contains("\"hall\" encloses the robot"), "{enclosed}");

    let mut nan = start();
    nan[2] = f64::NAN;
    assert!(refused(&empty, &nan, &[goal]).contains("the start: joint positions must be finite numbers"));
    let mut beyond = start();
    beyond[3] = 0.5;
    assert!(refused(&empty, &beyond, &[goal]).contains("the start: joint positions: joint 4 must lie in"));
    let mut nowhere = goal;
    nowhere.translation.vector.x = f64::NAN;
    assert!(refused(&empty, &start(), &[nowhere]).contains("the goal: the pose must be finite numbers"));
    assert!(refused(&empty, &start(), &[]).contains("at least one goal"));
    for (margin_m, name) in [(0.0, "margin_m"), (f64::NAN, "margin_m"), (1.0, "margin_m")] {
        let options = PlanOptions { margin_m, ..PlanOptions::default() };
        let error = ArmGeometry::panda().plan(&empty, &start(), &[goal], None, &options).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
}

#[test]
fn obstacles_that_make_no_sense_are_refused() {
    let refused = |shape, pose: Isometry3<f64>| {
        let obstacle = Obstacle { name: "box".to_owned(), shape, base_from_obstacle: pose };
        CollisionModel::new(&ArmGeometry::panda(), vec![obstacle], 0.08).unwrap_err().to_string()
    };
    let one = Isometry3::identity();
    assert!(
        refused(Shape::Box { half_m: [0.1, f64::NAN, 0.1] }, one).contains("box: half_m must be a positive number")
    );
    assert!(refused(Shape::Cylinder { radius_m: -0.1, half_length_m: 1.0 }, one).contains("found -0.1"));
    assert!(refused(Shape::Plane, Isometry3::translation(f64::NAN, 0.0, 0.0)).contains("must be finite"));
    let twice = CollisionModel::new(&ArmGeometry::panda(), vec![table(), table()], 0.08).unwrap_err().to_string();
    assert!(twice.contains("named \"table\""), "{twice}");
    assert!(CollisionModel::new(&ArmGeometry::panda(), Vec::new(), f64::NAN).is_err());
}

#[test]
fn a_cage_is_an_error_that_names_its_bars() {
    // Four walls and a lid around the hand at its start, too close for the hand to rotate.
    let half = 0.02;
    let walls = [
        ("left", [0.2, half, 0.25], [0.5, 0.48, 0.25]),
        ("right", [0.2, half, 0.25], [0.5, 0.12, 0.25]),
        ("front", [half, 0.2, 0.25], [0.72, 0.3, 0.25]),
        ("back", [half, 0.2, 0.25], [0.30, 0.3, 0.25]),
    ];
    let mut obstacles: Vec<Obstacle> =
        walls.iter().map(|(name, half_m, at)| obstacle(name, Shape::Box { half_m: *half_m }, *at)).collect();
    obstacles.push(table());
    // The arm itself enters from above. A goal outside at the same height can only be reached through the top.
    let lid = Isometry3::from_parts(Vector3::new(0.5, 0.3, 0.55).into(), UnitQuaternion::identity());
    obstacles.push(Obstacle {
        name: "lid".to_owned(),
        shape: Shape::Box { half_m: [0.2, 0.2, 0.02] },
        base_from_obstacle: lid,
    });
    match plan(&cell(obstacles), &[top_grasp(0.5, -0.3, 0.15, 0.0)], 3) {
        Err(PlanError::StartBlocked { .. } | PlanError::NotFound { .. }) => {}
        other => panic!("{other:?}"),
    }
}
