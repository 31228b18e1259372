//! The minimum over all pictures, with the robot's errors where reprojection shows them.

use nalgebra::Isometry3;
use sdg_geometry::{Mount, PinholeCamera};

use super::bundle::{Bundle, NUM_SHARED, SCALE};
use super::closed_form::{self, BoardSize};
use super::view::{HandEyeView, motion};
use crate::board::Board;
use crate::error::CalibrationError;
use crate::least_squares::{Minimum, minimise};
use crate::pose::BoardPose;

/// A robot's errors along and about an axis that are assumed at first, and keep this ratio: metres and radians.
/// The figures of issue 16 for an arm's noise.
pub(super) const ROBOT_SIGMA: [f64; 2] = [0.0001, 0.000_872_665];
/// The excess of squares over what exact robot poses leave, as a ratio: 15 pictures leave a deviation of 0.16.
const MAX_EXCESS: f64 = 1.5;
/// Robot errors, as multiples of those assumed, beyond which poses and pictures do not belong together: 3 mm and 1.5 degrees.
pub(super) const MAX_ROBOT_SCALE: f64 = 30.0;
/// Where other readings of the poses are tried: 0.15 mm and 0.075 degrees. One pose of 15 that is off by 10 mm leaves as much.
pub(super) const SUSPECT_ROBOT_SCALE: f64 = 1.5;
/// Robot errors from which the search starts again where it found none.
const FURTHER_SCALES: [f64; 2] = [5.0, 25.0];
/// It does not start again where the closed form leaves more, in radians: poses and pictures do not belong together at all.
const MAX_RETRY_RAD: f64 = 0.2;
/// What corners are off by at least, in pixels.
const MIN_CORNER_SIGMA_PX: f64 = 0.02;

/// Pictures, and their solution without the robot's poses.
#[derive(Clone)]
pub(super) struct Evidence<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) board: &'a Board,
    pub(super) mount: Mount,
    pub(super) views: Vec<&'a HandEyeView>,
    /// The board's pose in each picture, from that picture alone.
    pub(super) poses: Vec<&'a BoardPose>,
}

/// The minimum, and the errors that led to it.
pub(super) struct Solved<'a> {
    pub(super) minimum: Minimum<Bundle<'a>, NUM_SHARED>,
    /// Multiples of [`ROBOT_SIGMA`]; `None` where robot poses count as exact.
    pub(super) robot_scale: Option<f64>,
    /// Equations less parameters.
    pub(super) freedom: f64,
    corner_sigma_px: f64,
    pub(super) board_rms_px: f64,
}

impl<'a> Evidence<'a> {
    /// Those of some of the pictures.
    pub(super) fn of(&self, kept: &[usize]) -> Self {
        Self {
            views: kept.iter().map(|k| self.views[*k]).collect(),
            poses: kept.iter().map(|k| self.poses[*k]).collect(),
            ..*self
        }
    }

    /// Where the board is in each picture.
    pub(super) fn boards(&self) -> Vec<Isometry3<f64>> {
        self.poses.iter().map(|pose| pose.camera_from_board).collect()
    }

    /// `A_i` of robot poses.
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
        // Each picture's six parameters are replaced by those of all.
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
        // The errors are right where the squares are as many as equations are left; they fall as the errors grow.
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
        // Where one pose is far off the minimum with exact poses, or with small errors, may lead nowhere.
        if !is_right && closed.left_rad < MAX_RETRY_RAD {
            for first in FURTHER_SCALES {
                if let Ok((minimum, scale, true)) = weighed(first, &start) {
                    return Ok(solved(minimum, Some(scale)));
                }
            }
        }
        Ok(solved(minimum, Some(scale)))
    }

    /// Multiples of [`ROBOT_SIGMA`], 0 where robot poses count as exact.
    pub(super) fn robot_noise(&self) -> f64 {
        self.robot_scale.unwrap_or_default()
    }

    /// By how much the squares would fall with the board's scale free and the robot's errors weighed as now, over what they fall without a
    /// reason: 1.
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

    /// Squares are in pixels, with the robot's errors weighed against them.
    pub(super) fn variance(&self) -> f64 {
        self.corner_sigma_px * self.corner_sigma_px
    }

    /// `X` found without each picture.
    pub(super) fn without_each(&self) -> Vec<Isometry3<f64>> {
        let all = &self.minimum.at;
        (0..all.num_views())
            // What cannot be found without a picture rests on it alone: as far as the sum of all others.
            .map(|k| minimise(all.without(k)).map_or(Isometry3::identity(), |minimum| minimum.at.x))
            .collect()
    }
}
