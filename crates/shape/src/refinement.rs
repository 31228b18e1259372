//! Moves a template from a predicted pose to where its edges agree best.
//!
//! ```text
//! initial ─ grid of poses on the coarsest level ─ a few best ─┐
//!   ┌────────────────────────────────────────────────────────┘
//!   └─ per level, coarse to fine: climb the agreement, snap edges to crests, keep the better half
//!        └─ finest level: snap until still ─ agreement
//! ```
//! The agreement is flat across a blurred edge, since direction does not change there: climbing it is
//! robust but not exact. Snapping measures how far each edge point is from the crest of the image's
//! gradient along its normal and solves for the pose by weighted least squares: exact, but only near.

use sdg_geometry::PlanarSimilarity;

use crate::consensus::{Snapped, snap};
use crate::gradient_field::GradientField;
use crate::pose::Pose;
use crate::template::{LevelSampling, MatchedLevel, ShapeTemplate, TemplateLevel};

/// Poses that are followed from the coarsest level. More cost time in proportion. Chosen by hand, not measured.
const NUM_CANDIDATES: usize = 5;
/// Step of the grid of poses, in level pixels of edge movement: directions hold for two pixels about
/// an edge. Chosen by that reasoning, not measured.
const GRID_STEP: f64 = 1.5;
/// Agreement given up for a start at the far end of the capture range: ties go to the prediction. Chosen by
/// hand, not measured.
const DISTANCE_PENALTY: f64 = 0.03;
/// Steps of the climb in level pixels of edge movement: first and last. Chosen by hand, not measured.
const CLIMB_STEPS: (f64, f64) = (0.5, 0.1);
/// A bound for climbs that creep. Chosen by hand, not measured.
const MAX_CLIMB_ROUNDS: usize = 24;

/// A pose after refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Where the demonstration lies in the image.
    pub image_from_demonstration: PlanarSimilarity,
    /// [`ShapeTemplate::agreement`] at that pose.
    pub agreement: f64,
    /// The agreement at the initial pose.
    pub initial_agreement: f64,
    /// Rounds of least squares at the finest level.
    pub num_rounds: usize,
}

impl ShapeTemplate {
    /// Climbs from a predicted pose to the best agreement within the configured capture range.
    ///
    /// The answer is only as far from `initial` as [`crate::ShapeConfig`] allows, whatever the image
    /// shows; deterministic.
    ///
    /// # Units and frames
    /// Poses map demonstration pixels to pixels of the image the field was computed from.
    pub fn refine(&self, field: &GradientField, initial: &PlanarSimilarity) -> Refinement {
        let start = Pose::from_similarity(initial, self.center);
        self.refine_within(field, start, &CaptureRange::new(self, field, start))
    }

    /// As [`refine`](Self::refine), but only shifted, by at most `max_shift_px` pixels of the image in x and in y.
    pub fn refine_shift(&self, field: &GradientField, initial: &PlanarSimilarity, max_shift_px: f64) -> Refinement {
        let start = Pose::from_similarity(initial, self.center);
        self.refine_within(field, start, &CaptureRange::around(start, [max_shift_px, max_shift_px, 0.0, 0.0]))
    }

    fn refine_within(&self, field: &GradientField, start: Pose, range: &CaptureRange) -> Refinement {
        let initial_agreement = self.agreement_at(field, &start);

        let mut candidates = self.grid_candidates(field, range);
        candidates.push(start);
        let mut num_rounds = 0;
        for (idx, level) in self.levels.iter().enumerate().rev() {
            let matched = level.matched_level(field, &start);
            let mut snapped: Vec<Snapped> = candidates
                .iter()
                .map(|&pose| snap(level, &matched, range, climb(level, &matched, range, pose)))
                .collect();
            snapped.sort_by(|a, b| b.score.total_cmp(&a.score));
            num_rounds = snapped[0].num_rounds;
            let keep = if idx == 0 { 1 } else { snapped.len().div_ceil(2) };
            let units = step_units(level, &matched, &start);
            candidates.clear();
            for Snapped { pose, .. } in snapped {
                // Several starts often end on one pose: it is followed once.
                if candidates.len() < keep && candidates.iter().all(|other| !pose.is_near(other, units)) {
                    candidates.push(pose);
                }
            }
        }
        let best = candidates[0];
        Refinement {
            image_from_demonstration: best.to_similarity(self.center),
            agreement: self.agreement_at(field, &best),
            initial_agreement,
            num_rounds,
        }
    }

    /// Climbs from `from` within `range` at the coarsest level; the pose and its agreement there.
    pub(crate) fn climb_coarsest(&self, field: &GradientField, range: &CaptureRange, from: Pose) -> (Pose, f64) {
        let level = &self.levels[self.levels.len() - 1];
        let matched = level.matched_level(field, &range.start);
        let pose = climb(level, &matched, range, from);
        (pose, matched.mean_alignment(level, &pose, LevelSampling::Bilinear))
    }

    /// Climbs and snaps from `from` within `range`, coarse to fine.
    pub(crate) fn follow(&self, field: &GradientField, range: &CaptureRange, from: Pose) -> Pose {
        self.levels.iter().rev().fold(from, |pose, level| {
            let matched = level.matched_level(field, &range.start);
            snap(level, &matched, range, climb(level, &matched, range, pose)).pose
        })
    }

