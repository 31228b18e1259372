use std::f64::consts::PI;

use nalgebra::Isometry3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::joints::ready_pose;
use crate::test_poses::{random_configuration, top_grasp};

/// Remaining errors of the closed form and the refinement.
const POSITION_TOLERANCE_M: f64 = 1e-6;
const ANGLE_TOLERANCE_RAD: f64 = 1e-6;

fn assert_reaches(panda: &ArmGeometry, target: &Isometry3<f64>, solution: &IkSolution) {
    let error = pose_error(&panda.forward(&solution.q), target);
    assert!(error.fixed_rows::<3>(0).norm() <= POSITION_TOLERANCE_M);
    assert!(error.fixed_rows::<3>(3).norm() <= ANGLE_TOLERANCE_RAD);
    assert_eq!(panda.limits.worst_violation(&solution.q, 0.0), None);
    assert!(solution.limit_margin_rad >= 0.0);
}

/// Inverse kinematics independent of the closed form: descent from random configurations.
fn reaches_by_descent(panda: &ArmGeometry, target: &Isometry3<f64>, rng: &mut Pcg64Mcg) -> bool {
    (0..30).any(|_| {
        let start = random_configuration(rng);
        let q = descend(panda, &panda.limits, target, &start, 0.3);
        pose_error(&panda.forward(&q), target).norm() < 1e-5
    })
}

#[test]
fn every_pose_of_a_random_configuration_is_reached() {
    let panda = ArmGeometry::panda();
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
    let panda = ArmGeometry::panda();
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
    assert_eq!(num_missed, 0);
    assert!(num_reached > 900, "{num_reached}");
}

#[test]
fn a_pose_already_taken_keeps_its_configuration() {
    let panda = ArmGeometry::panda();
    let options = IkOptions { posture_weight: 0.0, limit_weight: 0.0, ..IkOptions::default() };
    let mut rng = Pcg64Mcg::seed_from_u64(13);
    for _ in 0..200 {
        let q = random_configuration(&mut rng);
        let solution = panda.inverse(&panda.forward(&q), &q, &options).unwrap();
        assert!((solution.q - q).norm() < 1e-2, "{} for {q}", solution.q);
    }
}

#[test]
fn the_search_mostly_finds_the_cheapest_of_a_dense_scan() {
    let panda = ArmGeometry::panda();
    let coarse = IkOptions::default();
    let dense = IkOptions { num_redundancy_samples: 1500, ..coarse.clone() };
    let mut rng = Pcg64Mcg::seed_from_u64(14);
    let mut num_worse = 0;
    for _ in 0..200 {
        let target = panda.forward(&random_configuration(&mut rng));
        let found = panda.inverse(&target, &ready_pose(), &coarse).unwrap();
        let best = panda.inverse(&target, &ready_pose(), &dense).unwrap();
        assert!(best.cost < found.cost + 1e-3);
        num_worse += usize::from(found.cost > best.cost * 1.01);
    }
    // The coarse grid misses intervals of q7 that are narrower than its step, and configurations with an upright upper
    // arm.
    assert!(num_worse <= 16, "{num_worse} of 200");
}

#[test]
fn all_ways_reach_and_come_best_first() {
    let panda = ArmGeometry::panda();
    let options = IkOptions::default();
    let target = top_grasp(0.5, 0.1, 0.2, 0.3);
    let all = panda.inverse_all(&target, &ready_pose(), &options).unwrap();
    let best = panda.inverse(&target, &ready_pose(), &options).unwrap();
    assert_eq!(all[0], best);
    assert!(all.len() >= 2, "{}", all.len());
    for pair in all.windows(2) {
        assert!(pair[0].cost <= pair[1].cost);
        assert!((pair[0].q - pair[1].q).norm() > 0.1);
    }
    for solution in &all {
        assert_reaches(&panda, &target, solution);
    }
}

#[test]
fn a_margin_asked_for_is_kept() {
    let panda = ArmGeometry::panda();
    let options = IkOptions { required_margin_rad: 0.2, ..IkOptions::default() };
    let mut rng = Pcg64Mcg::seed_from_u64(15);
    for _ in 0..100 {
        let target = top_grasp(rng.random_range(0.35..0.6), rng.random_range(-0.2..0.2), 0.2, 0.0);
        let solution = panda.inverse(&target, &ready_pose(), &options).unwrap();
        assert!(solution.limit_margin_rad >= 0.2 - 1e-9);
    }
}

