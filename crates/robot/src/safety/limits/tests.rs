use super::*;
use sdg_kinematics::{IkOptions, LineOptions, ready_pose};

fn point_to_point(change: [f64; 7], scale: [f64; 3]) -> Trajectory {
    let limits = JointLimits::panda().scaled(scale[0], scale[1], scale[2]).unwrap();
    Trajectory::point_to_point(&ready_pose(), &(ready_pose() + JointVector::from(change)), &limits).unwrap()
}

fn straight_down(to_height_m: f64) -> Trajectory {
    let panda = ArmGeometry::panda();
    let mut base_from_tcp = panda.forward(&ready_pose());
    base_from_tcp.translation.z = to_height_m;
    let path = panda.straight_path(&ready_pose(), &base_from_tcp, &LineOptions::default()).unwrap();
    let cartesian = CartesianLimits::panda().scaled(0.2, 0.1, 0.05).unwrap();
    Trajectory::along_path(path, &JointLimits::panda(), &cartesian).unwrap()
}

#[test]
fn a_motion_within_every_limit_is_handed_on_as_it_is() {
    let trajectory = point_to_point([0.5, 0.1, 0.0, 0.2, 0.0, 0.3, -0.4], [0.5, 0.4, 0.2]);
    let end = *trajectory.end();
    let checked = SafetyLimits::default().check(trajectory.clone()).unwrap();
    assert_eq!((*checked.end(), checked.duration_secs()), (end, trajectory.duration_secs()));
    assert_eq!(checked.sample(0.3), trajectory.sample(0.3));
}

/// A motion planned for exact limits satisfies them, and violates each limit that is lowered by one percent.
#[test]
fn just_inside_passes_and_just_outside_is_refused() {
    let trajectory = point_to_point([0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.3, 0.2, 0.05]);
    let planned = JointLimits::panda().scaled(0.3, 0.2, 0.05).unwrap();
    let limits = |joints| SafetyLimits { joints, ..SafetyLimits::default() };
    assert!(limits(planned.clone()).check(trajectory.clone()).is_ok());
    type Lower = fn(&mut JointLimits);
    let lowered: [(&str, Lower); 4] = [
        ("position", |limits| limits.position_max[0] = 0.396),
        ("velocity", |limits| limits.velocity_max *= 0.99),
        ("acceleration", |limits| limits.acceleration_max *= 0.99),
        ("jerk", |limits| limits.jerk_max *= 0.99),
    ];
    for (expected, lower) in lowered {
        let mut joints = planned.clone();
        lower(&mut joints);
        match limits(joints).check(trajectory.clone()).unwrap_err() {
            Violation::Joint { quantity, joint: 1, .. } => assert_eq!(quantity, expected),
            other => panic!("{expected}: {other}"),
        }
    }
}

#[test]
fn the_tcp_has_limits_of_its_own() {
    let trajectory = straight_down(0.20);
    let planned = CartesianLimits::panda().scaled(0.2, 0.1, 0.05).unwrap();
    let limits = |cartesian| SafetyLimits { cartesian, ..SafetyLimits::default() };
    // The path's third derivative jumps at its waypoints, so that the jerk from samples at 1 ms exceeds the planned
    // one.
    let mut roomy = planned;
    roomy.jerk_m_s3 = 6500.0;
    limits(roomy).check(trajectory.clone()).unwrap();
    type Lower = fn(&mut CartesianLimits);
    let lowered: [(&str, Lower); 3] = [
        ("velocity", |limits| limits.velocity_m_s = 0.1),
        ("acceleration", |limits| limits.acceleration_m_s2 = 0.5),
        ("jerk", |limits| limits.jerk_m_s3 = 10.0),
    ];
    for (expected, lower) in lowered {
        let mut cartesian = roomy;
        lower(&mut cartesian);
        match limits(cartesian).check(trajectory.clone()).unwrap_err() {
            Violation::Cartesian { quantity, .. } => assert_eq!(quantity, expected),
            other => panic!("{expected}: {other}"),
        }
    }
    let turning = point_to_point([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5], [0.9, 0.5, 0.2]);
    let mut slow = CartesianLimits::panda();
    slow.angular_velocity_rad_s = 0.5;
    let found = limits(slow).check(turning).unwrap_err().to_string();
    assert!(found.contains("the angular velocity of the tcp is 0.5") && found.contains("rad/s"), "{found}");
}