    /// The best poses of a grid over the capture range, on the coarsest level, no two alike.
    fn grid_candidates(&self, field: &GradientField, range: &CaptureRange) -> Vec<Pose> {
        let level = &self.levels[self.levels.len() - 1];
        let matched = level.matched_level(field, &range.start);
        let units = step_units(level, &matched, &range.start).map(|unit| GRID_STEP * unit);
        let counts = [0, 1, 2, 3].map(|k| (range.limits[k] / units[k]).ceil() as i32);
        let mut scored: Vec<(f64, [i32; 4])> = Vec::new();
        for scale in -counts[3]..=counts[3] {
            for angle in -counts[2]..=counts[2] {
                for y in -counts[1]..=counts[1] {
                    for x in -counts[0]..=counts[0] {
                        let cell = [x, y, angle, scale];
                        let pose = range.pose_at_cell(cell, counts);
                        let score = matched.mean_alignment(level, &pose, LevelSampling::Nearest);
                        scored.push((score - DISTANCE_PENALTY * range.distance(&pose), cell));
                    }
                }
            }
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<[i32; 4]> = Vec::new();
        for (_, cell) in scored {
            let is_new = kept.iter().all(|k| k.iter().zip(&cell).any(|(a, b)| (a - b).abs() > 1));
            if is_new {
                kept.push(cell);
            }
            if kept.len() == NUM_CANDIDATES {
                break;
            }
        }
        kept.into_iter().map(|cell| range.pose_at_cell(cell, counts)).collect()
    }
}

/// Where a refinement may go: a box about the initial pose.
pub(crate) struct CaptureRange {
    start: Pose,
    /// Largest change of x (px), y (px), angle (rad), ln scale.
    pub(crate) limits: [f64; 4],
}

impl CaptureRange {
    fn new(template: &ShapeTemplate, field: &GradientField, start: Pose) -> Self {
        let config = &template.config;
        let shift = config.capture_shift * field.width() as f64;
        Self { start, limits: [shift, shift, config.capture_angle_rad, config.scale.max_log()] }
    }

    /// A box about `start` that reaches `limits` (px, px, rad, ln scale) to either side.
    pub(crate) fn around(start: Pose, limits: [f64; 4]) -> Self {
        Self { start, limits }
    }

    fn pose_at_cell(&self, cell: [i32; 4], counts: [i32; 4]) -> Pose {
        let step = [0, 1, 2, 3].map(|k| self.limits[k] * f64::from(cell[k]) / f64::from(counts[k].max(1)));
        self.start.moved(step)
    }

    fn difference(&self, pose: &Pose) -> [f64; 4] {
        [
            pose.center.x - self.start.center.x,
            pose.center.y - self.start.center.y,
            pose.angle_rad - self.start.angle_rad,
            pose.log_scale - self.start.log_scale,
        ]
    }

    /// Mean squared share of the limits that the pose uses, in `[0, 1]`.
    fn distance(&self, pose: &Pose) -> f64 {
        let difference = self.difference(pose);
        (0..4).filter(|&k| self.limits[k] > 0.0).map(|k| (difference[k] / self.limits[k]).powi(2)).sum::<f64>() / 4.0
    }

    pub(crate) fn clamped(&self, pose: &Pose) -> Pose {
        let difference = self.difference(pose);
        self.start.moved([0, 1, 2, 3].map(|k| difference[k].clamp(-self.limits[k], self.limits[k])))
    }
}

/// Changes of (x, y, angle, ln scale) that each move the edges by about one pixel of the image level.
pub(crate) fn step_units(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Pose) -> [f64; 4] {
    let pixel = matched.image_pixel_size;
    let turn = pixel / (level.radius_px * pose.log_scale.exp()).max(1.0);
    [pixel, pixel, turn, turn]
}

/// Compass search: one coordinate at a time, halving the step when no neighbour is better.
fn climb(level: &TemplateLevel, matched: &MatchedLevel<'_>, range: &CaptureRange, from: Pose) -> Pose {
    let units = step_units(level, matched, &from);
    let evaluate = |pose: &Pose| {
        matched.mean_alignment(level, pose, LevelSampling::Bilinear) - DISTANCE_PENALTY * range.distance(pose)
    };
    let mut pose = from;
    let mut best = evaluate(&pose);
    let mut step = CLIMB_STEPS.0;
    for _ in 0..MAX_CLIMB_ROUNDS {
        let mut improved = false;
        for k in 0..4 {
            if range.limits[k] == 0.0 {
                continue;
            }
            for sign in [1.0, -1.0] {
                let mut change = [0.0; 4];
                change[k] = sign * step * units[k];
                let next = range.clamped(&pose.moved(change));
                let score = evaluate(&next);
                if score > best + 1e-6 {
                    (best, pose, improved) = (score, next, true);
                    break;
                }
            }
        }
        if !improved {
            step *= 0.5;
            if step < CLIMB_STEPS.1 {
                break;
            }
        }
    }
    pose
}