#[test]
fn out_of_reach_names_the_distance() {
    let panda = ArmGeometry::panda();
    // The arm is stretched horizontally at shoulder height: the wrist centre reaches 0.7193 m (both sides of the
    // triangle), and hand and wrist in line reach at most hypot(0.088, 0.107 + 0.1034) further. For a pose at 3 m, at
    // least 2.05 m are missing at every orientation of the hand.
    let target = top_grasp(3.0, 0.0, 0.333, 0.0);
    let error = panda.inverse(&target, &ready_pose(), &IkOptions::default()).unwrap_err();
    let KinematicsError::OutOfReach { target_m, nearest, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!(*target_m, [3.0, 0.0, 0.333]);
    let furthest = 0.316f64.hypot(0.0825) + 0.384f64.hypot(0.0825) + 0.088f64.hypot(0.2104);
    assert!(nearest.position_residual_m >= 3.0 - furthest - 1e-9);
    assert!(nearest.position_residual_m < 2.3, "{}", nearest.position_residual_m);
    assert_eq!(panda.limits.worst_violation(&nearest.q, 0.0), None);
    assert!(error.to_string().contains("out of reach"), "{error}");
}

#[test]
fn a_limit_that_forbids_a_pose_is_named() {
    let panda = ArmGeometry::panda();
    // So close to the base, the elbow would have to fold beyond its limit of 3.0718 rad.
    let error = panda.inverse(&top_grasp(0.1, 0.0, 0.1, 0.0), &ready_pose(), &IkOptions::default()).unwrap_err();
    let KinematicsError::JointLimit { violation, nearest } = &error else {
        panic!("{error}");
    };
    assert_eq!(violation.joint, 4);
    assert!(violation.found_rad < violation.min_rad && violation.excess_rad() < 0.2);
    assert!(nearest.position_residual_m + nearest.angle_residual_rad > 1e-3);
    assert_eq!(panda.limits.worst_violation(&nearest.q, 0.0), None);
}

#[test]
fn the_nearest_pose_is_no_further_than_descent_finds() {
    let panda = ArmGeometry::panda();
    let options = IkOptions::default();
    let mut rng = Pcg64Mcg::seed_from_u64(16);
    for _ in 0..20 {
        let target = top_grasp(rng.random_range(0.85..1.1), rng.random_range(-0.3..0.3), 0.3, 0.0);
        let error = panda.inverse(&target, &ready_pose(), &options).unwrap_err();
        let (KinematicsError::OutOfReach { nearest, .. } | KinematicsError::JointLimit { nearest, .. }) = error else {
            panic!("{error}");
        };
        let miss = |q: &JointVector| {
            let error = pose_error(&panda.forward(q), &target);
            error.fixed_rows::<3>(0).norm().hypot(0.3 * error.fixed_rows::<3>(3).norm())
        };
        let best = (0..20)
            .map(|_| miss(&descend(&panda, &panda.limits, &target, &random_configuration(&mut rng), 0.3)))
            .fold(f64::INFINITY, f64::min);
        assert!(miss(&nearest.q) <= best * 1.05 + 1e-3, "{} {best}", miss(&nearest.q));
    }
}

#[test]
fn the_same_question_has_the_same_bits_in_its_answer() {
    let target = top_grasp(0.42, -0.2, 0.13, 2.0);
    let solve = || ArmGeometry::panda().inverse(&target, &ready_pose(), &IkOptions::default()).unwrap();
    assert_eq!(solve(), solve());
}

#[test]
fn singular_configurations_are_reached_too() {
    let panda = ArmGeometry::panda();
    // An upright upper arm (joints 1 and 3 have the same axis); an elbow as straight as possible; the ends of the
    // joints' ranges; an arm stretched upwards.
    let mut upright = ready_pose();
    upright[1] = 0.0;
    let mut straight = ready_pose();
    straight[3] = -0.0698;
    let mut at_limits = panda.limits.position_max;
    at_limits[1] = 0.5;
    for q in [
        upright,
        straight,
        at_limits,
        panda.limits.position_min,
        JointVector::repeat(-0.0175).map_with_location(|i, _, x| if i == 3 { -0.0698 } else { x }),
    ] {
        let target = panda.forward(&q);
        let solution = panda.inverse(&target, &ready_pose(), &IkOptions::default()).unwrap();
        assert_reaches(&panda, &target, &solution);
    }
}

#[test]
fn bad_input_is_an_error() {
    let panda = ArmGeometry::panda();
    let options = IkOptions::default();
    let good = top_grasp(0.5, 0.0, 0.2, 0.0);
    let mut bad_seed = ready_pose();
    bad_seed[0] = f64::NAN;
    assert!(matches!(panda.inverse(&good, &bad_seed, &options), Err(KinematicsError::NotFinite { what: "seed", .. })));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut pose = good;
        pose.translation.y = bad;
        assert!(matches!(
            panda.inverse(&pose, &ready_pose(), &options),
            Err(KinematicsError::NotFinite { what: "base_from_tcp", .. })
        ));
        let mut pose = good;
        pose.rotation.as_mut_unchecked().coords.x = bad;
        assert!(panda.inverse(&pose, &ready_pose(), &options).is_err());
    }
    let mut stretched = good;
    stretched.rotation.as_mut_unchecked().coords *= 2.0;
    assert!(matches!(panda.inverse(&stretched, &ready_pose(), &options), Err(KinematicsError::NotARotation { .. })));
    for options in [
        IkOptions { num_redundancy_samples: 1, ..options.clone() },
        IkOptions { seed_weight: -1.0, ..options.clone() },
        IkOptions { comfortable_margin_rad: 0.0, ..options.clone() },
        IkOptions { required_margin_rad: 2.0, ..options.clone() },
        IkOptions { position_tolerance_m: f64::NAN, ..options.clone() },
    ] {
        assert!(matches!(panda.inverse(&good, &ready_pose(), &options), Err(KinematicsError::InvalidOption { .. })));
    }
}