#[test]
fn table_and_workspace_stop_a_motion_before_it_begins() {
    let limits = SafetyLimits::default();
    // The finger tips extend 4 mm beyond the tcp and must keep 1 mm: a tcp at 6 mm is allowed, one at 4 mm is not.
    limits.check(straight_down(0.006)).unwrap();
    let found = limits.check(straight_down(0.004)).unwrap_err();
    assert!(matches!(found, Violation::Table { part: "finger tips", .. }), "{found}");
    let raised = SafetyLimits { table_height_m: 0.1, ..limits.clone() };
    assert!(raised.check(straight_down(0.1)).is_err());

    let workspace = WorkspaceBox { min_m: Vector3::new(0.2, -0.4, 0.0), max_m: Vector3::new(0.8, 0.4, 0.9) };
    let fenced = SafetyLimits { workspace: Some(workspace), ..limits };
    fenced.check(straight_down(0.1)).unwrap();
    let found = fenced.check(point_to_point([1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.2, 0.2, 0.2])).unwrap_err();
    assert!(matches!(found, Violation::Workspace { axis: 'x' | 'y', .. }), "{found}");
}

#[test]
fn finger_tips_are_checked_also_if_the_hand_is_lower_than_the_tcp() {
    // The hand is tilted by 42° along the fingers' motion: its body is 3.7 mm lower than the fingers at the tcp.
    let mut q = ready_pose();
    (q[5], q[6]) = (q[5] - 42_f64.to_radians(), q[6] + std::f64::consts::FRAC_PI_2);
    let clearance = ArmGeometry::panda().clearance(&q, 0.0);
    assert_eq!(clearance.part, ArmPart::Hand);
    let limits = |fingertip_beyond_tcp_m| {
        let table_height_m = clearance.lowest_m - 0.002;
        SafetyLimits { table_height_m, fingertip_beyond_tcp_m, ..SafetyLimits::default() }
    };
    limits(0.004).check_table(0.0, &q).unwrap();
    let found = limits(0.009).check_table(0.0, &q).unwrap_err();
    assert!(matches!(found, Violation::Table { part: "finger tips", .. }), "{found}");
}

#[test]
fn an_arm_that_would_fold_onto_itself_is_stopped_before() {
    let folded = JointVector::from([0.0, -1.7, 0.0, -3.0, 0.0, 0.5, 0.0]);
    let slow = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
    let trajectory = Trajectory::point_to_point(&ready_pose(), &folded, &slow).unwrap();
    let open = SafetyLimits { table_height_m: -2.0, ..SafetyLimits::default() };
    let found = open.check(trajectory).unwrap_err();
    assert!(matches!(found, Violation::SelfCollision { .. }), "{found}");
}

#[test]
fn motions_to_any_place_over_the_table_pass_at_the_default_speed() {
    let (panda, limits) = (ArmGeometry::panda(), SafetyLimits::default());
    let slow = JointLimits::panda().scaled(0.1, 0.07, 0.04).unwrap();
    for (x, y, z) in [(0.3, -0.3, 0.4), (0.3, 0.3, 0.2), (0.65, 0.2, 0.1), (0.5, 0.0, 0.05), (0.65, -0.3, 0.3)] {
        let mut base_from_tcp = panda.forward(&ready_pose());
        base_from_tcp.translation = nalgebra::Translation3::new(x, y, z);
        let solution = panda.inverse(&base_from_tcp, &ready_pose(), &IkOptions::default()).unwrap();
        let trajectory = Trajectory::point_to_point(&ready_pose(), &solution.q, &slow).unwrap();
        limits.check(trajectory).unwrap_or_else(|violation| panic!("({x}, {y}, {z}): {violation}"));
    }
}

