//! The errors for wrong robot poses and for boards of another size.

use crate::hand_eye::{CAMERA, EXACT_ROBOT, NOISY_ROBOT, NUM_POSES, Noise, board, views};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use sdg_calibration::{Board, CalibrationError, HandEye, HandEyeView, calibrate_hand_eye};
use sdg_geometry::Mount;

const MOUNTS: [Mount; 2] = [Mount::Hand, Mount::Base];
/// Largest relative error of the estimated scale with [`NOISY_ROBOT`]; the scale's standard error is 0.001.
const MAX_SCALE_ERROR: f64 = 0.004;

fn changed(views: &[HandEyeView], change: &dyn Fn(&Isometry3<f64>) -> Isometry3<f64>) -> Vec<HandEyeView> {
    let of_view = |view: &HandEyeView| HandEyeView {
        base_from_flange: change(&view.base_from_flange),
        corners: view.corners.clone(),
    };
    views.iter().map(of_view).collect()
}

fn solve(mount: Mount, views: &[HandEyeView]) -> Result<HandEye, CalibrationError> {
    calibrate_hand_eye(&CAMERA, &board(), mount, views)
}

/// Calibrates with a given size of the board that is `told` times the true one.
fn solve_told(mount: Mount, views: &[HandEyeView], told: f64) -> Result<HandEye, CalibrationError> {
    let board = Board::new(9, 6, board().square_m() * told).unwrap();
    calibrate_hand_eye(&CAMERA, &board, mount, views)
}

fn refusal(mount: Mount, views: &[HandEyeView]) -> String {
    let text = solve(mount, views).unwrap_err().to_string();
    println!("{mount:?}: {text}");
    text
}

/// The rotation from angles about x, y and z, whose factors are multiplied in the order `order`.
fn product(order: [usize; 3], about: [f64; 3]) -> UnitQuaternion<f64> {
    order.iter().fold(UnitQuaternion::identity(), |rotation, axis| {
        let mut vector = Vector3::zeros();
        vector[*axis] = about[*axis];
        rotation * UnitQuaternion::from_scaled_axis(vector)
    })
}

/// Angles about x, y and z as robots report them: Rz·Ry·Rx.
fn roll_pitch_yaw(pose: &Isometry3<f64>) -> [f64; 3] {
    pose.rotation.euler_angles().into()
}

fn with_rotation(pose: &Isometry3<f64>, rotation: UnitQuaternion<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(pose.translation, rotation)
}

#[test]
fn a_board_of_another_size_is_told_by_the_robots_metres() {
    for mount in MOUNTS {
        for (seed, told) in [(21, 0.96), (22, 0.985), (23, 1.012), (24, 1.04)] {
            let error = solve_told(mount, &views(mount, seed, &NOISY_ROBOT), told).unwrap_err();
            println!("{mount:?} told {told}: {error}");
            let CalibrationError::OtherBoardScale { told_m, scale, sigma, .. } = error else { panic!("{error}") };
            assert!((told * scale - 1.0).abs() < MAX_SCALE_ERROR.min(6.0 * sigma), "{scale} ± {sigma}");
            assert!((told_m - 0.025 * told).abs() < 1e-12);
        }
    }
    let error = solve_told(Mount::Hand, &views(Mount::Hand, 22, &EXACT_ROBOT), 1.0 / 0.985).unwrap_err().to_string();
    assert!(error.contains("98.5 %") && error.contains("100 mm line"), "{error}");
}

#[test]
fn a_board_of_the_told_size_is_not_blamed_where_pictures_are_few() {
    for mount in MOUNTS {
        for seed in 0..40 {
            let views = views(mount, 500 + seed, &NOISY_ROBOT);
            let num = 4 + seed as usize % 4;
            assert!(solve(mount, &views[..num]).is_ok(), "{mount:?}, {num} pictures, {seed}");
        }
    }
    // A robot whose errors have another ratio than the assumed one.
    let turned_only = Noise { corner_px: 0.3, robot_m: 0.0, robot_deg: 0.1 };
    for seed in 0..30 {
        let views = views(Mount::Hand, 7000 + seed, &turned_only);
        assert!(solve(Mount::Hand, &views[..6]).is_ok(), "{seed}");
    }
    // A difference of up to 0.3 percent is the reading error of a ruler.
    assert!(solve_told(Mount::Hand, &views(Mount::Hand, 3, &EXACT_ROBOT), 1.002).is_ok());
}

