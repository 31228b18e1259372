//! The focal length of an uncalibrated camera from one picture of the sheet, and the effect of its error.
//!
//! Assumptions: square pixels, no lens distortion, and an optical axis near the centre of the picture. A sheet seen
//! vertically from above has the same picture at every focal length (twice the focal length at twice the distance), so
//! the accuracy of the focal length increases with the tilt.

use nalgebra::{Isometry3, Matrix6, Point2, SMatrix, SVector, Vector6};
use sdg_geometry::{PinholeCamera, PlumbBob, PosedCamera};

use super::sheet_pose::locate_sheet;
use crate::board::Board;
use crate::detection::SeenCorner;
use crate::error::CalibrationError;
use crate::homography;
use crate::intrinsics::focal_length;
use crate::least_squares::{Block, Problem, minimise};
use crate::pose::{board_pose, places};
use crate::projection::{by_twist, motion, off, project};

/// A focal length and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocalEstimate {
    /// The focal length in pixels, the same for both axes.
    pub focal_px: f64,
    /// Standard error in pixels, from the corners' residuals and an optical axis slightly away from the centre.
    pub sigma_px: f64,
}

impl FocalEstimate {
    /// The standard error relative to the focal length.
    pub fn relative_sigma(&self) -> f64 {
        self.sigma_px / self.focal_px
    }
}

/// Standard deviation of the optical axis from the picture's centre, relative to the longer side: typical of phones and
/// webcams.
const CENTER_SIGMA: f64 = 0.02;
/// Assumed minimum error of corners, in pixels.
const MIN_CORNER_SIGMA_PX: f64 = 0.05;
/// Range of focal lengths of cameras, in multiples of the picture's longer side.
const FOCALS: [f64; 2] = [0.3, 10.0];
/// Initial values of the search besides the closed form, in multiples of the longer side.
const STARTS: [f64; 2] = [0.8, 1.5];

/// A camera with its axis at the centre.
fn centered((width, height): (u32, u32), focal_px: f64) -> PinholeCamera {
    let [cx, cy] = [width, height].map(|side| 0.5 * f64::from(side));
    PinholeCamera { width, height, fx: focal_px, fy: focal_px, cx, cy, lens: PlumbBob::NONE }
}

/// The focal length from the sheet's perspective; `None` if it is undetermined, as for a sheet seen vertically from
/// above.
pub fn focal_from_sheet(size: (u32, u32), board: &Board, corners: &[SeenCorner]) -> Option<FocalEstimate> {
    let longer = f64::from(size.0.max(size.1));
    let middle = centered(size, longer);
    let homography = homography::fit(&places(board, corners))?;
    let closed = focal_length(&[homography], middle.cx, middle.cy);
    let starts = closed.into_iter().chain(STARTS.map(|share| share * longer));
    let plausible = FOCALS[0] * longer..FOCALS[1] * longer;
    // The homography has eight parameters and explains everything except the noise of the corners, in x and in y.
    let freedom = (2 * corners.len()).checked_sub(8).filter(|freedom| *freedom > 0)? as f64;
    let noise = homography_rms_px(board, corners)? * (corners.len() as f64 / freedom).sqrt();
    let corner_sigma = noise.max(MIN_CORNER_SIGMA_PX);
    let prior = (corner_sigma / (CENTER_SIGMA * longer)).powi(2);
    let found = starts.filter(|focal| plausible.contains(focal)).filter_map(|focal| {
        let camera = centered(size, focal);
        let camera_from_board = board_pose(&camera, board, corners)?.camera_from_board;
        minimise(Sheet { board: *board, corners, camera, camera_from_board, prior })
    });
    let best = found.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let covariance = best.information.try_inverse()? * (corner_sigma * corner_sigma);
    let estimate = FocalEstimate { focal_px: best.at.camera.fx, sigma_px: covariance[(0, 0)].max(0.0).sqrt() };
    (plausible.contains(&estimate.focal_px) && estimate.sigma_px.is_finite()).then_some(estimate)
}

/// Root mean square distance of corners from the homography, in pixels: the lens's distortion, which a homography
/// cannot explain, and noise.
pub fn homography_rms_px(board: &Board, corners: &[SeenCorner]) -> Option<f64> {
    let places = places(board, corners);
    let homography = homography::fit(&places)?;
    let sum: f64 =
        places.iter().map(|(place, pixel)| (homography::apply(&homography, place) - pixel).norm_squared()).sum();
    Some((sum / places.len() as f64).sqrt())
}

