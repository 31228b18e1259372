use std::f64::consts::PI;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::ik::IkOptions;
use crate::joints::ready_pose;
use crate::test_poses::top_grasp;

fn descent(panda: &ArmGeometry) -> JointPath {
    let above = top_grasp(0.5, 0.1, 0.3, 0.4);
    let start = panda.inverse(&above, &ready_pose(), &IkOptions::default()).unwrap();
    let end = top_grasp(0.5, 0.1, 0.02, 0.4);
    panda.straight_path(&start.q, &end, &LineOptions::default()).unwrap()
}

#[test]
fn the_tcp_stays_on_the_line_between_waypoints_too() {
    // The error of quintic pieces of 5 mm, far below the resolution of any robot.
    const TOLERANCE: f64 = 1e-8;
    let panda = ArmGeometry::panda();
    let path = descent(&panda);
    assert!((path.distance_m() - 0.28).abs() < 1e-6);
    assert!(path.angle_rad() < 1e-6);
    for i in 0..=1000 {
        let s = path.length_m() * i as f64 / 1000.0;
        let pose = panda.forward(&path.at(s).q);
        let off = pose_error(&pose, &path.base_from_tcp(s)).norm();
        assert!(off < TOLERANCE, "{off} at {s}");
        assert!((pose.translation.x - 0.5).abs() < 1e-6);
        assert!((pose.translation.z - (0.3 - s)).abs() < 1e-6);
    }
}

#[test]
fn derivatives_agree_with_finite_differences() {
    let path = descent(&ArmGeometry::panda());
    let step = 1e-4;
    for i in 1..100 {
        // Between waypoints, where the third derivative does not jump.
        let s = path.length_m() * (i as f64 + 0.37) / 101.0;
        let (before, here, after) = (path.at(s - step), path.at(s), path.at(s + step));
        let error = |numeric: JointVector, exact: JointVector| (numeric - exact).amax();
        assert!(error((after.q - before.q) / (2.0 * step), here.dq) < 1e-5);
        assert!(error((after.dq - before.dq) / (2.0 * step), here.ddq) < 1e-3);
        assert!(error((after.ddq - before.ddq) / (2.0 * step), here.dddq) < 1.0, "{s}");
    }
}

#[test]
fn a_line_with_a_turn_ends_at_the_pose_asked_for() {
    let panda = ArmGeometry::panda();
    let start = panda.inverse(&top_grasp(0.45, -0.1, 0.3, 0.0), &ready_pose(), &IkOptions::default()).unwrap();
    let end = top_grasp(0.55, 0.15, 0.1, 1.0);
    let path = panda.straight_path(&start.q, &end, &LineOptions::default()).unwrap();
    assert!((path.angle_rad() - 1.0).abs() < 1e-6);
    assert!(pose_error(&panda.forward(path.end()), &end).norm() < 1e-9);
    let halfway = panda.forward(&path.at(path.length_m() / 2.0).q);
    assert!(pose_error(&halfway, &top_grasp(0.5, 0.025, 0.2, 0.5)).norm() < 1e-6);
}

#[test]
fn joints_move_little_from_waypoint_to_waypoint() {
    let path = descent(&ArmGeometry::panda());
    assert!(path.waypoints().len() == 57);
    let waypoints: Vec<_> = path.waypoints().collect();
    for pair in waypoints.windows(2) {
        assert!((pair[1] - pair[0]).amax() < 0.05);
    }
}

#[test]
fn most_descents_from_the_best_configuration_succeed() {
    let panda = ArmGeometry::panda();
    let mut rng = Pcg64Mcg::seed_from_u64(21);
    let (mut num, mut num_followed) = (0, 0);
    while num < 300 {
        let (x, y) = (rng.random_range(0.3..0.65), rng.random_range(-0.3..0.3));
        let yaw = rng.random_range(-PI..PI);
        let above = top_grasp(x, y, 0.25, yaw);
        let Ok(start) = panda.inverse(&above, &ready_pose(), &IkOptions::default()) else {
            continue;
        };
        num += 1;
        let end = top_grasp(x, y, 0.02, yaw);
        if let Ok(path) = panda.straight_path(&start.q, &end, &LineOptions::default()) {
            num_followed += 1;
            for q in path.waypoints() {
                assert_eq!(panda.limits.worst_violation(q, 1e-8), None);
            }
        }
    }
    // The other lines need another start configuration, which `ArmGeometry::approach` chooses.
    assert!(num_followed >= 285, "{num_followed}");
}