#[test]
fn an_arm_without_a_closed_form_is_solved_by_descent() {
    let closed = ArmGeometry::panda();
    let open = ArmGeometry { closed_form: None, ..ArmGeometry::panda() };
    let options = IkOptions::default();
    let mut rng = Pcg64Mcg::seed_from_u64(21);
    for _ in 0..20 {
        let target =
            top_grasp(rng.random_range(0.35..0.6), rng.random_range(-0.3..0.3), 0.2, rng.random_range(-PI..PI));
        let found = open.inverse_all(&target, &ready_pose(), &options).unwrap();
        let best = closed.inverse(&target, &ready_pose(), &options).unwrap();
        for solution in &found {
            assert_reaches(&open, &target, solution);
            assert!(best.cost <= solution.cost + 1e-6, "{} {}", best.cost, solution.cost);
        }
        assert_eq!(found[0], open.inverse(&target, &ready_pose(), &options).unwrap());
    }
    let error = open.inverse(&top_grasp(1.3, 0.0, 0.3, 0.0), &ready_pose(), &options).unwrap_err();
    assert!(matches!(error, KinematicsError::OutOfReach { .. }), "{error}");
}

/// Universal Robots' UR5e with its published Denavit–Hartenberg parameters in Craig's convention, with Franka's hand;
/// capsules and masses are the Panda's.
fn ur5e() -> ArmGeometry {
    let [quarter, back] = [std::f64::consts::FRAC_PI_2, -std::f64::consts::FRAC_PI_2];
    let rows = [
        (0.0, 0.1625, 0.0),
        (0.0, 0.0, quarter),
        (-0.425, 0.0, 0.0),
        (-0.3922, 0.1333, 0.0),
        (0.0, 0.0997, quarter),
        (0.0, 0.0996, back),
        (0.0, 0.0, 0.0),
    ];
    let panda = ArmGeometry::panda();
    let mut limits = panda.limits.clone();
    limits.position_min = JointVector::repeat(-PI);
    limits.position_max = JointVector::repeat(PI);
    // The arm has six joints.
    (limits.position_min[6], limits.position_max[6]) = (0.0, 0.0);
    ArmGeometry {
        joints: rows.map(|(a_m, d_m, alpha_rad)| crate::geometry::DhJoint { a_m, d_m, alpha_rad }),
        flange_offset_m: 0.0,
        limits,
        ready: JointVector::from([0.0, -1.57, -1.57, -1.57, 1.57, 0.0, 0.0]),
        closed_form: None,
        ..panda
    }
}

#[test]
fn a_third_arm_of_six_joints_is_another_value() {
    let arm = ur5e();
    // Stretched at zero: -0.425 - 0.3922 along x, -0.1333 - 0.0996 along y, 0.1625 - 0.0997 upwards.
    let flange = arm.base_from_flange(&JointVector::zeros()).translation.vector;
    assert!((flange - nalgebra::Vector3::new(-0.8172, -0.2329, 0.0628)).norm() < 1e-12, "{flange}");
    let mut rng = Pcg64Mcg::seed_from_u64(22);
    for _ in 0..10 {
        let target =
            top_grasp(-rng.random_range(0.35..0.55), rng.random_range(-0.3..0.3), 0.3, rng.random_range(-PI..PI));
        let solutions = arm.inverse_all(&target, &arm.ready, &IkOptions::default()).unwrap();
        // Two solutions each for elbow, shoulder and wrist.
        assert!(solutions.len() >= 4, "{}", solutions.len());
        for solution in &solutions {
            assert_reaches(&arm, &target, solution);
            assert_eq!(solution.q[6], 0.0);
        }
        let mut below = target;
        below.translation.z -= 0.1;
        let down = |solution: &IkSolution| arm.straight_path(&solution.q, &below, &Default::default());
        let line = solutions.iter().find_map(|solution| down(solution).ok()).unwrap();
        assert!(pose_error(&arm.forward(line.end()), &below).norm() < 1e-8);
    }
}
