//! Reprojection over all pictures: the common camera, and a pose of the board in each picture.

use nalgebra::{Isometry3, SVector, Vector3, Vector6};
use sdg_geometry::PinholeCamera;

use crate::board::Board;
use crate::detection::SeenCorner;
use crate::least_squares::{Block, Problem};
use crate::projection::{NUM_INTRINSICS, by_twist, motion, off, project, stepped};

#[derive(Debug, Clone)]
pub(super) struct Bundle<'a> {
    pub(super) board: Board,
    /// The corners of each picture.
    pub(super) views: Vec<Vec<&'a SeenCorner>>,
    pub(super) camera: PinholeCamera,
    /// `camera_from_board` of each picture.
    pub(super) poses: Vec<Isometry3<f64>>,
    /// Huber's bound, in pixels: larger residuals count by their length instead of its square.
    pub(super) robust_px: f64,
    pub(super) has_k3: bool,
}

impl Problem<NUM_INTRINSICS> for Bundle<'_> {
    fn blocks(&self) -> Option<Vec<Block<NUM_INTRINSICS>>> {
        let blocks = self.views.iter().zip(&self.poses).map(|(corners, pose)| {
            let mut block = Block::empty();
            for seen in corners {
                let p = pose * self.board.corner(seen.corner);
                let projected = project(&self.camera, &p)?;
                let residual = off(&projected.pixel, &seen.pixel);
                let length = residual.norm();
                let weight = if length <= self.robust_px { 1.0 } else { self.robust_px / length };
                block.add(&residual, &projected.by_intrinsics, &(projected.by_point * by_twist(&p)), weight);
                if weight < 1.0 {
                    // Huber's cost 2 b |r| - b², instead of the weighted square b |r|.
                    block.cost += self.robust_px * (length - self.robust_px);
                }
            }
            block.cost.is_finite().then_some(block)
        });
        blocks.collect()
    }

    fn stepped(&self, shared: &SVector<f64, NUM_INTRINSICS>, own: &[Vector6<f64>]) -> Self {
        let poses = self.poses.iter().zip(own).map(|(pose, twist)| motion(twist) * pose).collect();
        Self { camera: stepped(&self.camera, shared), poses, ..self.clone() }
    }

    fn fixed(&self) -> [bool; NUM_INTRINSICS] {
        let mut fixed = [false; NUM_INTRINSICS];
        fixed[NUM_INTRINSICS - 1] = !self.has_k3;
        fixed
    }
}

impl Bundle<'_> {
    pub(super) fn num_corners(&self) -> usize {
        self.views.iter().map(Vec::len).sum()
    }

    /// Squared distances of a picture's corners from their projections, in square pixels.
    fn squares(&self, view: usize) -> impl Iterator<Item = f64> {
        self.views[view].iter().map(move |seen| {
            let p = self.poses[view] * self.board.corner(seen.corner);
            project(&self.camera, &p)
                .map_or(f64::INFINITY, |projected| off(&projected.pixel, &seen.pixel).norm_squared())
        })
    }

    pub(super) fn rms_of_pictures(&self) -> Vec<f64> {
        let rms = |view: usize| (self.squares(view).sum::<f64>() / self.views[view].len() as f64).sqrt();
        (0..self.views.len()).map(rms).collect()
    }

    pub(super) fn rms_px(&self) -> f64 {
        let sum: f64 = (0..self.views.len()).flat_map(|view| self.squares(view)).sum();
        (sum / self.num_corners() as f64).sqrt()
    }

    /// Excludes corners farther from their projections than `ratio` times the RMS, except from pictures that would keep
    /// too few corners.
    pub(super) fn without_outliers(mut self, ratio: f64) -> Self {
        let bound = (ratio * self.rms_px()).powi(2);
        let kept = (0..self.views.len()).map(|view| {
            let near: Vec<_> = self.views[view]
                .iter()
                .zip(self.squares(view))
                .filter(|(_, square)| *square <= bound)
                .map(|(c, _)| *c)
                .collect();
            if near.len() >= crate::detection::MIN_CORNERS { near } else { self.views[view].clone() }
        });
        self.views = kept.collect();
        self
    }

    /// The board's normal, towards the camera, in the optical frame, for each picture.
    pub(super) fn normals(&self) -> Vec<Vector3<f64>> {
        self.poses.iter().map(|pose| pose.rotation * Vector3::z()).collect()
    }

    /// The largest angle between the normals of two pictures, in degrees.
    pub(super) fn tilt_range_deg(&self) -> f64 {
        let normals = self.normals();
        let angles = normals.iter().flat_map(|a| normals.iter().map(move |b| a.angle(b)));
        angles.fold(0.0, f64::max).to_degrees()
    }
}