#[test]
fn the_elbow_slides_away_from_limits_without_moving_the_tcp() {
    let panda = ArmGeometry::panda();
    let limits = &panda.limits;
    // Sum of the fourth powers of the joints' positions in their ranges, from -1 to 1.
    let crowding = |q: &JointVector| {
        let half_range = (limits.position_max - limits.position_min) * 0.5;
        (q - limits.middle()).component_div(&half_range).map(|u| u.powi(4)).sum()
    };
    // The elbow is far to one side.
    let mut seed = ready_pose();
    (seed[0], seed[2]) = (1.6, -1.6);
    let nearest_to_seed = IkOptions { posture_weight: 0.0, limit_weight: 0.0, ..IkOptions::default() };
    let above = top_grasp(0.45, 0.2, 0.3, 0.0);
    let start = panda.inverse(&above, &seed, &nearest_to_seed).unwrap();
    let end = top_grasp(0.45, 0.2, 0.05, 0.0);
    let [without, with] = [0.0, 4.0].map(|limit_avoidance| {
        let options = LineOptions { limit_avoidance, ..LineOptions::default() };
        panda.straight_path(&start.q, &end, &options).unwrap()
    });
    assert!(crowding(with.end()) < crowding(without.end()) - 0.01);
    let apart = pose_error(&panda.forward(with.end()), &panda.forward(without.end()));
    assert!(apart.norm() < 1e-9);
}

#[test]
fn a_path_out_of_reach_says_how_far_it_gets() {
    let panda = ArmGeometry::panda();
    let end = top_grasp(1.2, 0.0, 0.4, 0.0);
    let error = panda.straight_path(&ready_pose(), &end, &LineOptions::default()).unwrap_err();
    let (KinematicsError::PathBlocked { at_share, .. } | KinematicsError::PathJointLimit { at_share, .. }) = error
    else {
        panic!("{error}");
    };
    // The line is from x = 0.31 to 1.2; the arm's reach ends near 0.75.
    assert!((0.3..0.7).contains(&at_share), "{at_share}");
}

#[test]
fn a_path_to_where_the_tcp_is_stands_still() {
    let panda = ArmGeometry::panda();
    let here = panda.forward(&ready_pose());
    let path = panda.straight_path(&ready_pose(), &here, &LineOptions::default()).unwrap();
    assert_eq!(path.length_m(), 0.0);
    assert_eq!(path.at(0.5).q, ready_pose());
    assert_eq!(path.start(), path.end());
}

#[test]
fn bad_input_is_an_error() {
    let panda = ArmGeometry::panda();
    let options = LineOptions::default();
    let here = panda.forward(&ready_pose());
    let mut q = ready_pose();
    q[2] = f64::NAN;
    assert!(matches!(panda.straight_path(&q, &here, &options), Err(KinematicsError::NotFinite { what: "start", .. })));
    q[2] = 3.0;
    assert!(matches!(
        panda.straight_path(&q, &here, &options),
        Err(KinematicsError::JointOutOfRange { what: "start", violation }) if violation.joint == 3
    ));
    let mut nowhere = here;
    nowhere.translation.x = f64::INFINITY;
    assert!(panda.straight_path(&ready_pose(), &nowhere, &options).is_err());
    for step_m in [0.0, -1.0, f64::NAN] {
        let options = LineOptions { step_m, ..options.clone() };
        assert!(panda.straight_path(&ready_pose(), &here, &options).is_err());
    }
}
