//! A camera above a sheet on the table, with intrinsics and without.

use crate::rendering::cameras::WEBCAM;
use crate::rendering::{Exposure, Random, camera_from_board, render};
use nalgebra::{Isometry3, Vector2};
use sdg_calibration::{
    Board, CalibrationError, SeenCorner, find_board, focal_cost, focal_from_sheet, homography_rms_px, locate_sheet,
};
use sdg_geometry::{PinholeCamera, PlumbBob};

/// Largest error of the camera's position: the effect of corner errors of a twentieth of a pixel at 0.6 m, tilted.
const MAX_PLACE_ERROR_M: f64 = 0.0005;

fn board() -> Board {
    Board::new(9, 6, 0.025).unwrap()
}

fn corners(camera: &PinholeCamera, pose: &Isometry3<f64>, sigma_px: f64, random: &mut Random) -> Vec<SeenCorner> {
    let seen = board().corners().map(|corner| {
        let noise = Vector2::new(random.normal(), random.normal()) * sigma_px;
        SeenCorner { corner, pixel: camera.project(&(pose * board().corner(corner))).unwrap() + noise }
    });
    seen.collect()
}

#[test]
fn a_rendered_sheet_tells_where_the_camera_is() {
    for tilts in [[0.02, -0.01, 0.3], [0.25, 0.1, -0.8], [0.0, -0.4, 0.0]] {
        let pose = camera_from_board(&board(), &WEBCAM, [640.0, 400.0], 0.6, tilts);
        let picture = render(&board(), &WEBCAM, &pose, &Exposure::ORDINARY, &mut Random(9));
        let found = locate_sheet(&WEBCAM, &board(), &find_board(&picture, &board()).unwrap()).unwrap();
        let off = (found.sheet_from_camera.translation.vector - pose.inverse().translation.vector).norm();
        let turn = found.sheet_from_camera.rotation.angle_to(&pose.inverse().rotation).to_degrees();
        println!(
            "tilt {:.1} deg: off by {:.3} mm, {turn:.4} deg; RMS {:.3} px, sigma of height {:.3} mm, of tilt {:.4} deg",
            found.tilt_rad.to_degrees(),
            1000.0 * off,
            found.rms_px,
            1000.0 * found.sigma_height_m,
            found.sigma_tilt_rad.to_degrees()
        );
        assert!(off < MAX_PLACE_ERROR_M && turn < 0.05);
        assert!(found.sheet_from_camera.translation.z > 0.3, "the camera is above the sheet");
    }
}

#[test]
fn told_errors_are_those_that_repetition_shows() {
    const SEEDS: u64 = 400;
    /// The standard deviation of 400 numbers is uncertain by 3.5 %; this allows four times that.
    const MAX_RATIO: f64 = 1.14;
    let pose = camera_from_board(&board(), &WEBCAM, [640.0, 400.0], 0.6, [0.2, 0.1, 0.2]);
    let truth = pose.inverse();
    let (mut heights, mut tilts, mut told) = (0.0, 0.0, [0.0; 2]);
    for seed in 0..SEEDS {
        let found = locate_sheet(&WEBCAM, &board(), &corners(&WEBCAM, &pose, 0.2, &mut Random(seed))).unwrap();
        heights += (found.sheet_from_camera.translation.z - truth.translation.z).powi(2);
        let turn = (found.sheet_from_camera.rotation * truth.rotation.inverse()).scaled_axis();
        tilts += 0.5 * (turn.x * turn.x + turn.y * turn.y);
        told[0] += found.sigma_height_m.powi(2);
        told[1] += found.sigma_tilt_rad.powi(2);
    }
    for (name, errors, told) in [("height", heights, told[0]), ("tilt", tilts, told[1])] {
        let ratio = (errors / told).sqrt();
        println!("{name}: errors over estimated errors {ratio:.3}");
        assert!((1.0 / MAX_RATIO..MAX_RATIO).contains(&ratio), "{name}: {ratio}");
    }
}

