//! Comparison of the collision model of `sdg-kinematics` with MuJoCo's collisions.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::collision::{Checker, CollisionModel, Obstacle, Shape};
use sdg_kinematics::{ArmGeometry, JointLimits, JointVector};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{CollisionWorld, SimulationError, Workcell, WorkcellConfig, random_obstacles};

/// Largest depth of an overlap in MuJoCo that the model misses, m.
const MAX_MISSED_M: f64 = 0.003;
/// Largest fraction of the configurations free in MuJoCo that collide in the model.
const MAX_FALSE_COLLISIONS: f64 = 0.05;

fn random_configurations(count: usize, rng: &mut Pcg64Mcg) -> Vec<JointVector> {
    let limits = JointLimits::panda();
    (0..count)
        .map(|_| JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i])))
        .collect()
}

#[test]
fn a_configuration_that_is_not_finite_is_no_free_one() {
    let mut world = CollisionWorld::new(&[], 0.08).unwrap();
    let mut q = sdg_kinematics::ready_pose();
    assert!(world.deepest(&q).is_ok());
    for value in [f64::NAN, f64::INFINITY] {
        q[3] = value;
        assert!(matches!(world.deepest(&q), Err(SimulationError::Unstable { .. })), "{value}");
    }
    assert!(world.deepest(&sdg_kinematics::ready_pose()).is_ok());
}

#[test]
fn an_obstacle_may_have_the_name_of_a_geom_of_the_scene() {
    // The plane is at the height of the hand, so that the arm overlaps it.
    let obstacles = vec![Obstacle {
        name: "floor".to_owned(),
        shape: Shape::Plane,
        base_from_obstacle: Isometry3::translation(0.0, 0.0, 0.6),
    }];
    let mut world = CollisionWorld::new(&obstacles, 0.08).unwrap();
    let overlap = world.deepest(&sdg_kinematics::ready_pose()).unwrap().unwrap();
    assert!(overlap.between.iter().any(|name| name == "floor"), "{overlap:?}");
    Workcell::new(&WorkcellConfig { obstacles, ..WorkcellConfig::new(SceneVariation::nominal(None)) }).unwrap();
}

#[test]
fn the_model_agrees_with_mujoco_on_a_hundred_thousand_configurations() {
    const SCENES: u64 = 100;
    const PER_SCENE: usize = 1000;
    let (mut num_free, mut num_false_collisions, mut num_missed, mut deepest_missed_m) = (0, 0, 0, 0.0_f64);
    let mut missed = BTreeMap::<String, (usize, f64)>::new();
    let mut blamed = BTreeMap::<String, usize>::new();
    for scene in 0..SCENES {
        let mut rng = Pcg64Mcg::seed_from_u64(1000 + scene);
        let obstacles = random_obstacles(1 + scene as usize % 8, scene);
        let opening_m = if scene % 2 == 0 { 0.08 } else { rng.random_range(0.0..0.08) };
        let model = CollisionModel::new(&ArmGeometry::panda(), obstacles.clone(), opening_m).unwrap();
        let mut world = CollisionWorld::new(&obstacles, opening_m).unwrap();
        let configurations = random_configurations(PER_SCENE, &mut rng);
        let distances = Checker::new(&model, 0.001).distances_m(&configurations);
        for (q, distance_m) in configurations.iter().zip(distances) {
            let deepest = world.deepest(q).unwrap();
            match (deepest, distance_m < 0.0) {
                (None, true) => {
                    num_free += 1;
                    num_false_collisions += 1;
                    let nearest = model.nearest(q);
                    let is_obstacle = obstacles.iter().any(|obstacle| obstacle.name == nearest.other);
                    let other = if is_obstacle { "obstacle".to_owned() } else { nearest.other };
                    *blamed.entry(format!("{} and {other}", nearest.body)).or_default() += 1;
                }
                (None, false) => num_free += 1,
                (Some(overlap), false) => {
                    num_missed += 1;
                    deepest_missed_m = deepest_missed_m.max(overlap.depth_m);
                    let pair = overlap.between.clone().map(|name| name.trim_end_matches(char::is_numeric).to_owned());
                    let pair =
                        if overlap.between.iter().any(|name| name.contains(' ')) { pair } else { overlap.between };
                    let entry = missed.entry(pair.join(" and ")).or_default();
                    *entry = (entry.0 + 1, entry.1.max(overlap.depth_m));
                }
                (Some(_), true) => {}
            }
        }
    }
    let share = f64::from(num_false_collisions) / f64::from(num_free);
    println!(
        "{num_free} free by MuJoCo of {}; false collisions {num_false_collisions} ({:.2} %): {blamed:?}\nmissed {num_missed}, \
         the deepest {:.2} mm: {missed:?}",
        SCENES as usize * PER_SCENE,
        share * 100.0,
        deepest_missed_m * 1e3
    );
    assert!(num_free > 10_000);
    assert!(deepest_missed_m <= MAX_MISSED_M);
    assert!(share <= MAX_FALSE_COLLISIONS);
}
