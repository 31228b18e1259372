//! Cameras from rendered boards, compared with OpenCV's `calibrateCamera` on the same pictures.
//!
//! OpenCV's results are in tests/golden/opencv/calibration.json. They are made by `write_pictures` below and
//! calibrate.py in that folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::rendering::cameras::{CAMERAS, board, pictures, poses};
use crate::rendering::{Random, camera_from_board};
use nalgebra::Point2;
use sdg_calibration::{Advice, Calibration, CalibrationConfig, CalibrationError, SeenCorner, calibrate, find_board};
use sdg_geometry::PinholeCamera;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// Largest ratio of the reprojection error to OpenCV's, and largest relative error of the focal length.
const MAX_RMS_RATIO: f64 = 1.1;
const MAX_FOCAL_ERROR: f64 = 0.002;
/// Both optimisers use the same corners. Ours ends at a relative decrease of 1e-12, OpenCV's after 30 steps or at
/// 2.2e-16.
const MAX_RMS_DIFFERENCE: f64 = 1e-5;
const MAX_FOCAL_DIFFERENCE: f64 = 1e-4;

fn config(camera: &PinholeCamera) -> CalibrationConfig {
    CalibrationConfig { width: camera.width, height: camera.height, has_k3: false }
}

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/opencv")
}

fn seen(pictures: &[image::GrayImage]) -> Vec<Vec<SeenCorner>> {
    pictures.iter().map(|picture| find_board(picture, &board()).unwrap()).collect()
}

fn hash(pictures: &[image::GrayImage]) -> String {
    let mut hash = Sha256::new();
    pictures.iter().for_each(|picture| hash.update(picture.as_raw()));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Corners in a camera's pictures, with noise.
fn synthetic(camera: &PinholeCamera, sigma_px: f64, seed: u64) -> Vec<Vec<SeenCorner>> {
    let mut random = Random(seed);
    let noisy = |pose: nalgebra::Isometry3<f64>| {
        let corners = board().corners().map(|corner| {
            let pixel = camera.project(&(pose * board().corner(corner))).unwrap();
            let noise = nalgebra::Vector2::new(random.normal(), random.normal()) * sigma_px;
            SeenCorner { corner, pixel: pixel + noise }
        });
        corners.collect::<Vec<_>>()
    };
    poses(camera).into_iter().map(noisy).collect()
}

#[test]
fn cameras_are_found_as_exactly_as_opencv_finds_them() {
    let golden: Value = serde_json::from_slice(&fs::read(golden().join("calibration.json")).unwrap()).unwrap();
    for (name, camera) in CAMERAS {
        let pictures = pictures(&camera);
        let of_opencv = &golden["cameras"][name];
        assert_eq!(of_opencv["sha256"], hash(&pictures), "{name}: OpenCV saw other pictures; run {:?} again", golden);
        let number = |key: &str| of_opencv[key].as_f64().unwrap();
        let found = calibrate(&board(), &seen(&pictures), &config(&camera)).unwrap();
        let [fx, fy] = [found.camera.fx / camera.fx - 1.0, found.camera.fy / camera.fy - 1.0];
        println!(
            "{name}: RMS {:.4} px, OpenCV {:.4} px on its corners, {:.4} px on ours; fx off by {:.4} %, OpenCV by {:.4} %; centre off by \
             ({:.2}, {:.2}) px, sigma fx {:.3} px cx {:.3} px",
            found.rms_px,
            number("rms_px"),
            number("rms_px_on_our_corners"),
            100.0 * fx,
            100.0 * (number("fx") / camera.fx - 1.0),
            found.camera.cx - camera.cx,
            found.camera.cy - camera.cy,
            found.sigma[0],
            found.sigma[2],
        );
        assert!(found.rms_px <= MAX_RMS_RATIO * number("rms_px"));
        assert!(fx.abs() <= MAX_FOCAL_ERROR && fy.abs() <= MAX_FOCAL_ERROR);
        assert!((found.rms_px - number("rms_px_on_our_corners")).abs() < MAX_RMS_DIFFERENCE);
        assert!((found.camera.fx / number("fx_on_our_corners") - 1.0).abs() < MAX_FOCAL_DIFFERENCE);
        assert!(found.advice.is_empty(), "{:?}", found.advice);
    }
}

/// Writes the input of calibrate.py into Cargo's folder for temporary files.
#[test]
#[ignore = "writes the pictures that OpenCV's figures are made from"]
fn write_pictures() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("opencv");
    fs::create_dir_all(&folder).unwrap();
    let mut cameras = serde_json::Map::new();
    for (name, camera) in CAMERAS {
        let pictures = pictures(&camera);
        for (k, picture) in pictures.iter().enumerate() {
            picture.save(folder.join(format!("{name}_{k:02}.png"))).unwrap();
        }
        let corners = |view: &Vec<SeenCorner>| {
            let corners = view.iter().map(|seen| json!([seen.corner[0], seen.corner[1], seen.pixel.x, seen.pixel.y]));
            corners.collect::<Value>()
        };
        let views: Value = seen(&pictures).iter().map(corners).collect();
        cameras.insert(name.to_owned(), json!({"sha256": hash(&pictures), "corners": views}));
    }
    let board = json!({"columns": board().columns(), "rows": board().rows(), "square_m": board().square_m()});
    fs::write(folder.join("pictures.json"), json!({"board": board, "cameras": cameras}).to_string()).unwrap();
    println!("{}", folder.display());
}

