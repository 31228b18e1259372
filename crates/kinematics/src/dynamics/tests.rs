use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::geometry::ArmGeometry;
use crate::joints::ready_pose;
use crate::limits::JointLimits;
use crate::test_poses::random_configuration;

#[test]
fn a_load_straight_out_weighs_what_its_lever_says() {
    // The arm is stretched forwards at the height of its shoulder: joint 2 is at 90°, the others at 0. The load is
    // 0.893 m outwards from the axis of joint 2.
    let mut q = JointVector::zeros();
    q[1] = std::f64::consts::FRAC_PI_2;
    let bare = ArmDynamics::new(&ArmGeometry::panda(), 0.08);
    // The wrist is 0.316 m + 0.384 m outwards from joint 2. The flange points back to the base, 0.088 m lower.
    let out_m = 0.3;
    let loaded = bare.clone().with_load(2.0, [0.0, 0.0, -out_m]);
    let difference = loaded.gravity_nm(&q) - bare.gravity_nm(&q);
    let lever_m = 0.316 + 0.384 - 0.107 + out_m;
    assert!((difference[1] + 2.0 * GRAVITY_M_S2 * lever_m).abs() < 1e-9, "{difference}");
    assert!(difference[0].abs() < 1e-12);
}

#[test]
fn power_is_the_change_of_energy() {
    // Without friction, the joints' power is the rate of kinetic and potential energy; kinetic energy is half of
    // velocity times momentum.
    const STEP_SECS: f64 = 1e-5;
    let dynamics = ArmDynamics::new(&ArmGeometry::panda(), 0.04).with_load(0.7, [0.01, -0.02, 0.12]);
    let mut rng = Pcg64Mcg::seed_from_u64(41);
    for _ in 0..100 {
        let q = random_configuration(&mut rng);
        let (qd, qdd) = (random_configuration(&mut rng), random_configuration(&mut rng) * 3.0);
        let kinetic = |q: &JointVector, qd: &JointVector| {
            let placed = dynamics.placed(q);
            0.5 * qd.dot(&dynamics.of_motion(&placed, &JointVector::zeros(), qd, 0.0).0)
        };
        let at = |time: f64| (q + qd * time + qdd * (0.5 * time * time), qd + qdd * time);
        let [(q0, qd0), (q1, qd1)] = [-STEP_SECS, STEP_SECS].map(at);
        let kinetic_rate = (kinetic(&q1, &qd1) - kinetic(&q0, &qd0)) / (2.0 * STEP_SECS);
        let power = qd.dot(&dynamics.of_motion(&dynamics.placed(&q), &qd, &qdd, GRAVITY_M_S2).0);
        let against_weight = qd.dot(&dynamics.gravity_nm(&q));
        let error = power - against_weight - kinetic_rate;
        assert!(error.abs() < 1e-6 * (1.0 + power.abs()), "{power} {against_weight} {kinetic_rate}");
    }
}

#[test]
fn the_tcp_moves_as_the_jacobian_says() {
    const STEP_SECS: f64 = 1e-6;
    let (panda, dynamics) = (ArmGeometry::panda(), ArmDynamics::new(&ArmGeometry::panda(), 0.08));
    let mut rng = Pcg64Mcg::seed_from_u64(42);
    for _ in 0..50 {
        let q = random_configuration(&mut rng);
        let (qd, qdd) = (random_configuration(&mut rng), random_configuration(&mut rng));
        let (_, tcp) = dynamics.of_motion(&dynamics.placed(&q), &qd, &qdd, GRAVITY_M_S2);
        let twist = panda.jacobian(&q) * qd;
        assert!((twist.fixed_rows::<3>(0) - tcp.velocity).norm() < 1e-12);
        assert!((twist.fixed_rows::<3>(3) - tcp.angular_velocity).norm() < 1e-12);
        let twist_at = |time: f64| panda.jacobian(&(q + qd * time)) * (qd + qdd * time);
        let rate = (twist_at(STEP_SECS) - twist_at(-STEP_SECS)) / (2.0 * STEP_SECS);
        assert!((rate.fixed_rows::<3>(0) - tcp.acceleration).norm() < 1e-6);
        assert!((rate.fixed_rows::<3>(3) - tcp.angular_acceleration).norm() < 1e-6);
    }
}

#[test]
fn standing_in_the_ready_pose_needs_a_third_of_the_torque() {
    let gravity = ArmDynamics::new(&ArmGeometry::panda(), 0.08).gravity_nm(&ready_pose());
    for (joint, torque) in gravity.iter().enumerate() {
        assert!(torque.abs() < 0.4 * JointLimits::panda().torque_max[joint], "joint {}: {torque}", joint + 1);
    }
}
