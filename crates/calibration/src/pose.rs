//! The board's pose relative to a camera with known intrinsics.

use nalgebra::{Isometry3, Matrix2x6, Matrix3, Matrix6, Point2, Point3, Rotation3, SMatrix, UnitQuaternion, Vector6};
use sdg_geometry::PinholeCamera;

use crate::board::Board;
use crate::detection::SeenCorner;
use crate::homography;
use crate::least_squares::{Block, Problem, minimise};
use crate::projection::{by_twist, motion, off, project};

/// The board's pose in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPose {
    /// Transform from the board's frame to the optical frame, in metres.
    pub camera_from_board: Isometry3<f64>,
    /// Root of the mean squared distance between corners and their projections, in pixels.
    pub rms_px: f64,
    /// Covariance of a small twist (translation, rotation) in the optical frame that is applied after the pose.
    pub covariance: Matrix6<f64>,
}

/// The pose of minimum reprojection error; `None` if no pose explains the corners.
pub fn board_pose(camera: &PinholeCamera, board: &Board, corners: &[SeenCorner]) -> Option<BoardPose> {
    let places = corners.iter().filter_map(|seen| {
        let direction = camera.unproject(&seen.pixel)?;
        Some((board.corner(seen.corner).xy(), direction.xy()))
    });
    let homography = homography::fit(&places.collect::<Vec<_>>())?;
    let start = from_homography(&homography)?;
    let minimum = minimise(Alone { camera: *camera, board: *board, corners, camera_from_board: start })?;
    let freedom = (2 * corners.len()).checked_sub(6).filter(|freedom| *freedom > 0)?;
    let covariance = minimum.information.try_inverse()? * (minimum.cost / freedom as f64);
    let rms_px = (minimum.cost / corners.len() as f64).sqrt();
    Some(BoardPose { camera_from_board: minimum.at.camera_from_board, rms_px, covariance })
}

/// The pose from a homography to points at depth 1. The homography determines the first two axes and the translation.
pub(crate) fn from_homography(homography: &Matrix3<f64>) -> Option<Isometry3<f64>> {
    let [x, y, t] = [0, 1, 2].map(|k| homography.column(k).into_owned());
    let scale = 2.0 / (x.norm() + y.norm());
    // The sign is correct: `homography::fit` places the corners' centre in front of the camera.
    let (x, y, t) = (x * scale, y * scale, t * scale);
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let svd = matrix.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    let is_rotation = rotation.determinant() > 0.0 && t.iter().all(|value| value.is_finite());
    is_rotation.then(|| {
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts(t.into(), rotation)
    })
}

#[derive(Clone)]
struct Alone<'a> {
    camera: PinholeCamera,
    board: Board,
    corners: &'a [SeenCorner],
    camera_from_board: Isometry3<f64>,
}

impl Problem<6> for Alone<'_> {
    fn blocks(&self) -> Option<Vec<Block<6>>> {
        let mut block = Block::empty();
        for seen in self.corners {
            let p: Point3<f64> = self.camera_from_board * self.board.corner(seen.corner);
            let projected = project(&self.camera, &p)?;
            let by_pose: Matrix2x6<f64> = projected.by_point * by_twist(&p);
            block.add(&off(&projected.pixel, &seen.pixel), &by_pose, &SMatrix::zeros(), 1.0);
        }
        // All parameters are shared.
        block.own = Matrix6::identity();
        Some(vec![block])
    }

    fn stepped(&self, shared: &Vector6<f64>, _own: &[Vector6<f64>]) -> Self {
        Self { camera_from_board: motion(shared) * self.camera_from_board, ..self.clone() }
    }
}

/// Points of the board and pixels of a pinhole picture, as a homography needs them.
pub(crate) fn places(board: &Board, corners: &[SeenCorner]) -> Vec<(Point2<f64>, Point2<f64>)> {
    corners.iter().map(|seen| (board.corner(seen.corner).xy(), seen.pixel)).collect()
}
