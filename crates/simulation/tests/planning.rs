//! Plans for random problems, checked for collisions in MuJoCo at every millisecond; `make bench-planning` does the
//! same with a thousand problems.

use sdg_kinematics::dynamics::ArmDynamics;
use sdg_kinematics::planning::PlanOptions;
use sdg_kinematics::{ArmGeometry, CartesianLimits, HAND_OPENING_MAX_M, JointLimits};
use sdg_simulation::{CollisionWorld, PlanningProblem};

#[test]
fn no_path_of_fifty_collides_in_mujoco() {
    const COUNT: u64 = 50;
    /// Minimum number of paths that are found: a free start and a free goal do not imply that a path exists.
    const MIN_FOUND: usize = 49;
    let (mut num_found, mut num_bent, mut num_steps) = (0, 0, 0);
    for seed in 0..COUNT {
        let problem = PlanningProblem::obstructed(seed);
        let goals = [problem.base_from_goal];
        let mut options = PlanOptions::default();
        options.max_checks = 300_000;
        let Ok(plan) = ArmGeometry::panda().plan(&problem.model, &problem.start, &goals, None, &options) else {
            continue;
        };
        num_found += 1;
        num_bent += usize::from(plan.waypoints.len() > 2);
        let mut world = CollisionWorld::new(&problem.obstacles, HAND_OPENING_MAX_M).unwrap();
        let dynamics = ArmDynamics::new(&ArmGeometry::panda(), HAND_OPENING_MAX_M);
        for motion in plan.trajectories(&JointLimits::panda(), &CartesianLimits::panda(), &dynamics).unwrap() {
            for step in 0..=(motion.duration_secs() * 1e3).ceil() as usize {
                let overlap = world.deepest(&motion.sample(step as f64 * 1e-3).0).unwrap();
                assert_eq!(overlap, None, "problem {seed}, {step} ms");
                num_steps += 1;
            }
        }
    }
    println!("{num_found} of {COUNT} found, {num_bent} not straight, {num_steps} steps");
    assert!(num_found >= MIN_FOUND && num_bent >= 20 && num_steps > 20_000);
}
