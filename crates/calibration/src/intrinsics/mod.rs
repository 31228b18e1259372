//! Estimates a camera's focal length, centre and lens from pictures of the board.
//!
//! ```text
//! corners ─ homographies ─ focal length in closed form ─ poses ─ Levenberg–Marquardt over all parameters
//!         ─ pictures that contradict the others left out one by one ─ errors, coverage
//! ```
//! The lens has k1, k2, p1, p2, and k3 if requested: with fewer than about twenty pictures, noise determines k3.
//!
//! # Source
//! Zhang, A flexible new technique for camera calibration, 2000. The closed form has the principal point at the centre
//! of the picture.

mod bundle;
mod coverage;

use nalgebra::{Isometry3, Matrix3, Vector3};
use sdg_geometry::{PinholeCamera, PlumbBob, upper_median};

use self::bundle::Bundle;
pub use self::coverage::Advice;
use crate::board::Board;
use crate::detection::SeenCorner;
use crate::error::CalibrationError;
use crate::homography;
use crate::least_squares::{Minimum, minimise};
use crate::pose::{from_homography, places};
use crate::projection::NUM_INTRINSICS;

/// The size of the pictures, and the parameters to estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationConfig {
    /// Width of the pictures, in pixels.
    pub width: u32,
    /// Height of the pictures, in pixels.
    pub height: u32,
    /// Whether k3 of the lens is estimated.
    pub has_k3: bool,
}

/// A camera and the accuracy of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Focal length, centre and lens.
    pub camera: PinholeCamera,
    /// Standard errors of fx, fy, cx, cy (pixels), k1, k2, p1, p2, k3, from the normal matrix and the residuals. They
    /// include noise of the corners, but not a board that is not flat.
    pub sigma: [f64; NUM_INTRINSICS],
    /// Root of the mean squared distance between corners and their projections, in pixels, over the used pictures.
    pub rms_px: f64,
    /// The result for each picture, in the given order.
    pub pictures: Vec<PictureFit>,
    /// Deficiencies of the pictures, the most useful to correct first.
    pub advice: Vec<Advice>,
}

impl Calibration {
    /// Names of the intrinsics, in the order of [`Self::sigma`].
    pub const NAMES: [&str; NUM_INTRINSICS] = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];

    /// The intrinsics in the order of [`Self::NAMES`]; pixels with the first centre at (0, 0), as in a camera file.
    pub fn values(&self) -> [f64; NUM_INTRINSICS] {
        let camera = self.camera;
        let [k1, k2, p1, p2, k3] = camera.lens.to_array();
        [camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5, k1, k2, p1, p2, k3]
    }
}

/// The result for one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureFit {
    /// RMS error of the corners; for an excluded picture, with the camera estimated from the others.
    pub rms_px: f64,
    /// Pose of the board in the camera's frame.
    pub camera_from_board: Isometry3<f64>,
    /// Whether the picture was excluded because it disagrees with the others.
    pub is_left_out: bool,
}

/// Minimum number of pictures: three give the closed form six equations, more than it needs.
pub const MIN_PICTURES: usize = 3;
/// Residual, in pixels, above which the weight decreases while pictures are compared: a few times the error of corners.
const ROBUST_PX: f64 = 1.0;
/// A picture is excluded if its RMS is above this many times the median and above [`MAX_RMS_PX`].
const MAX_RMS_RATIO: f64 = 3.0;
const MAX_RMS_PX: f64 = 0.5;
/// Corners beyond this many times the RMS are excluded at the end.
const MAX_CORNER_RATIO: f64 = 6.0;
/// Largest relative standard error of the focal length in a valid calibration.
const MAX_FOCAL_SIGMA: f64 = 0.03;
/// Assumed minimum error of corners, in pixels: the residuals of few corners may be smaller by chance.
const MIN_CORNER_SIGMA_PX: f64 = 0.02;
/// Minimum angle between the board's normals for the closed form, in degrees.
const MIN_TILT_RANGE_DEG: f64 = 6.0;