/// A phone's camera, practically without distortion.
const PHONE: PinholeCamera =
    PinholeCamera { lens: PlumbBob::NONE, fx: 980.0, fy: 980.0, cx: 646.0, cy: 356.0, ..WEBCAM };

#[test]
fn a_tilted_sheet_tells_the_focal_length_and_one_from_above_does_not() {
    let estimate = |tilt: f64| {
        let pose = camera_from_board(&board(), &PHONE, [640.0, 360.0], 0.4, [tilt, 0.4 * tilt, 0.2]);
        focal_from_sheet((1280, 720), &board(), &corners(&PHONE, &pose, 0.1, &mut Random(2)))
    };
    let tilted = estimate(0.3).unwrap();
    println!("33 degrees: {tilted:?}");
    assert!((tilted.focal_px - PHONE.fx).abs() < 3.0 * tilted.sigma_px && tilted.relative_sigma() < 0.05, "{tilted:?}");
    let above = estimate(0.0);
    println!("0 degrees: {above:?}");
    assert!(above.is_none_or(|above| above.relative_sigma() > 0.1), "{above:?}");
}

#[test]
fn the_focal_length_costs_nothing_on_the_table_and_more_above_it() {
    // Let the camera be vertically above the table at height H = 0.5 m, and a point at height h, at the horizontal
    // distance d from the camera. The point is displaced by d h / (H - h), and H is proportional to the focal length.
    // For d = 0.2 m and h = 0.03 m this is 12.77 mm at H = 0.5 m and 11.54 mm at H = 0.55 m.
    let camera = PinholeCamera { fx: 1000.0, fy: 1000.0, cx: 640.0, cy: 360.0, ..PHONE };
    let pose = camera_from_board(&board(), &camera, [640.0, 360.0], 0.5, [0.0, 0.0, 0.0]);
    let corners = corners(&camera, &pose, 0.0, &mut Random(1));
    assert!(homography_rms_px(&board(), &corners).unwrap() < 1e-6);
    let table = focal_cost(&camera, &board(), &corners, 0.0, 0.1).unwrap();
    assert!(table.at_border_m < 1e-6, "{table:?}");
    let above = focal_cost(&camera, &board(), &corners, 0.03, 0.1).unwrap();
    // The picture's corner is at a distance of 0.367 m; 0.9 of the focal length gives the largest displacement.
    let distance = (0.32_f64.powi(2) + 0.18_f64.powi(2)).sqrt();
    let expected = distance * (0.03 / 0.45 - 0.03 / 0.5);
    assert!((above.at_border_m - expected).abs() < 1e-6, "{above:?}, expected {expected}");
    assert!(above.at_sheet_m < 1e-6, "{above:?}");
}

#[test]
fn a_tilt_that_another_focal_length_would_make_too_large_has_a_focal_cost() {
    // A tilt of 74°, 17° beside the optical axis: with a focal length longer by 10 % it would be 75.5°.
    let half_tangent = 37_f64.to_radians().tan();
    let pose = camera_from_board(&board(), &PHONE, [646.0, 656.0], 0.5, [half_tangent, 0.0, 0.0]);
    let corners = corners(&PHONE, &pose, 0.0, &mut Random(1));
    let longer = PinholeCamera { fx: 1.1 * PHONE.fx, fy: 1.1 * PHONE.fy, ..PHONE };
    let error = locate_sheet(&longer, &board(), &corners).unwrap_err();
    assert!(matches!(error, CalibrationError::Horizon { .. }), "{error}");
    let cost = focal_cost(&PHONE, &board(), &corners, 0.03, 0.1).unwrap();
    assert!(cost.at_sheet_m > 0.0 && cost.at_border_m >= cost.at_sheet_m, "{cost:?}");
}

#[test]
fn a_horizon_is_refused() {
    let pose = camera_from_board(&board(), &PHONE, [640.0, 360.0], 0.5, [0.8, 0.0, 0.0]);
    let error = locate_sheet(&PHONE, &board(), &corners(&PHONE, &pose, 0.05, &mut Random(1))).unwrap_err();
    assert!(matches!(error, CalibrationError::Horizon { tilt_deg, .. } if tilt_deg > 76.0), "{error}");
}
