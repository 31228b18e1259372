use super::*;
use crate::safety::WorkspaceBox;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use sdg_kinematics::{ArmGeometry, CartesianLimits, IkOptions, JointLimits, LineOptions, ready_pose};

const AT_M: [f64; 2] = [0.45, 0.10];
/// The finger tips extend 4 mm below the tcp, and 1 mm must remain: below this height the hand is lower than allowed.
const LOWEST_ALLOWED_M: f64 = 0.005;

fn limits() -> SafetyLimits {
    let workspace = WorkspaceBox { min_m: Vector3::new(0.2, -0.5, 0.002), max_m: Vector3::new(0.8, 0.5, 0.9) };
    SafetyLimits { workspace: Some(workspace), ..SafetyLimits::default() }
}

fn tcp(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::new(x, y, z), down)
}

fn at(x: f64, y: f64, z: f64) -> JointVector {
    ArmGeometry::panda().inverse(&tcp(x, y, z), &ready_pose(), &IkOptions::default()).unwrap().q
}

fn felt(lowest_m: f64) -> FeltBelow {
    FeltBelow::new(&Vector3::new(AT_M[0], AT_M[1], 0.03), lowest_m, 0.010)
}

fn line(start: &JointVector, to: &Isometry3<f64>) -> Trajectory {
    let path = ArmGeometry::panda().straight_path(start, to, &LineOptions::default()).unwrap();
    let slow = CartesianLimits::panda().scaled(0.1, 0.1, 0.05).unwrap();
    Trajectory::along_path(path, &JointLimits::panda(), &slow).unwrap()
}

/// Whether a straight motion from one tcp position to another is allowed after the descent `felt`.
fn check(felt: Option<&FeltBelow>, from: [f64; 3], to: [f64; 3]) -> Result<(), Violation> {
    check_within(&limits(), felt, from, to)
}

fn check_within(
    limits: &SafetyLimits,
    felt: Option<&FeltBelow>,
    from: [f64; 3],
    to: [f64; 3],
) -> Result<(), Violation> {
    let start = at(from[0], from[1], from[2]);
    let motion = line(&start, &tcp(to[0], to[1], to[2]));
    limits.starting_at(&start, felt).check(motion).map(|_| ())
}

#[test]
fn the_hand_goes_straight_up_from_where_it_felt_something() {
    let [x, y] = AT_M;
    for lowest_m in [LOWEST_ALLOWED_M - 0.001, LOWEST_ALLOWED_M - 0.009] {
        let felt = felt(lowest_m);
        check(Some(&felt), [x, y, lowest_m], [x, y, 0.10]).unwrap();
        // Once the hand is as high as allowed, it may move anywhere.
        check(Some(&felt), [x, y, LOWEST_ALLOWED_M + 0.001], [x + 0.1, y, 0.10]).unwrap();
        let error = check(None, [x, y, lowest_m], [x, y, 0.10]).unwrap_err();
        assert!(matches!(error, Violation::Table { .. } | Violation::Workspace { .. }), "{error}");
    }
}

#[test]
fn neither_sideways_nor_down_nor_from_elsewhere_nor_deeper_than_was_felt() {
    let ([x, y], lowest_m) = (AT_M, LOWEST_ALLOWED_M - 0.004);
    let felt = felt(lowest_m);
    for to in [[x + 0.10, y, lowest_m], [x + 0.10, y, 0.010], [x, y, lowest_m - 0.002]] {
        let error = check(Some(&felt), [x, y, lowest_m], to).unwrap_err();
        assert!(matches!(error, Violation::Leaving { .. }), "{to:?}: {error}");
    }
    // 7 mm beside the descent, and 3 mm deeper than the contact.
    for from in [[x + 0.007, y, lowest_m], [x, y, lowest_m - 0.003]] {
        let error = check(Some(&felt), from, [from[0], from[1], 0.10]).unwrap_err();
        assert!(matches!(error, Violation::Table { .. } | Violation::Workspace { .. }), "{from:?}: {error}");
    }
    // A contact deeper than was allowed for the descent.
    let deep = FeltBelow::new(&Vector3::new(x, y, 0.03), LOWEST_ALLOWED_M - 0.020, 0.010);
    assert!(check(Some(&deep), [x, y, LOWEST_ALLOWED_M - 0.015], [x, y, 0.10]).is_err());
    // The tolerance of the ascent applies to that limit too: 0.3 mm deeper is allowed, 0.7 mm is not.
    let from = |deeper_m: f64| [x, y, LOWEST_ALLOWED_M - 0.010 - deeper_m];
    check(Some(&deep), from(0.0003), [x, y, 0.10]).unwrap();
    assert!(check(Some(&deep), from(0.0007), [x, y, 0.10]).is_err());
}

#[test]
fn a_hand_as_high_as_allowed_need_no_longer_go_straight_up() {
    let ([x, y], lowest_m) = (AT_M, LOWEST_ALLOWED_M - 0.004);
    // 0.8 mm sideways on the 4 mm up to the allowed height, and 20 mm on the whole way.
    check(Some(&felt(lowest_m)), [x, y, lowest_m], [x + 0.02, y, 0.10]).unwrap();
    // 1.2 mm sideways on these 4 mm.
    assert!(check(Some(&felt(lowest_m)), [x, y, lowest_m], [x + 0.03, y, 0.10]).is_err());
}

#[test]
fn a_hand_below_only_one_of_table_and_workspace_goes_straight_up_too() {
    let [x, y] = AT_M;
    let mut high_floor = limits();
    high_floor.workspace.as_mut().unwrap().min_m.z = LOWEST_ALLOWED_M + 0.010;
    // Below the distance from the table and above the workspace's floor; then the reverse.
    for (limits, lowest_m) in [(limits(), LOWEST_ALLOWED_M - 0.001), (high_floor, LOWEST_ALLOWED_M + 0.004)] {
        let felt = felt(lowest_m);
        let to = |to: [f64; 3]| check_within(&limits, Some(&felt), [x, y, lowest_m], to);
        to([x, y, 0.10]).unwrap();
        match to([x + 0.10, y, lowest_m]).unwrap_err() {
            Violation::Leaving { beside_mm, down_mm, .. } => {
                assert!((1.0..1.2).contains(&beside_mm) && (0.0..0.5).contains(&down_mm), "{beside_mm} {down_mm}");
            }
            error => panic!("{error}"),
        }
        match to([x, y, lowest_m - 0.002]).unwrap_err() {
            Violation::Leaving { beside_mm, down_mm, .. } => {
                assert!(beside_mm < 1.0 && (0.5..0.6).contains(&down_mm), "{beside_mm} {down_mm}");
            }
            error => panic!("{error}"),
        }
    }
}

#[test]
fn a_motion_down_to_where_something_was_felt_is_refused() {
    let ([x, y], lowest_m) = (AT_M, LOWEST_ALLOWED_M - 0.004);
    let (start, end) = (at(x, y, lowest_m), at(x, y, lowest_m));
    let panda = ArmGeometry::panda();
    let up = panda.inverse(&tcp(x, y, 0.05), &start, &IkOptions::default()).unwrap().q;
    let slow = JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap();
    // A motion down from above starts within the limits, so that nothing is lowered for it.
    let down = Trajectory::point_to_point(&up, &end, &slow).unwrap();
    let error = limits().starting_at(&up, Some(&felt(lowest_m))).check(down).unwrap_err();
    assert!(matches!(error, Violation::Table { .. } | Violation::Workspace { .. }), "{error}");
}
