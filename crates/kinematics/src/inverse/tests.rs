use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

/// What the closed form and the polish leave.
const POSITION_TOLERANCE_M: f64 = 1e-6;
const ANGLE_TOLERANCE_RAD: f64 = 1e-6;

fn random_configuration(rng: &mut Pcg64Mcg) -> JointVector {
    let limits = JointLimits::franka();
    JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]))
}

/// The hand straight down, turned by `yaw_rad` about the vertical.
fn top_grasp(x: f64, y: f64, z: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
    )
}

fn assert_reaches(panda: &Panda, target: &Isometry3<f64>, solution: &IkSolution) {
    let error = pose_error(&panda.forward(&solution.q), target);
    assert!(error.fixed_rows::<3>(0).norm() <= POSITION_TOLERANCE_M);
    assert!(error.fixed_rows::<3>(3).norm() <= ANGLE_TOLERANCE_RAD);
    assert_eq!(panda.limits().worst_violation(&solution.q, 0.0), None);
    assert!(solution.limit_margin_rad >= 0.0);
}

/// Inverse kinematics that shares nothing with the closed form: descent from random configurations.
fn reaches_by_descent(panda: &Panda, target: &Isometry3<f64>, rng: &mut Pcg64Mcg) -> bool {
    (0..30).any(|_| {
        let start = random_configuration(rng);
        let q = descend(panda, panda.limits(), target, &start, 0.3);
        pose_error(&panda.forward(&q), target).norm() < 1e-5
    })
}

#[test]
fn every_pose_of_a_random_configuration_is_reached() {
    let panda = Panda::new();
    let options = IkOptions::default();
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    for _ in 0..1000 {
        let target = panda.forward(&random_configuration(&mut rng));
        let seed = random_configuration(&mut rng);
        let solution = panda.inverse(&target, &seed, &options).unwrap();
        assert_reaches(&panda, &target, &solution);
    }
}

#[test]
fn top_grasps_over_the_table_are_reached_unless_descent_cannot_either() {
    let panda = Panda::new();
    let options = IkOptions::default();
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let (mut num_reached, mut num_refused, mut num_missed) = (0, 0, 0);
    for _ in 0..1000 {
        let target = top_grasp(
            rng.random_range(0.3..0.7),
            rng.random_range(-0.35..0.35),
            rng.random_range(0.0..0.6),
            rng.random_range(-PI..PI),
        );
        match panda.inverse(&target, &ready_pose(), &options) {
            Ok(solution) => {
                assert_reaches(&panda, &target, &solution);
                num_reached += 1;
            }
            Err(_) if num_refused < 40 => {
                num_refused += 1;
                num_missed += usize::from(reaches_by_descent(&panda, &target, &mut rng));
            }
            Err(_) => {}
        }
    }
    println!("reached {num_reached}, refused {num_refused}, missed {num_missed}");
    assert_eq!(num_missed, 0);
    assert!(num_reached > 900, "{num_reached}");
}
