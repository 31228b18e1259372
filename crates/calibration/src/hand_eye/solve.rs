//! The minimum over all pictures, with the robot's errors where reprojection shows them.

use nalgebra::Isometry3;
use sdg_geometry::PinholeCamera;

use super::bundle::Bundle;
use super::closed_form;
use super::view::{HandEyeView, Mount};
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
/// Where other readings of the poses are tried: 0.5 mm and 0.25 degrees.
pub(super) const SUSPECT_ROBOT_SCALE: f64 = 5.0;
/// What corners are off by at least, in pixels.
const MIN_CORNER_SIGMA_PX: f64 = 0.02;

/// The minimum, and the errors that led to it.
pub(super) struct Solved<'a> {
    pub(super) minimum: Minimum<Bundle<'a>, 12>,
    /// Multiples of [`ROBOT_SIGMA`]; `None` where robot poses count as exact.
    pub(super) robot_scale: Option<f64>,
    corner_sigma_px: f64,
    pub(super) board_rms_px: f64,
}

impl<'a> Solved<'a> {
    pub(super) fn of(
        camera: &PinholeCamera,
        board: &Board,
        mount: Mount,
        views: &'a [HandEyeView],
        robot: &[Isometry3<f64>],
        poses: &[BoardPose],
    ) -> Result<Self, CalibrationError> {
        let num_corners: usize = views.iter().map(|view| view.corners.len()).sum();
        let free_cost: f64 =
            poses.iter().zip(views).map(|(pose, view)| pose.rms_px.powi(2) * view.corners.len() as f64).sum();
        let free_freedom = (2 * num_corners).saturating_sub(6 * views.len()).max(1);
        let corner_sigma_px = (free_cost / free_freedom as f64).sqrt().max(MIN_CORNER_SIGMA_PX);
        let board_rms_px = (free_cost / num_corners as f64).sqrt();

        let motions: Vec<_> = robot.iter().map(|pose| mount.motion(pose)).collect();
        let boards: Vec<_> = poses.iter().map(|pose| pose.camera_from_board).collect();
        let (x, y) = closed_form::solve(&motions, &boards).ok_or(CalibrationError::NoPose)?;
        let start = Bundle::new(*camera, *board, mount, views, motions, [x, y]);
        let exact = minimise(start).ok_or(CalibrationError::NoPose)?;
        // Each picture's six parameters are replaced by twelve of all.
        let freedom = (6 * views.len() - 12) as f64;
        let excess = |cost: f64| (cost - free_cost) / (corner_sigma_px * corner_sigma_px) / freedom;
        if excess(exact.cost) <= MAX_EXCESS {
            return Ok(Self { minimum: exact, robot_scale: None, corner_sigma_px, board_rms_px });
        }
        let solve = |scale: f64, from: &Bundle<'a>| {
            let sigma = ROBOT_SIGMA.map(|sigma| scale * sigma / corner_sigma_px);
            minimise(from.with_robot_sigma(sigma)).ok_or(CalibrationError::NoPose)
        };
        // The errors are right where the squares are as many as equations are left; they fall as the errors grow.
        let mut scale = 1.0;
        let mut minimum = solve(scale, &exact.at)?;
        for _ in 0..20 {
            let ratio = excess(minimum.cost);
            if (ratio - 1.0).abs() < 0.02 || scale > 10.0 * MAX_ROBOT_SCALE {
                break;
            }
            scale *= ratio.max(0.01).sqrt();
            minimum = solve(scale, &minimum.at)?;
        }
        Ok(Self { minimum, robot_scale: Some(scale), corner_sigma_px, board_rms_px })
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
