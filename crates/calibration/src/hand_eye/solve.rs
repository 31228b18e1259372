//! Minimises the reprojection error over all pictures; also estimates the robot's errors if the minimum is too large.

use nalgebra::Isometry3;
use sdg_geometry::{Mount, PinholeCamera};

use super::bundle::{Bundle, NUM_SHARED, SCALE};
use super::closed_form::{self, BoardSize};
use super::view::{HandEyeView, motion};
use crate::board::Board;
use crate::error::CalibrationError;
use crate::least_squares::{Minimum, minimise};
use crate::pose::BoardPose;

/// Initially assumed errors of a robot along and about an axis, in metres and radians; their ratio is kept. From issue
/// 16, which gives the noise of an arm.
pub(super) const ROBOT_SIGMA: [f64; 2] = [0.0001, 0.000_872_665];
/// Largest increase of the squared error over that of separate board poses, as a multiple of the increase expected for
/// exact robot poses. With 15 pictures this ratio has a standard deviation of 0.16.
const MAX_EXCESS: f64 = 1.5;
/// Robot errors, as a multiple of [`ROBOT_SIGMA`], above which poses and pictures do not match: 3 mm and 1.5 degrees.
pub(super) const MAX_ROBOT_SCALE: f64 = 30.0;
/// Robot errors, as a multiple of [`ROBOT_SIGMA`], from which the poses are suspected and other conventions for them
/// are tried: 0.15 mm and 0.075 degrees. One pose of 15 with an error of 10 mm causes as much.
pub(super) const SUSPECT_ROBOT_SCALE: f64 = 1.5;
/// Robot errors, as multiples of [`ROBOT_SIGMA`], from which the search restarts if it found no minimum.
const FURTHER_SCALES: [f64; 2] = [5.0, 25.0];
/// Largest residual of the closed form, in radians, for a restart. Above it, poses and pictures do not match at all.
const MAX_RETRY_RAD: f64 = 0.2;
/// Assumed minimum error of corners, in pixels.
const MIN_CORNER_SIGMA_PX: f64 = 0.02;

/// Pictures and the estimates that do not depend on the robot's poses.
#[derive(Clone)]
pub(super) struct Evidence<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) board: &'a Board,
    pub(super) mount: Mount,
    pub(super) views: Vec<&'a HandEyeView>,
    /// The board's pose in each picture, estimated from that picture alone.
    pub(super) poses: Vec<&'a BoardPose>,
}

/// The minimum and the estimated errors of the robot.
pub(super) struct Solved<'a> {
    pub(super) minimum: Minimum<Bundle<'a>, NUM_SHARED>,
    /// Robot errors as a multiple of [`ROBOT_SIGMA`]; `None` if robot poses count as exact.
    pub(super) robot_scale: Option<f64>,
    /// Six per picture minus the number of shared parameters.
    pub(super) freedom: f64,
    corner_sigma_px: f64,
    pub(super) board_rms_px: f64,
}

impl<'a> Evidence<'a> {
    /// The evidence of some of the pictures.
    pub(super) fn of(&self, kept: &[usize]) -> Self {
        Self {
            views: kept.iter().map(|k| self.views[*k]).collect(),
            poses: kept.iter().map(|k| self.poses[*k]).collect(),
            ..*self
        }
    }

    /// The board's pose in each picture.
    pub(super) fn boards(&self) -> Vec<Isometry3<f64>> {
        self.poses.iter().map(|pose| pose.camera_from_board).collect()
    }

    /// The motion `A_i` for each robot pose.
    pub(super) fn motions(&self, robot: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
        robot.iter().map(|pose| motion(self.mount, pose)).collect()
    }
}