/// Estimates the camera from the corners in all pictures.
///
/// # Units and frames
/// Pixels, the first centre at (0.5, 0.5).
///
/// # Errors
/// [`CalibrationError::TooFewPictures`], [`CalibrationError::PosesAlike`], [`CalibrationError::NoPose`].
pub fn calibrate(
    board: &Board,
    pictures: &[Vec<SeenCorner>],
    config: &CalibrationConfig,
) -> Result<Calibration, CalibrationError> {
    if pictures.len() < MIN_PICTURES {
        return Err(too_few(pictures.len(), ""));
    }
    let all: Vec<usize> = (0..pictures.len()).collect();
    let (mut used, mut minimum) = (all.clone(), first_fit(board, pictures, &all, config)?);
    // One by one, because a bad picture increases the errors of others.
    while let Some(worst) = disagreeing(&minimum.at.rms_of_pictures()) {
        used.remove(worst);
        if used.len() < MIN_PICTURES {
            return Err(too_few(used.len(), ": the others contradict each other"));
        }
        minimum = first_fit(board, pictures, &used, config)?;
    }
    let kept = minimum.at.clone().without_outliers(MAX_CORNER_RATIO);
    let minimum = minimise(Bundle { robust_px: f64::INFINITY, ..kept }).ok_or(CalibrationError::NoPose)?;
    let bundle = &minimum.at;
    let sigma = sigma_of(&minimum)?;
    check_tilts(bundle, sigma[0] / bundle.camera.fx)?;
    let fits = fits(board, pictures, &used, bundle)?;
    let advice = coverage::advice(bundle, &used);
    Ok(Calibration { camera: bundle.camera, sigma, rms_px: bundle.rms_px(), pictures: fits, advice })
}

fn too_few(found: usize, hint: &'static str) -> CalibrationError {
    CalibrationError::TooFewPictures { least: MIN_PICTURES, found, hint }
}

/// The better of two minima: one from the closed form's focal length, the other from the picture's longer side as the
/// focal length.
fn first_fit<'a>(
    board: &Board,
    pictures: &'a [Vec<SeenCorner>],
    used: &[usize],
    config: &CalibrationConfig,
) -> Result<Minimum<Bundle<'a>, NUM_INTRINSICS>, CalibrationError> {
    let homographies: Option<Vec<_>> = used.iter().map(|k| homography::fit(&places(board, &pictures[*k]))).collect();
    let homographies = homographies.ok_or(CalibrationError::NoPose)?;
    let (width, height) = (f64::from(config.width), f64::from(config.height));
    let [cx, cy] = [0.5 * width, 0.5 * height];
    let longer = width.max(height);
    let closed = focal_length(&homographies, cx, cy).filter(|f| (0.2 * longer..10.0 * longer).contains(f));
    let minima = closed.into_iter().chain([longer]).filter_map(|focal| {
        let camera = PinholeCamera {
            width: config.width,
            height: config.height,
            fx: focal,
            fy: focal,
            cx,
            cy,
            lens: PlumbBob::NONE,
        };
        let undone = Matrix3::new(1.0 / focal, 0.0, -cx / focal, 0.0, 1.0 / focal, -cy / focal, 0.0, 0.0, 1.0);
        let poses: Option<Vec<_>> = homographies.iter().map(|h| from_homography(&(undone * h))).collect();
        let views = used.iter().map(|k| pictures[*k].iter().collect()).collect();
        minimise(Bundle { board: *board, views, camera, poses: poses?, robust_px: ROBUST_PX, has_k3: config.has_k3 })
    });
    minima.min_by(|a, b| a.cost.total_cmp(&b.cost)).ok_or(CalibrationError::NoPose)
}