/// The errors of positions, in metres, for a given error of the focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocalCost {
    /// The assumed relative error of the focal length.
    pub focal_error: f64,
    /// The height above the sheet at which positions are compared.
    pub height_m: f64,
    /// Error above the sheet's centre at that height, in metres; NaN if the picture does not show that point, or if no
    /// other focal length can locate the sheet.
    pub at_sheet_m: f64,
    /// Largest error along the picture's border, in metres, where the picture shows the plane at that height; NaN if no
    /// other focal length can locate the sheet.
    pub at_border_m: f64,
}

/// Compares positions at a height for the given focal length with those for a longer and a shorter one. The pose is
/// estimated again for each focal length. With another focal length, a tilt near the largest one may exceed it: only
/// poses that can be estimated are compared.
///
/// # Errors
/// The errors of [`locate_sheet`] for the given focal length.
pub fn focal_cost(
    camera: &PinholeCamera,
    board: &Board,
    corners: &[SeenCorner],
    height_m: f64,
    focal_error: f64,
) -> Result<FocalCost, CalibrationError> {
    let posed = |factor: f64| -> Result<PosedCamera, CalibrationError> {
        let intrinsics = PinholeCamera { fx: camera.fx * factor, fy: camera.fy * factor, ..*camera };
        let world_from_camera = locate_sheet(&intrinsics, board, corners)?.sheet_from_camera;
        Ok(PosedCamera { intrinsics, world_from_camera })
    };
    let told = posed(1.0)?;
    let others: Vec<PosedCamera> = [1.0 + focal_error, 1.0 - focal_error].into_iter().flat_map(posed).collect();
    let moved = |pixel: &Point2<f64>| {
        let here = told.at_height(pixel, height_m)?;
        others.iter().filter_map(|other| Some((other.at_height(pixel, height_m)? - here).norm())).reduce(f64::max)
    };
    let middle = told.project(&board.center().coords.push(height_m).into());
    let [width, height] = [camera.width, camera.height].map(f64::from);
    let border = (0..=8).map(|k| f64::from(k) / 8.0).flat_map(|share| {
        [[share * width, 0.0], [share * width, height], [0.0, share * height], [width, share * height]]
    });
    Ok(FocalCost {
        focal_error,
        height_m,
        at_sheet_m: middle.and_then(|pixel| moved(&pixel)).unwrap_or(f64::NAN),
        at_border_m: border.filter_map(|pixel| moved(&pixel.into())).reduce(f64::max).unwrap_or(f64::NAN),
    })
}

/// The parameters: focal length, both coordinates of the centre, and the pose's twist.
#[derive(Clone)]
struct Sheet<'a> {
    board: Board,
    corners: &'a [SeenCorner],
    camera: PinholeCamera,
    camera_from_board: Isometry3<f64>,
    /// Weight of the squared distance of the principal point from the picture's centre.
    prior: f64,
}

impl Problem<9> for Sheet<'_> {
    fn blocks(&self) -> Option<Vec<Block<9>>> {
        let mut block = Block::empty();
        for seen in self.corners {
            let p = self.camera_from_board * self.board.corner(seen.corner);
            let projected = project(&self.camera, &p)?;
            let mut by_all = SMatrix::<f64, 2, 9>::zeros();
            // The focal length is the same for both axes.
            by_all.set_column(0, &(projected.by_intrinsics.column(0) + projected.by_intrinsics.column(1)));
            by_all.set_column(1, &projected.by_intrinsics.column(2));
            by_all.set_column(2, &projected.by_intrinsics.column(3));
            by_all.fixed_view_mut::<2, 6>(0, 3).copy_from(&(projected.by_point * by_twist(&p)));
            block.add(&off(&projected.pixel, &seen.pixel), &by_all, &SMatrix::zeros(), 1.0);
        }
        let middle = centered((self.camera.width, self.camera.height), 1.0);
        let center = SVector::<f64, 2>::new(self.camera.cx - middle.cx, self.camera.cy - middle.cy);
        let mut by_center = SMatrix::<f64, 2, 9>::zeros();
        by_center[(0, 1)] = 1.0;
        by_center[(1, 2)] = 1.0;
        block.add(&center, &by_center, &SMatrix::zeros(), self.prior);
        block.own = Matrix6::identity();
        (self.camera.fx > 0.0).then(|| vec![block])
    }

    fn stepped(&self, shared: &SVector<f64, 9>, _own: &[Vector6<f64>]) -> Self {
        let focal = self.camera.fx + shared[0];
        let camera = PinholeCamera {
            fx: focal,
            fy: focal,
            cx: self.camera.cx + shared[1],
            cy: self.camera.cy + shared[2],
            ..self.camera
        };
        let twist = shared.fixed_rows::<6>(3).into_owned();
        Self { camera, camera_from_board: motion(&twist) * self.camera_from_board, ..self.clone() }
    }
}