impl<'a> Solved<'a> {
    pub(super) fn of(
        evidence: &Evidence<'a>,
        robot: &[Isometry3<f64>],
        size: BoardSize,
    ) -> Result<Self, CalibrationError> {
        let Evidence { camera, board, mount, views, poses } = evidence;
        let num_corners: usize = views.iter().map(|view| view.corners.len()).sum();
        let free_cost: f64 =
            poses.iter().zip(views).map(|(pose, view)| pose.rms_px.powi(2) * view.corners.len() as f64).sum();
        let free_freedom = (2 * num_corners).saturating_sub(6 * views.len()).max(1);
        let corner_sigma_px = (free_cost / free_freedom as f64).sqrt().max(MIN_CORNER_SIGMA_PX);
        let board_rms_px = (free_cost / num_corners as f64).sqrt();

        let motions = evidence.motions(robot);
        let closed = closed_form::solve(&motions, &evidence.boards(), size).ok_or(CalibrationError::NoPose)?;
        let start = Bundle::new(**camera, **board, *mount, views.clone(), motions, [closed.x, closed.y]);
        let (start, num_shared) = match size {
            BoardSize::Told => (start, 12),
            BoardSize::Free => (start.with_free_scale(closed.board_scale), 13),
        };
        let exact = minimise(start.clone()).ok_or(CalibrationError::NoPose)?;
        // The six parameters of each picture are replaced by the common ones.
        let freedom = (6 * views.len() - num_shared) as f64;
        let solved = |minimum, robot_scale| Self { minimum, robot_scale, freedom, corner_sigma_px, board_rms_px };
        let excess = |cost: f64| (cost - free_cost) / (corner_sigma_px * corner_sigma_px) / freedom;
        if excess(exact.cost) <= MAX_EXCESS {
            return Ok(solved(exact, None));
        }
        let solve = |scale: f64, from: &Bundle<'a>| {
            let sigma = ROBOT_SIGMA.map(|sigma| scale * sigma / corner_sigma_px);
            minimise(from.with_robot_sigma(sigma)).ok_or(CalibrationError::NoPose)
        };
        // The assumed robot errors are correct if the increase of the squared error, in units of the variance, equals
        // `freedom`. The squared error decreases as the assumed errors grow.
        let weighed = |first: f64, from: &Bundle<'a>| {
            let mut scale = first;
            let mut minimum = solve(scale, from)?;
            let mut is_right = false;
            for _ in 0..20 {
                let ratio = excess(minimum.cost);
                is_right = (ratio - 1.0).abs() < 0.02;
                if is_right || scale > 10.0 * MAX_ROBOT_SCALE {
                    break;
                }
                scale *= ratio.max(0.01).sqrt();
                minimum = solve(scale, &minimum.at)?;
            }
            Ok((minimum, scale, is_right))
        };
        let (minimum, scale, is_right) = weighed(1.0, &exact.at)?;
        // If one pose has a large error, the minimisation with exact poses or with small robot errors may not converge.
        if !is_right && closed.left_rad < MAX_RETRY_RAD {
            for first in FURTHER_SCALES {
                if let Ok((minimum, scale, true)) = weighed(first, &start) {
                    return Ok(solved(minimum, Some(scale)));
                }
            }
        }
        Ok(solved(minimum, Some(scale)))
    }

    /// Robot errors as a multiple of [`ROBOT_SIGMA`]; 0 if robot poses count as exact.
    pub(super) fn robot_noise(&self) -> f64 {
        self.robot_scale.unwrap_or_default()
    }

    /// The decrease of the squared error when the board's scale becomes free while the weights of the robot's errors
    /// are kept; in units of the variance. By chance alone, 1 is expected.
    pub(super) fn gain_of_free_scale(&self) -> f64 {
        let at = &self.minimum.at;
        let free = minimise(at.with_free_scale(at.board_scale));
        free.map_or(0.0, |free| (self.minimum.cost - free.cost) / self.variance())
    }

    /// The board's scale and its standard error.
    pub(super) fn board_scale(&self) -> Option<[f64; 2]> {
        let variance = self.minimum.information.try_inverse()?[(SCALE, SCALE)] * self.variance();
        Some([self.minimum.at.board_scale, variance.max(0.0).sqrt()])
    }

    /// The variance of the residuals, in squared pixels: of the corners, and of the weighted errors of the robot.
    pub(super) fn variance(&self) -> f64 {
        self.corner_sigma_px * self.corner_sigma_px
    }

    /// The solutions `X` with one picture left out, for each picture.
    pub(super) fn without_each(&self) -> Vec<Isometry3<f64>> {
        let all = &self.minimum.at;
        (0..all.num_views())
            // If no solution exists without a picture, the result depends on this picture: the change is then as
            // large as the pose itself.
            .map(|k| minimise(all.without(k)).map_or(Isometry3::identity(), |minimum| minimum.at.x))
            .collect()
    }
}
