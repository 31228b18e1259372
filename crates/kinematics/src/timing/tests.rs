use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::dynamics::ArmDynamics;
use crate::geometry::ArmGeometry;
use crate::joints::{JointVector, ready_pose};
use crate::limits::{CartesianLimits, JointLimits};
use crate::rounded_path::length_secs;
use crate::test_poses::random_configuration;
use crate::trajectory::Trajectory;

/// A path through random configurations, with corners of a fraction of the available space.
fn random_path(rng: &mut Pcg64Mcg, share: f64) -> RoundedPath {
    let num_waypoints = rng.random_range(2..=6);
    let reach = rng.random_range(0.05..1.0);
    let middle = random_configuration(rng);
    let waypoints: Vec<JointVector> =
        (0..num_waypoints).map(|_| middle + (random_configuration(rng) - middle) * reach).collect();
    let lengths: Vec<f64> = waypoints.windows(2).map(|pair| length_secs(&pair[0], &pair[1])).collect();
    let sizes: Vec<f64> = lengths.windows(2).map(|two| 0.5 * share * two[0].min(two[1])).collect();
    RoundedPath::new(&waypoints, &sizes)
}

fn share(values: &JointVector, limits: &JointVector) -> f64 {
    values.abs().component_div(limits).max()
}

/// The largest used fraction of each limit at samples: joint velocity and acceleration, jerk by differences, torques.
fn largest_shares(motion: &Trajectory, joints: &JointLimits, dynamics: &ArmDynamics) -> [f64; 4] {
    const STEP_SECS: f64 = 1e-3;
    let mut largest = [0.0_f64; 4];
    let mut before = JointVector::zeros();
    for step in 0..=(motion.duration_secs() / STEP_SECS).ceil() as usize {
        let (q, qd, qdd) = motion.sample(step as f64 * STEP_SECS);
        let jerk = (qdd - before) / STEP_SECS;
        before = qdd;
        let torque = dynamics.torques_nm(&q, &qd, &qdd);
        for (largest, found) in largest.iter_mut().zip([
            share(&qd, &joints.velocity_max),
            share(&qdd, &joints.acceleration_max),
            share(&jerk, &joints.jerk_max),
            share(&torque, &joints.torque_max),
        ]) {
            *largest = largest.max(found);
        }
    }
    largest
}

#[test]
fn one_joint_alone_takes_the_time_of_the_textbook() {
    // Joint 1, in rad and s: v 2.175, a 15, j 7500, distance 2; duration 2/v + v/a + a/j.
    let mut end = ready_pose();
    end[0] = 2.0;
    let mut cartesian = CartesianLimits::panda();
    (cartesian.velocity_m_s, cartesian.angular_velocity_rad_s) = (10.0, 10.0);
    let path = RoundedPath::new(&[ready_pose(), end], &[]);
    let motion = Trajectory::along_rounded_path(
        path,
        &JointLimits::panda(),
        &cartesian,
        &ArmDynamics::new(&ArmGeometry::panda(), 0.08),
    )
    .unwrap();
    let expected = 2.0 / 2.175 + 2.175 / 15.0 + 15.0 / 7500.0;
    // The tolerance covers the grid's last part before full speed, and `HEADROOM`.
    assert!((motion.duration_secs() / expected - 1.0).abs() < 2e-3, "{} of {expected}", motion.duration_secs());
}

#[test]
fn a_way_out_and_back_turns_round_at_its_corner() {
    let mut out = ready_pose();
    (out[0], out[3]) = (0.8, -2.0);
    let path = RoundedPath::new(&[ready_pose(), out, ready_pose()], &[0.2]);
    let (joints, dynamics) = (JointLimits::panda(), ArmDynamics::new(&ArmGeometry::panda(), 0.08));
    let motion = Trajectory::along_rounded_path(path, &joints, &CartesianLimits::panda(), &dynamics).unwrap();
    let shares = largest_shares(&motion, &joints, &dynamics);
    assert!(shares.iter().all(|share| *share < 1.0 + 1e-3), "{shares:?}");
    assert!(motion.duration_secs() < 1.2, "{}", motion.duration_secs());
}

