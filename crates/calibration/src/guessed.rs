//! An uncalibrated camera above a sheet.

use sdg_geometry::{PinholeCamera, PlumbBob};

use crate::board::Board;
use crate::camera_file::CalibratedCamera;
use crate::detection::SeenCorner;
use crate::table::{focal_from_sheet, homography_rms_px};

/// Largest relative error of a focal length from the sheet's perspective.
const MAX_FOCAL_SIGMA: f64 = 0.1;
/// Assumed angle of view along the picture's longer side, in degrees: typical of webcams and phones.
pub const ASSUMED_VIEW_DEG: f64 = 60.0;
/// Name of a camera that was not calibrated.
pub const UNCALIBRATED: &str = "uncalibrated";
/// Largest reprojection error that a lens without distortion explains; a larger one is due to distortion.
const MAX_STRAIGHT_PX: f64 = 1.0;

/// The source of the focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocalSource {
    /// The camera file.
    File,
    /// A value given by the user.
    Given,
    /// The sheet's perspective; the value is the relative error.
    Perspective(f64),
    /// The assumed angle of view.
    Guess,
}

impl FocalSource {
    /// The name in `--json`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Given => "given",
            Self::Perspective(_) => "perspective",
            Self::Guess => "guess",
        }
    }
}

/// A camera without a file: the optical axis at the picture's centre, no distortion, and a focal length from the best
/// available source; `None` if that focal length is impossible.
pub fn guess_camera(
    size: (u32, u32),
    board: &Board,
    corners: &[SeenCorner],
    focal_px: Option<f64>,
) -> Option<(CalibratedCamera, FocalSource)> {
    let (width, height) = size;
    let estimate = focal_from_sheet(size, board, corners).filter(|found| found.relative_sigma() < MAX_FOCAL_SIGMA);
    let (focal, source) = match (focal_px, estimate) {
        (Some(focal), _) => (focal, FocalSource::Given),
        (None, Some(found)) => (found.focal_px, FocalSource::Perspective(found.relative_sigma())),
        (None, None) => {
            let half = 0.5 * f64::from(width.max(height));
            (half / (0.5 * ASSUMED_VIEW_DEG).to_radians().tan(), FocalSource::Guess)
        }
    };
    let [cx, cy] = [width, height].map(|side| 0.5 * f64::from(side));
    let intrinsics = PinholeCamera { width, height, fx: focal, fy: focal, cx, cy, lens: PlumbBob::NONE };
    let intrinsics = intrinsics.checked().ok()?;
    let camera = CalibratedCamera { name: UNCALIBRATED.to_owned(), intrinsics, table: None, flange_from_camera: None };
    Some((camera, source))
}

/// RMS distortion of the sheet's lines by the lens, in pixels; `None` if a lens without distortion explains the
/// corners.
pub fn bent_px(board: &Board, corners: &[SeenCorner]) -> Option<f64> {
    homography_rms_px(board, corners).filter(|rms| *rms > MAX_STRAIGHT_PX)
}