#[test]
fn standard_errors_are_those_that_repetition_shows() {
    const SEEDS: u64 = 400;
    const SIGMA_PX: f64 = 0.1;
    /// The standard deviation of 400 normal numbers is itself uncertain by 3.5 %; this allows four times that.
    const MAX_RATIO: f64 = 1.14;
    let camera = CAMERAS[0].1;
    let found: Vec<Calibration> = (0..SEEDS)
        .map(|seed| calibrate(&board(), &synthetic(&camera, SIGMA_PX, 100 + seed), &config(&camera)).unwrap())
        .collect();
    let values = |of: &dyn Fn(&Calibration) -> f64| found.iter().map(of).collect::<Vec<_>>();
    let rms = |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
    let checks: [(&str, Vec<f64>, usize); 4] = [
        ("fx", values(&|c| c.camera.fx - camera.fx), 0),
        ("cx", values(&|c| c.camera.cx - camera.cx), 2),
        ("k1", values(&|c| c.camera.lens.k1 - camera.lens.k1), 4),
        ("p1", values(&|c| c.camera.lens.p1 - camera.lens.p1), 6),
    ];
    for (name, errors, k) in checks {
        let told = rms(&values(&|c| c.sigma[k]));
        println!("{name}: errors {:.5}, estimated {told:.5}", rms(&errors));
        assert!(
            (1.0 / MAX_RATIO..MAX_RATIO).contains(&(rms(&errors) / told)),
            "{name}: {:.5}, estimated {told:.5}",
            rms(&errors)
        );
    }
}

#[test]
fn forty_pictures_leave_the_noise_of_their_corners() {
    let camera = CAMERAS[1].1;
    let views: Vec<_> = (0..3).flat_map(|seed| synthetic(&camera, 0.1, seed)).take(40).collect();
    let start = Instant::now();
    let found = calibrate(&board(), &views, &config(&camera)).unwrap();
    println!("40 pictures: {:.3} s, RMS {:.3} px", start.elapsed().as_secs_f64(), found.rms_px);
    // Noise of 0.1 px in x and in y.
    assert!((found.rms_px / (0.1 * 2.0_f64.sqrt()) - 1.0).abs() < 0.05);
}

