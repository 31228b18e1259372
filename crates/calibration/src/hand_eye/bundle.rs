//! Reprojection over all pictures, as a function of `X`, `Y` (see the parent module), the board's scale and the error
//! of each robot pose.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, Vector6};
use sdg_geometry::{Mount, PinholeCamera};

use super::view::HandEyeView;
use crate::board::Board;
use crate::least_squares::{Block, Problem};
use crate::projection::{by_twist, motion, off, project};

/// Number of shared parameters: small motions of `X` and `Y` (six each), and the board's scale.
pub(super) const NUM_SHARED: usize = 13;
/// Index of the board's scale.
pub(super) const SCALE: usize = 12;

#[derive(Debug, Clone)]
pub(super) struct Bundle<'a> {
    camera: PinholeCamera,
    board: Board,
    mount: Mount,
    views: Vec<&'a HandEyeView>,
    /// The motion `A_i` of the flange for each picture.
    motions: Vec<Isometry3<f64>>,
    pub(super) x: Isometry3<f64>,
    pub(super) y: Isometry3<f64>,
    /// The board's size as a multiple of the given one. `Y` is applied after this scale.
    pub(super) board_scale: f64,
    is_scale_free: bool,
    /// The error of each robot pose: a small motion in the flange's frame.
    errors: Vec<Isometry3<f64>>,
    /// Robot errors, in metres and radians, that have the weight of one pixel; `None` if robot poses are exact.
    robot_sigma: Option<[f64; 2]>,
}

impl<'a> Bundle<'a> {
    pub(super) fn new(
        camera: PinholeCamera,
        board: Board,
        mount: Mount,
        views: Vec<&'a HandEyeView>,
        motions: Vec<Isometry3<f64>>,
        [x, y]: [Isometry3<f64>; 2],
    ) -> Self {
        let errors = vec![Isometry3::identity(); views.len()];
        Self {
            camera,
            board,
            mount,
            views,
            motions,
            x,
            y,
            board_scale: 1.0,
            is_scale_free: false,
            errors,
            robot_sigma: None,
        }
    }

    /// A copy in which the board's scale, otherwise fixed, is a free parameter.
    pub(super) fn with_free_scale(&self, board_scale: f64) -> Self {
        Self { board_scale, is_scale_free: true, ..self.clone() }
    }

    /// A copy with robot errors of `sigma` metres and radians per pixel.
    pub(super) fn with_robot_sigma(&self, sigma: [f64; 2]) -> Self {
        Self { robot_sigma: Some(sigma), ..self.clone() }
    }

    pub(super) fn num_views(&self) -> usize {
        self.views.len()
    }

    /// A copy without one picture.
    pub(super) fn without(&self, view: usize) -> Self {
        let mut fewer = self.clone();
        fewer.views.remove(view);
        fewer.motions.remove(view);
        fewer.errors.remove(view);
        fewer
    }

    /// RMS error of each picture, with the given robot poses.
    pub(super) fn rms_of_pictures(&self) -> Vec<f64> {
        (0..self.views.len()).map(|k| (self.square(k) / self.views[k].corners.len() as f64).sqrt()).collect()
    }

    /// RMS error over all pictures, with the given robot poses.
    pub(super) fn rms_px(&self) -> f64 {
        let count: usize = self.views.iter().map(|view| view.corners.len()).sum();
        ((0..self.views.len()).map(|k| self.square(k)).sum::<f64>() / count as f64).sqrt()
    }

    fn square(&self, view: usize) -> f64 {
        let camera_from_board = self.x.inverse() * self.motions[view] * self.y;
        let squares = self.views[view].corners.iter().map(|seen| {
            let p = camera_from_board * (self.board.corner(seen.corner) * self.board_scale);
            project(&self.camera, &p)
                .map_or(f64::INFINITY, |projected| off(&projected.pixel, &seen.pixel).norm_squared())
        });
        squares.sum()
    }

    fn block(&self, view: usize) -> Option<Block<NUM_SHARED>> {
        let mut block = Block::empty();
        let camera_from_x = self.x.inverse();
        let (motion, error) = (&self.motions[view], &self.errors[view]);
        // With the camera on the hand, the flange's error applies on the camera's side of A; otherwise on the board's
        // side.
        let (camera_from_flange, flange_from_y) = match self.mount {
            Mount::Hand => (camera_from_x, *motion),
            Mount::Base => (camera_from_x * motion, Isometry3::identity()),
        };
        let camera_from_y: Isometry3<f64> = camera_from_flange * error * flange_from_y;
        let turn = |isometry: &Isometry3<f64>| -> Matrix3<f64> { isometry.rotation.to_rotation_matrix().into_inner() };
        let (turn_of_y, turn_of_flange) = (turn(&(camera_from_y * self.y)), turn(&camera_from_flange));
        for seen in &self.views[view].corners {
            let told = self.board.corner(seen.corner);
            let b = told * self.board_scale;
            let in_flange = error * (flange_from_y * (self.y * b));
            let p = camera_from_flange * in_flange;
            let projected = project(&self.camera, &p)?;
            let mut by_shared = SMatrix::<f64, 2, NUM_SHARED>::zeros();
            // The small motions are the right factors of X and Y, so the inverse motion is the left factor of X⁻¹.
            by_shared.fixed_view_mut::<2, 6>(0, 0).copy_from(&-(projected.by_point * by_twist(&p)));
            by_shared.fixed_view_mut::<2, 6>(0, 6).copy_from(&(projected.by_point * turn_of_y * by_twist(&b)));
            by_shared.fixed_view_mut::<2, 1>(0, SCALE).copy_from(&(projected.by_point * turn_of_y * told.coords));
            let by_own = match self.robot_sigma {
                Some(_) => projected.by_point * turn_of_flange * by_twist(&in_flange),
                None => SMatrix::zeros(),
            };
            block.add(&off(&projected.pixel, &seen.pixel), &by_shared, &by_own, 1.0);
        }
        match self.robot_sigma {
            Some([sigma_m, sigma_rad]) => {
                let turn = error.rotation.scaled_axis();
                let shift = error.translation.vector;
                let scales = [sigma_m, sigma_m, sigma_m, sigma_rad, sigma_rad, sigma_rad].map(|sigma| 1.0 / sigma);
                let twist = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
                let weights = Matrix6::from_diagonal(&Vector6::from(scales));
                block.add(&(weights * twist), &SMatrix::zeros(), &weights, 1.0);
            }
            // No residual depends on the robot's errors.
            None => block.own = Matrix6::identity(),
        }
        block.cost.is_finite().then_some(block)
    }
}

impl Problem<NUM_SHARED> for Bundle<'_> {
    fn blocks(&self) -> Option<Vec<Block<NUM_SHARED>>> {
        (0..self.views.len()).map(|view| self.block(view)).collect()
    }

    fn stepped(&self, shared: &SVector<f64, NUM_SHARED>, own: &[Vector6<f64>]) -> Self {
        let twist = |from: usize| motion(&shared.fixed_rows::<6>(from).into_owned());
        let errors = self.errors.iter().zip(own).map(|(error, step)| motion(step) * error).collect();
        let board_scale = self.board_scale + shared[SCALE];
        Self { x: self.x * twist(0), y: self.y * twist(6), board_scale, errors, ..self.clone() }
    }

    fn fixed(&self) -> [bool; NUM_SHARED] {
        let mut fixed = [false; NUM_SHARED];
        fixed[SCALE] = !self.is_scale_free;
        fixed
    }
}
