//! A camera that nobody calibrated, over a sheet.

use sdg_geometry::{PinholeCamera, PlumbBob};

use crate::board::Board;
use crate::camera_file::CalibratedCamera;
use crate::detection::SeenCorner;
use crate::table::{focal_from_sheet, homography_rms_px};

/// A focal length taken from the sheet's perspective must be known to this share.
const MAX_FOCAL_SIGMA: f64 = 0.1;
/// Pictures of webcams and phones are about so wide.
pub const ASSUMED_VIEW_DEG: f64 = 60.0;
/// A straight lens explains corners to this; more is the lens's distortion.
const MAX_STRAIGHT_PX: f64 = 1.0;

/// Where the focal length is from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocalSource {
    /// The camera's file.
    File,
    /// The user.
    Given,
    /// The sheet's perspective; its error as a share.
    Perspective(f64),
    /// A usual angle of view.
    Guess,
}

impl FocalSource {
    /// As `--json` calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Given => "given",
            Self::Perspective(_) => "perspective",
            Self::Guess => "guess",
        }
    }
}

/// A camera without file: its axis in the middle, a straight lens, and a focal length from wherever there is one; `None` for one
/// that no camera has.
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
    let camera =
        CalibratedCamera { name: "uncalibrated".to_owned(), intrinsics, table: None, flange_from_camera: None };
    Some((camera, source))
}

/// How far the lens bends the sheet's lines, in pixels RMS; `None` where a straight lens explains the corners.
pub fn bent_px(board: &Board, corners: &[SeenCorner]) -> Option<f64> {
    homography_rms_px(board, corners).filter(|rms| *rms > MAX_STRAIGHT_PX)
}