#[test]
fn a_bad_picture_is_named_and_left_out() {
    let camera = CAMERAS[0].1;
    let mut views = synthetic(&camera, 0.05, 3);
    // The corners of a bent board, as of a loose sheet: shifted by up to 6 pixels in its middle column.
    for seen in &mut views[4] {
        let x = f64::from(seen.corner[0]) / 4.5 - 1.0;
        seen.pixel += nalgebra::Vector2::new(3.0, 5.0) * (1.0 - x * x);
    }
    let found = calibrate(&board(), &views, &config(&camera)).unwrap();
    let left_out: Vec<usize> = (0..views.len()).filter(|k| found.pictures[*k].is_left_out).collect();
    assert_eq!(left_out, [4]);
    assert!(found.rms_px < 0.1 && found.pictures[4].rms_px > 0.5, "{}", found.rms_px);
    assert!((found.camera.fx / camera.fx - 1.0).abs() < MAX_FOCAL_ERROR);
    // One corner is shifted by 1.2 pixels.
    let mut views = synthetic(&camera, 0.05, 3);
    views[2][7].pixel += nalgebra::Vector2::new(1.2, 0.0);
    let found = calibrate(&board(), &views, &config(&camera)).unwrap();
    assert!((found.camera.fx / camera.fx - 1.0).abs() < MAX_FOCAL_ERROR && found.rms_px < 0.08, "{}", found.rms_px);
}

fn views_at(camera: &PinholeCamera, poses: &[([f64; 2], f64, [f64; 3])]) -> Vec<Vec<SeenCorner>> {
    let mut random = Random(4);
    let view = |(pixel, distance, tilts): &([f64; 2], f64, [f64; 3])| {
        let pose = camera_from_board(&board(), camera, *pixel, *distance, *tilts);
        let corners = board().corners().map(|corner| {
            let noise = nalgebra::Vector2::new(random.normal(), random.normal()) * 0.1;
            SeenCorner { corner, pixel: camera.project(&(pose * board().corner(corner))).unwrap() + noise }
        });
        corners.collect::<Vec<_>>()
    };
    poses.iter().map(view).collect()
}

#[test]
fn poses_all_alike_are_an_error_that_says_what_to_do() {
    let camera = CAMERAS[0].1;
    for tilt in [[0.0, 0.0], [0.2, 0.1]] {
        let poses: Vec<_> = (0..8)
            .map(|k| ([220.0 + 25.0 * f64::from(k), 240.0], 0.4 + 0.02 * f64::from(k), [tilt[0], tilt[1], 0.0]))
            .collect();
        let error = calibrate(&board(), &views_at(&camera, &poses), &config(&camera)).unwrap_err();
        println!("{error}");
        assert!(matches!(error, CalibrationError::PosesAlike { .. }), "{error}");
        assert!(error.to_string().contains("tilt the board by 20 to 40 degrees"));
    }
    let two = views_at(&camera, &[([300.0, 240.0], 0.4, [0.2, 0.0, 0.0]); 2]);
    assert!(matches!(
        calibrate(&board(), &two, &config(&camera)),
        Err(CalibrationError::TooFewPictures { found: 2, .. })
    ));
}

#[test]
fn what_the_pictures_lack_is_named() {
    let camera = CAMERAS[0].1;
    // The board is never in the lower right, and is tilted only sideways.
    let poses: Vec<_> = [[-0.3, 0.3], [0.0, 0.3], [0.3, -0.3], [0.1, 0.2], [-0.1, -0.3]]
        .iter()
        .map(|[_, tilt]| ([250.0, 180.0], 0.3, [0.0, *tilt, 0.05]))
        .collect();
    let found = calibrate(&board(), &views_at(&camera, &poses), &config(&camera)).unwrap();
    println!("{:?}", found.advice.iter().map(ToString::to_string).collect::<Vec<_>>());
    assert_eq!(found.advice[0], Advice::OneAxis { missing: "upwards and downwards" });
    assert!(found.advice.contains(&Advice::Empty { part: "in the lower right corner" }));
    assert!(found.advice.contains(&Advice::Few { found: 5 }));
    // The board is far from the camera.
    let far: Vec<_> =
        poses.iter().map(|(_, _, tilts)| (Point2::new(320.0, 240.0).coords.into(), 0.9, *tilts)).collect();
    let found = calibrate(&board(), &views_at(&camera, &far), &config(&camera));
    if let Ok(found) = found {
        assert!(found.advice.iter().any(|advice| matches!(advice, Advice::TooFar { .. })), "{:?}", found.advice);
    }
}