#[test]
fn an_fr3_may_not_do_all_that_a_panda_may() {
    let to = |change: [f64; 7], scale| {
        let end = ready_pose() + JointVector::from(change);
        Trajectory::point_to_point(&ready_pose(), &end, &JointLimits::panda().scaled(scale, scale, 0.1).unwrap())
    };
    // Joint 6 from 1.571 to 0.5 rad: the range of an FR3 ends at 0.541, before which its velocity limit decreases; that
    // of a Panda ends at -0.018.
    let bent = to([0.0, 0.0, 0.0, 0.0, 0.0, -1.07, 0.0], 0.2).unwrap();
    SafetyLimits::default().check(bent.clone()).unwrap();
    let refused = SafetyLimits::fr3().check(bent).unwrap_err();
    assert!(matches!(refused, Violation::Joint { joint: 6, .. }), "{refused}");
    // 18 rad/s² in joint 7, where the limit is 20 for a Panda and 10 for an FR3.
    let hard = to([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5], 0.9).unwrap();
    SafetyLimits::default().check(hard.clone()).unwrap();
    let refused = SafetyLimits::fr3().check(hard).unwrap_err();
    assert!(matches!(refused, Violation::Joint { quantity: "acceleration", joint: 7, .. }), "{refused}");
    // Nearly to the end of an FR3's range of joint 1, slowly and fast.
    let near_the_end = |scale| to([2.74, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], scale).unwrap();
    SafetyLimits::fr3().check(near_the_end(0.1)).unwrap();
    let refused = SafetyLimits::fr3().check(near_the_end(0.6)).unwrap_err();
    assert!(matches!(refused, Violation::Joint { quantity: "velocity", joint: 1, max, .. } if max < 2.0), "{refused}");
}

/// The tolerance is a fraction of the limit, also near the end of a joint's range, where an FR3's limit is low.
#[test]
fn a_low_velocity_limit_has_a_low_tolerance() {
    let (limits, still) = (SafetyLimits::fr3(), JointVector::zeros());
    let robot = limits.robot.unwrap();
    let check = |q_1, dq_1| {
        let mut q = limits.geometry.ready;
        q[0] = q_1;
        let dq = JointVector::from([dq_1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        limits.check_joints(0.0, (&q, &dq, &still), &Derivatives::default())
    };
    // sqrt(12 * 0.0078) - 0.3 rad/s.
    let near_end = robot.q_max[0] - 0.0078;
    let max = robot.velocity_range(0, near_end)[1];
    assert!((max - 0.005941).abs() < 1e-6, "{max}");
    check(near_end, 1.0005 * max).unwrap();
    let refused = check(near_end, 1.1 * max).unwrap_err();
    assert!(matches!(refused, Violation::Joint { quantity: "velocity", joint: 1, .. }), "{refused}");
    // At the end the limit is 0: only rounding is allowed.
    check(robot.q_max[0], 1e-9).unwrap();
    assert!(check(robot.q_max[0], 1e-5).is_err());
    assert!(check(robot.q_min[0], -1e-5).is_err());
}

/// The limits of an arm's geometry are those that the robot applies to its client, except for a lower speed of the tcp.
#[test]
fn geometry_and_protocol_have_the_same_limits() {
    for (limits, velocity_m_s) in [(SafetyLimits::default(), 2.0), (SafetyLimits::fr3(), 3.0)] {
        let (joints, tcp, robot) = (&limits.joints, &limits.cartesian, limits.robot.unwrap());
        for (found, expected) in [
            (joints.position_min, robot.q_min),
            (joints.position_max, robot.q_max),
            (joints.velocity_max, robot.velocity),
            (joints.acceleration_max, robot.acceleration),
            (joints.jerk_max, robot.jerk),
            (joints.torque_max, robot.torque),
        ] {
            assert_eq!(found, JointVector::from(expected));
        }
        let (translation, rotation) = (robot.translation, robot.rotation);
        assert_eq!((tcp.velocity_m_s, translation.velocity), (1.7, velocity_m_s));
        assert_eq!((tcp.acceleration_m_s2, tcp.jerk_m_s3), (translation.acceleration, translation.jerk));
        assert_eq!(tcp.angular_velocity_rad_s, rotation.velocity);
        assert_eq!((tcp.angular_acceleration_rad_s2, tcp.angular_jerk_rad_s3), (rotation.acceleration, rotation.jerk));
    }
}