/// The focal length of square pixels with the given centre, by least squares over all homographies; `None` if its
/// square would be negative.
///
/// With `h` the columns of a homography, `ω = diag(1/f², 1/f², 1)`: `h1ᵀ ω h2 = 0` and `h1ᵀ ω h1 = h2ᵀ ω h2`.
pub(crate) fn focal_length(homographies: &[Matrix3<f64>], cx: f64, cy: f64) -> Option<f64> {
    let (mut above, mut below) = (0.0, 0.0);
    for homography in homographies {
        let [a, b] = [0, 1].map(|k| {
            let h = homography.column(k);
            Vector3::new(h[0] - cx * h[2], h[1] - cy * h[2], h[2])
        });
        // The scale gives small and large boards equal weight.
        let scale = 1.0 / (a.norm() * b.norm());
        let planar = |a: &Vector3<f64>, b: &Vector3<f64>| a.x * b.x + a.y * b.y;
        let equations =
            [(planar(&a, &b), a.z * b.z), (0.5 * (planar(&a, &a) - planar(&b, &b)), 0.5 * (a.z * a.z - b.z * b.z))];
        for (p, q) in equations {
            above += scale * scale * p * p;
            below -= scale * scale * p * q;
        }
    }
    let squared = above / below;
    (squared.is_finite() && squared > 0.0).then(|| squared.sqrt())
}

/// The index of the picture that disagrees most with the others, if any.
fn disagreeing(rms: &[f64]) -> Option<usize> {
    let median = upper_median(rms.iter().copied())?;
    let worst = (0..rms.len()).max_by(|a, b| rms[*a].total_cmp(&rms[*b]))?;
    (rms[worst] > MAX_RMS_PX && rms[worst] > MAX_RMS_RATIO * median).then_some(worst)
}

fn sigma_of(minimum: &Minimum<Bundle<'_>, NUM_INTRINSICS>) -> Result<[f64; NUM_INTRINSICS], CalibrationError> {
    let bundle = &minimum.at;
    let parameters = NUM_INTRINSICS + 6 * bundle.views.len() - usize::from(!bundle.has_k3);
    let freedom = (2 * bundle.num_corners()).saturating_sub(parameters).max(1);
    let variance = (minimum.cost / freedom as f64).max(MIN_CORNER_SIGMA_PX * MIN_CORNER_SIGMA_PX);
    let Some(covariance) = minimum.information.cholesky().map(|cholesky| cholesky.inverse() * variance) else {
        return Err(alike(bundle, String::new()));
    };
    let mut sigma = [0.0; NUM_INTRINSICS];
    for (k, sigma) in sigma.iter_mut().enumerate() {
        *sigma = covariance[(k, k)].max(0.0).sqrt();
    }
    if !bundle.has_k3 {
        sigma[NUM_INTRINSICS - 1] = 0.0;
    }
    Ok(sigma)
}

fn check_tilts(bundle: &Bundle<'_>, focal_sigma: f64) -> Result<(), CalibrationError> {
    let is_known = focal_sigma < MAX_FOCAL_SIGMA;
    if is_known && bundle.tilt_range_deg() >= MIN_TILT_RANGE_DEG {
        return Ok(());
    }
    Err(alike(
        bundle,
        if is_known { String::new() } else { format!(" (error {:.0} %)", (100.0 * focal_sigma).min(999.0)) },
    ))
}

fn alike(bundle: &Bundle<'_>, hint: String) -> CalibrationError {
    let range = bundle.tilt_range_deg();
    CalibrationError::PosesAlike { found: format!("tilts that differ by {range:.0} degrees at most"), hint }
}

/// The result for every picture with the estimated camera, including the excluded pictures.
fn fits(
    board: &Board,
    pictures: &[Vec<SeenCorner>],
    used: &[usize],
    bundle: &Bundle<'_>,
) -> Result<Vec<PictureFit>, CalibrationError> {
    let rms = bundle.rms_of_pictures();
    let fits = pictures.iter().enumerate().map(|(k, corners)| match used.iter().position(|used| *used == k) {
        Some(at) => Ok(PictureFit { rms_px: rms[at], camera_from_board: bundle.poses[at], is_left_out: false }),
        None => {
            let pose = crate::pose::board_pose(&bundle.camera, board, corners).ok_or(CalibrationError::NoPose)?;
            Ok(PictureFit { rms_px: pose.rms_px, camera_from_board: pose.camera_from_board, is_left_out: true })
        }
    });
    fits.collect()
}