#[test]
fn rotations_that_are_transposed_or_composed_in_another_order_are_named() {
    const FORMULAS: [([usize; 3], &str); 3] =
        [([0, 1, 2], "Rx(a)·Ry(b)·Rz(c)"), ([1, 0, 2], "Ry(a)·Rx(b)·Rz(c)"), ([2, 0, 1], "Rz(a)·Rx(b)·Ry(c)")];
    for mount in MOUNTS {
        let views = views(mount, 77, &NOISY_ROBOT);
        for (order, composed) in FORMULAS {
            let text = refusal(mount, &changed(&views, &|p| with_rotation(p, product(order, roll_pitch_yaw(p)))));
            let meant = match order {
                [0, 1, 2] => "Rz(c)·Ry(b)·Rx(a)",
                [1, 0, 2] => "Rz(c)·Ry(a)·Rx(b)",
                _ => "Rz(a)·Ry(c)·Rx(b)",
            };
            assert!(text.contains(&format!("composed as {composed} from angles meant for {meant}")), "{text}");
        }
        let of_vector = |p: &Isometry3<f64>| with_rotation(p, product([2, 1, 0], p.rotation.scaled_axis().into()));
        assert!(refusal(mount, &changed(&views, &of_vector)).contains("meant for the rotation vector (c, b, a)"));
        let tiny = |p: &Isometry3<f64>| with_rotation(p, product([2, 1, 0], roll_pitch_yaw(p).map(f64::to_radians)));
        assert!(refusal(mount, &changed(&views, &tiny)).contains("radians that were read as degrees"));
        let transposed = |p: &Isometry3<f64>| with_rotation(p, p.rotation.inverse());
        assert!(refusal(mount, &changed(&views, &transposed)).contains("rotations seem to be transposed (flange"));
        let shifts = |p: &Isometry3<f64>| Isometry3::from_parts(p.inverse().translation, p.rotation);
        assert!(
            refusal(mount, &changed(&views, &shifts)).contains("translations seem to be those of flange_from_base")
        );
    }
}

#[test]
fn no_reading_is_proposed_that_leaves_many_pixels() {
    let views = views(Mount::Hand, 5, &EXACT_ROBOT);
    // Degrees that were read as radians cannot be recovered, and a mirrored axis is not among the readings.
    let wound = |p: &Isometry3<f64>| with_rotation(p, product([2, 1, 0], roll_pitch_yaw(p).map(f64::to_degrees)));
    let text = refusal(Mount::Hand, &changed(&views, &wound));
    assert!(text.contains("rotates by other angles than the board") && !text.contains("with this reading"), "{text}");
    let mirrored = |p: &Isometry3<f64>| {
        let [x, y, z]: [f64; 3] = p.translation.vector.into();
        Isometry3::from_parts(Vector3::new(x, -y, z).into(), p.rotation)
    };
    let text = refusal(Mount::Hand, &changed(&views, &mirrored));
    assert!(text.contains("each picture is listed with its own pose") && !text.contains("with this reading"), "{text}");
}

#[test]
fn a_wrong_pose_and_two_exchanged_ones_are_named() {
    let wrong = |mount, views: &[HandEyeView]| {
        let error = solve(mount, views).unwrap_err();
        println!("{mount:?}: {error}");
        let CalibrationError::WrongPoses { pictures, are_exchanged, .. } = &error else { panic!("{error}") };
        (pictures.clone(), *are_exchanged, error.with_picture_names(|k| format!("{k:02}.png")).to_string())
    };
    for mount in MOUNTS {
        for seed in 0..3 {
            let good = views(mount, 40 + seed, &NOISY_ROBOT);
            let k = (5 * seed as usize + 2) % NUM_POSES;
            let mut views = good.clone();
            views[k].base_from_flange.translation.z += 0.06;
            let (pictures, are_exchanged, text) = wrong(mount, &views);
            assert!(
                pictures == [k]
                    && !are_exchanged
                    && text.contains(&format!("the pose of {k:02}.png seems to be wrong")),
                "{text}"
            );
            let mut views = good.clone();
            views[k].base_from_flange = good[(k + 4) % NUM_POSES].base_from_flange;
            assert_eq!(wrong(mount, &views).0, [k]);
            // Two poses are wrong.
            views[(k + 7) % NUM_POSES].base_from_flange = good[(k + 9) % NUM_POSES].base_from_flange;
            let mut both = vec![k, (k + 7) % NUM_POSES];
            both.sort_unstable();
            assert_eq!(wrong(mount, &views).0, both);
            let mut views = good.clone();
            let other = (k + 1) % NUM_POSES;
            views[k].base_from_flange = good[other].base_from_flange;
            views[other].base_from_flange = good[k].base_from_flange;
            let (pictures, are_exchanged, text) = wrong(mount, &views);
            assert!(are_exchanged && pictures == [k.min(other), k.max(other)], "{text}");
            assert!(text.contains("seem to be exchanged"), "{text}");
        }
    }
}