#[test]
fn random_ways_keep_all_limits_and_lose_little_by_the_jerk() {
    const TOLERANCE: f64 = 1.0 + 1e-3;
    let mut rng = Pcg64Mcg::seed_from_u64(61);
    let dynamics = ArmDynamics::new(&ArmGeometry::panda(), 0.08).with_load(0.5, [0.0, 0.0, 0.12]);
    let mut losses = Vec::new();
    for number in 0..120 {
        let scale = [1.0, 0.6, 0.1][number % 3];
        let joints = JointLimits::panda().scaled(scale, scale, scale).unwrap();
        let path = random_path(&mut rng, [1.0, 0.3, 0.02][number / 3 % 3]);
        let motion =
            Trajectory::along_rounded_path(path.clone(), &joints, &CartesianLimits::panda(), &dynamics).unwrap();
        let shares = largest_shares(&motion, &joints, &dynamics);
        assert!(shares.iter().all(|share| *share < TOLERANCE), "{number}: {shares:?}");
        assert_eq!((motion.sample(0.0).0, motion.sample(1e3).0), (*path.start(), *path.end()));
        let (_, qd, qdd) = motion.sample(motion.duration_secs() - 1e-9);
        assert!(qd.amax() < 1e-6 && qdd.amax() < 1e-3, "{qd} {qdd}");
        losses.push(motion.duration_secs() / motion.without_jerk_limit_secs().unwrap());
    }
    losses.sort_by(f64::total_cmp);
    let [median, most] = [losses[losses.len() / 2], losses[losses.len() - 1]];
    println!("times over those without a limit of the jerk: median {median:.4}, most {most:.4}");
    assert!(losses[0] > 0.999 && median < 1.02 && most < 1.15, "{median} {most}");
}

#[test]
fn weak_joints_slow_a_motion_down_and_too_weak_ones_are_named() {
    let mut rng = Pcg64Mcg::seed_from_u64(62);
    let dynamics = ArmDynamics::new(&ArmGeometry::panda(), 0.08);
    let (mut num_slower, mut num_refused) = (0, 0);
    for _ in 0..40 {
        let path = random_path(&mut rng, 1.0);
        let mut weak = JointLimits::panda();
        weak.torque_max *= 0.45;
        let plan = |joints| Trajectory::along_rounded_path(path.clone(), joints, &CartesianLimits::panda(), &dynamics);
        match plan(&weak) {
            Ok(motion) => {
                let shares = largest_shares(&motion, &weak, &dynamics);
                assert!(shares.iter().all(|share| *share < 1.0 + 1e-3), "{shares:?}");
                let strong = plan(&JointLimits::panda()).unwrap();
                num_slower += usize::from(motion.duration_secs() > strong.duration_secs() * 1.01);
            }
            Err(KinematicsError::Trajectory { reason }) => {
                num_refused += 1;
                assert!(reason.contains("to hold arm and load"), "{reason}");
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(num_slower > 3 && num_refused > 0 && num_refused < 36, "{num_slower} slower, {num_refused} refused");
}

#[test]
fn a_pass_keeps_its_rows_and_leaves_no_room() {
    let mut rng = Pcg64Mcg::seed_from_u64(63);
    let (joints, cartesian, dynamics) =
        (JointLimits::panda(), CartesianLimits::panda(), ArmDynamics::new(&ArmGeometry::panda(), 0.08));
    let mut ratios = Vec::new();
    for _ in 0..20 {
        let path = random_path(&mut rng, 1.0);
        let limits = MotionLimits { joints: &joints, cartesian: &cartesian, dynamics: &dynamics };
        let grid = Grid::new(&path, &limits).unwrap();
        let none = Tightening::none(&grid);
        let phases = phase_plane::fastest(&grid, &none).unwrap();
        let secs = Profile::new(&phases, 1e-3).duration_secs() - 1e-3;
        let finer = Grid::finer(&path, &limits, 8).unwrap();
        let finer_phases = phase_plane::fastest(&finer, &Tightening::none(&finer)).unwrap();
        let finer_secs = Profile::new(&finer_phases, 1e-3).duration_secs() - 1e-3;
        ratios.push(secs / finer_secs);
        let mut num_slack = 0;
        for (index, phase) in phases.iter().enumerate() {
            let [from, to] = phase.speeds.map(|speed| speed * speed);
            let acceleration = (to - from) / (2.0 * phase.length);
            let mut room: f64 = 1.0;
            for (place, squared) in [(index, from), (index + 1, to)] {
                for row in &grid.places[place].rows {
                    let found = row.slope * acceleration + row.curvature * squared;
                    let here = (found - row.low).min(row.high - found) / (row.high - row.low);
                    assert!(here > -1e-6, "{found} {row:?}");
                    room = room.min(here);
                }
                let speed_room = 1.0 - squared / grid.places[place].max_squared;
                assert!(speed_room > -1e-9);
                room = room.min(speed_room);
            }
            num_slack += usize::from(room > 0.01);
        }
        // Some limit is reached everywhere, except on the part where the two passes meet and on one part before each
        // point that bounds the speed.
        assert!(num_slack * 8 < phases.len(), "{num_slack} of {}", phases.len());
        let slowest_joint: f64 = length_secs(path.start(), path.end());
        assert!(secs > slowest_joint, "nothing is quicker than full speed all the way");
    }
    ratios.sort_by(f64::total_cmp);
    println!("times over those on an eight times finer grid: {:.4} to {:.4}", ratios[0], ratios[ratios.len() - 1]);
    assert!(ratios[0] > 0.995 && ratios[ratios.len() / 2] < 1.002 && ratios[ratios.len() - 1] < 1.015, "{ratios:?}");
}
