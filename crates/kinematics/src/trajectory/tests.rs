use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::geometry::{ArmGeometry, pose_error};
use crate::ik::IkOptions;
use crate::joints::ready_pose;
use crate::path::LineOptions;
use crate::test_poses::{random_configuration, top_grasp};

/// Tolerance for rounding errors of the profiles.
const LIMIT_TOLERANCE: f64 = 1e-6;

/// Checks `num` + 1 samples: the limits hold, and the derivatives match the positions; the jerk is computed from
/// differences of accelerations.
fn assert_within_limits(trajectory: &Trajectory, limits: &JointLimits, num: usize) {
    let step = trajectory.duration_secs() / num as f64;
    let samples: Vec<State> = (0..=num).map(|i| trajectory.sample(step * i as f64)).collect();
    for (q, qd, qdd) in &samples {
        assert_eq!(limits.worst_violation(q, 1e-9), None);
        assert!(share(qd, &limits.velocity_max) < 1.0 + LIMIT_TOLERANCE);
        assert!(share(qdd, &limits.acceleration_max) < 1.0 + LIMIT_TOLERANCE);
    }
    for pair in samples.windows(2) {
        let jerk = (pair[1].2 - pair[0].2) / step;
        let used = share(&jerk, &limits.jerk_max);
        assert!(used < 1.0 + 1e-3, "jerk {used}");
        // With a jerk below j, the trapezoid rule has an error of at most j·step²/12 for velocities, and a similar one
        // for positions.
        let bound = limits.jerk_max * step.powi(2);
        let velocity_error = (pair[1].1 - pair[0].1) - (pair[0].2 + pair[1].2) * (step / 2.0);
        assert!(share(&velocity_error, &bound) < 1.0);
        let position_error = (pair[1].0 - pair[0].0)
            - (pair[0].1 + pair[1].1) * (step / 2.0)
            - (pair[0].2 - pair[1].2) * (step.powi(2) / 12.0);
        assert!(share(&position_error, &(bound * step)) < 1.0);
    }
}

fn assert_rests_at_both_ends(trajectory: &Trajectory) {
    for time in [0.0, trajectory.duration_secs()] {
        for near in [-1e-9, 0.0, 1e-9] {
            let (_, qd, qdd) = trajectory.sample(time + near);
            assert!(qd.amax() < 1e-6, "{qd}");
            assert!(qdd.amax() < 1e-3, "{qdd}");
        }
    }
    assert!((trajectory.sample(0.0).0 - trajectory.start()).amax() < 1e-12);
    let just_before = trajectory.sample(trajectory.duration_secs() - 1e-9).0;
    assert!((just_before - trajectory.end()).amax() < 1e-8);
}

#[test]
fn one_joint_alone_takes_the_time_of_the_textbook() {
    // Joint 1, in rad and s: v 2.175, a 15, j 7500, distance 2; duration 2/v + v/a + a/j.
    let start = ready_pose();
    let mut end = start;
    end[0] = 2.0;
    let trajectory = Trajectory::point_to_point(&start, &end, &JointLimits::panda()).unwrap();
    let expected = 2.0 / 2.175 + 2.175 / 15.0 + 15.0 / 7500.0;
    assert!((trajectory.duration_secs() - expected).abs() < 1e-9);
}

#[test]
fn point_to_point_keeps_the_limits_and_the_straight_line() {
    let mut rng = Pcg64Mcg::seed_from_u64(31);
    for scale in [1.0, 0.3] {
        let limits = JointLimits::panda().scaled(scale, scale, scale * 0.1).unwrap();
        for _ in 0..100 {
            let (start, end) = (random_configuration(&mut rng), random_configuration(&mut rng));
            let trajectory = Trajectory::point_to_point(&start, &end, &limits).unwrap();
            assert_within_limits(&trajectory, &limits, 1000);
            assert_rests_at_both_ends(&trajectory);
            let (q, _, _) = trajectory.sample(trajectory.duration_secs() * 0.3);
            let along = (q - start).dot(&(end - start)) / (end - start).norm_squared();
            assert!((start + (end - start) * along - q).amax() < 1e-12);
        }
    }
}

#[test]
fn a_motion_is_slow_only_as_far_as_a_limit_binds() {
    let mut rng = Pcg64Mcg::seed_from_u64(32);
    let limits = JointLimits::panda();
    for _ in 0..50 {
        let (start, end) = (random_configuration(&mut rng), random_configuration(&mut rng));
        let trajectory = Trajectory::point_to_point(&start, &end, &limits).unwrap();
        let (_, qd, qdd) = trajectory.sample(trajectory.duration_secs() / 2.0);
        let at_speed = share(&qd, &limits.velocity_max);
        let (_, _, early) = trajectory.sample(trajectory.duration_secs() * 0.05);
        assert!(at_speed > 0.999 || share(&early, &limits.acceleration_max) > 0.9, "{at_speed} {qdd}");
    }
}

#[test]
fn straight_paths_keep_joint_and_cartesian_limits() {
    let panda = ArmGeometry::panda();
    let mut rng = Pcg64Mcg::seed_from_u64(34);
    let mut num = 0;
    let mut shortest_share: f64 = 1.0;
    while num < 40 {
        let (x, y) = (rng.random_range(0.35..0.6), rng.random_range(-0.25..0.25));
        let yaw: f64 = rng.random_range(-1.5..1.5);
        let turn = if num % 2 == 0 { 0.0 } else { rng.random_range(-1.0..1.0) };
        let Ok(start) = panda.inverse(&top_grasp(x, y, 0.3, yaw), &ready_pose(), &IkOptions::default()) else {
            continue;
        };
        let end = top_grasp(x + 0.03, y, rng.random_range(0.02..0.28), yaw + turn);
        let Ok(path) = panda.straight_path(&start.q, &end, &LineOptions::default()) else {
            continue;
        };
        num += 1;
        let share_allowed = if num % 3 == 0 { 0.2 } else { 1.0 };
        let limits = panda.limits.scaled(share_allowed, share_allowed, share_allowed * 0.2).unwrap();
        let cartesian = CartesianLimits::panda().scaled(share_allowed, share_allowed, 1.0).unwrap();
        let trajectory = Trajectory::along_path(path.clone(), &limits, &cartesian).unwrap();
        assert_within_limits(&trajectory, &limits, 4000);
        assert_rests_at_both_ends(&trajectory);
        assert!(pose_error(&panda.forward(trajectory.end()), &end).norm() < 1e-8);

        let mut max_used: f64 = 0.0;
        for i in 0..=400 {
            let time = trajectory.duration_secs() * i as f64 / 400.0;
            let (q, qd, qdd) = trajectory.sample(time);
            let twist = panda.jacobian(&q) * qd;
            let speed = twist.fixed_rows::<3>(0).norm();
            let angular_speed = twist.fixed_rows::<3>(3).norm();
            assert!(speed <= cartesian.velocity_m_s && angular_speed <= cartesian.angular_velocity_rad_s);
            max_used = max_used
                .max(share(&qd, &limits.velocity_max))
                .max(share(&qdd, &limits.acceleration_max))
                .max(speed / cartesian.velocity_m_s)
                .max(angular_speed / cartesian.angular_velocity_rad_s);
        }
        shortest_share = shortest_share.min(max_used);
    }
    // Some limit is reached, or else the motion would be slower than necessary. The jerk, which can be the only limit,
    // is not counted in this test.
    assert!(shortest_share > 0.7, "{shortest_share}");
}

#[test]
fn a_low_jerk_limit_binds_and_holds_on_a_curved_path() {
    // At a five-hundredth of Franka's jerk, the acceleration limits are not reached, and the path's curvature has an
    // effect.
    let panda = ArmGeometry::panda();
    let limits = panda.limits.scaled(1.0, 1.0, 0.002).unwrap();
    let start = top_grasp(0.4, 0.2, 0.3, 0.5);
    let start = panda.inverse(&start, &ready_pose(), &IkOptions::default()).unwrap();
    let end = top_grasp(0.6, -0.2, 0.05, -0.6);
    let path = panda.straight_path(&start.q, &end, &LineOptions::default()).unwrap();
    let trajectory = Trajectory::along_path(path, &limits, &CartesianLimits::panda()).unwrap();
    const NUM: usize = 4000;
    assert_within_limits(&trajectory, &limits, NUM);
    let step = trajectory.duration_secs() / NUM as f64;
    let max_jerk = (1..=NUM)
        .map(|i| {
            let [before, after] = [i - 1, i].map(|i| trajectory.sample(step * i as f64).2);
            share(&((after - before) / step), &limits.jerk_max)
        })
        .fold(0.0, f64::max);
    assert!(max_jerk > 0.9, "{max_jerk}");
}

#[test]
fn standing_still_takes_no_time() {
    let limits = JointLimits::panda();
    let trajectory = Trajectory::point_to_point(&ready_pose(), &ready_pose(), &limits).unwrap();
    assert_eq!(trajectory.duration_secs(), 0.0);
    for time in [-1.0, 0.0, 5.0, f64::NAN] {
        let (q, qd, qdd) = trajectory.sample(time);
        assert_eq!((q, qd, qdd), at_rest(&ready_pose()));
    }
}

#[test]
fn tiny_and_lopsided_motions_work() {
    let limits = JointLimits::panda();
    for size in [1e-11, 1e-9, 1e-6, 1e-3] {
        let mut end = ready_pose();
        end[1] += size;
        end[4] -= size * 1e-6;
        let trajectory = Trajectory::point_to_point(&ready_pose(), &end, &limits).unwrap();
        assert_eq!(trajectory.sample(10.0).0, end);
        assert_rests_at_both_ends(&trajectory);
    }
}

#[test]
fn bad_input_is_an_error() {
    let limits = JointLimits::panda();
    let mut q = ready_pose();
    q[6] = f64::NAN;
    assert!(matches!(
        Trajectory::point_to_point(&ready_pose(), &q, &limits),
        Err(KinematicsError::NotFinite { what: "end", .. })
    ));
    q[6] = 3.0;
    assert!(matches!(
        Trajectory::point_to_point(&q, &ready_pose(), &limits),
        Err(KinematicsError::JointOutOfRange { what: "start", violation }) if violation.joint == 7
    ));
}
