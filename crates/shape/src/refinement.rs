//! Moves a template from a predicted pose to the pose of best edge agreement.
//!
//! ```text
//! initial ─ grid of poses on the coarsest level ─ a few best ─┐
//!   ┌────────────────────────────────────────────────────────┘
//!   └─ per level, coarse to fine: climb the agreement, snap edges to crests, keep the better half
//!        └─ finest level: snap until still ─ agreement
//! ```
//! The agreement is flat across a blurred edge, since direction does not change there: climbing it is
//! robust but not exact. Snapping measures the distance of each edge point from the crest of the
//! image's gradient along its normal and solves for the pose by weighted least squares: exact, but
//! only near the solution.

use std::cell::RefCell;

use sdg_geometry::{CompassSearch, PlanarSimilarity};

use crate::capture_range::{CaptureRange, step_units};
use crate::consensus::{Snapped, snap};
use crate::gradient_field::GradientField;
use crate::parallel;
use crate::pose::Pose;
use crate::template::{LevelSampling, MatchedLevel, ShapeTemplate, TemplateLevel};

/// Number of poses followed from the coarsest level; time is proportional to it. Chosen by hand, not measured.
const NUM_CANDIDATES: usize = 5;
/// Step of the grid of poses, in level pixels of edge movement: directions are constant within two pixels of an edge.
/// Derived from this distance, not measured.
const GRID_STEP: f64 = 1.5;
/// Penalty of agreement for a pose with all coordinates at the limits of the capture range, so that the prediction wins
/// ties. Chosen by hand, not measured.
const DISTANCE_PENALTY: f64 = 0.03;
/// The climb: steps in level pixels of edge movement, and the maximum number of rounds. Chosen by hand, not measured.
const CLIMB: CompassSearch =
    CompassSearch { steps: (0.5, 0.1), min_gain: 1e-6, max_rounds: 24, max_evaluations: usize::MAX };

/// A pose after refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// The pose of the demonstration in the image.
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
    /// The result is only as far from `initial` as [`crate::ShapeConfig`] allows, for any image;
    /// deterministic.
    ///
    /// # Units and frames
    /// Poses map demonstration pixels to pixels of the image the field was computed from.
    pub fn refine(&self, field: &GradientField, initial: &PlanarSimilarity) -> Refinement {
        let start = Pose::from_similarity(initial, self.center);
        self.refine_within(field, start, &CaptureRange::new(self, field, start))
    }

    fn refine_within(&self, field: &GradientField, start: Pose, range: &CaptureRange) -> Refinement {
        let initial_agreement = self.agreement_at(field, &start);

        let mut candidates = self.grid_candidates(field, range);
        candidates.push(start);
        let mut num_rounds = 0;
        for (idx, level) in self.levels.iter().enumerate().rev() {
            let matched = range.matched_level(level, field);
            let mut snapped: Vec<Snapped> =
                parallel::map(&candidates, |&pose| snap(level, &matched, range, climb(level, &matched, range, pose)));
            snapped.sort_by(|a, b| b.score.total_cmp(&a.score));
            num_rounds = snapped[0].num_rounds;
            let keep = if idx == 0 { 1 } else { snapped.len().div_ceil(2) };
            let units = step_units(level, &matched, &start);
            candidates.clear();
            for Snapped { pose, .. } in snapped {
                // Several starts often end at one pose, which is followed once.
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

    /// Climbs from `from` within `range` at the coarsest level; returns the pose and its agreement there.
    pub(crate) fn climb_coarsest(&self, field: &GradientField, range: &CaptureRange, from: Pose) -> (Pose, f64) {
        let level = &self.levels[self.levels.len() - 1];
        let matched = range.matched_level(level, field);
        let pose = climb(level, &matched, range, from);
        (pose, matched.mean_alignment(level, &pose, LevelSampling::Bilinear))
    }

    /// Climbs and snaps from `from` within `range`, coarse to fine.
    pub(crate) fn follow(&self, field: &GradientField, range: &CaptureRange, from: Pose) -> Pose {
        let rough = self.follow_roughly(field, range, from);
        self.follow_finely(field, range, rough)
    }

    /// As [`Self::follow`], down to the agreement's level.
    pub(crate) fn follow_roughly(&self, field: &GradientField, range: &CaptureRange, from: Pose) -> Pose {
        follow_in(&self.levels[self.agreement_level_idx..], field, range, from)
    }

    /// As [`Self::follow`] at the levels finer than the agreement's, for a pose that was followed roughly.
    pub(crate) fn follow_finely(&self, field: &GradientField, range: &CaptureRange, rough: Pose) -> Pose {
        follow_in(&self.levels[..self.agreement_level_idx], field, range, rough)
    }

    /// The best poses of a grid over the capture range, on the coarsest level, without duplicates.
    fn grid_candidates(&self, field: &GradientField, range: &CaptureRange) -> Vec<Pose> {
        let level = &self.levels[self.levels.len() - 1];
        let matched = range.matched_level(level, field);
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

fn follow_in(levels: &[TemplateLevel], field: &GradientField, range: &CaptureRange, from: Pose) -> Pose {
    levels.iter().rev().fold(from, |pose, level| {
        let matched = range.matched_level(level, field);
        snap(level, &matched, range, climb(level, &matched, range, pose)).pose
    })
}

/// The scores of the last poses of a climb, which are often needed again: after a step, the pose before it is a
/// neighbour, and at a limit all further steps end at the same pose.
#[derive(Default)]
struct LastScores {
    kept: [Option<(Pose, f64)>; 8],
    next: usize,
}

impl LastScores {
    /// Poses that differ by rounding alone, in pixels and radians.
    const SAME: [f64; 4] = [1e-9; 4];

    fn score(&mut self, pose: &Pose, score: impl Fn() -> f64) -> f64 {
        if let Some((_, score)) = self.kept.iter().flatten().find(|(other, _)| pose.is_near(other, Self::SAME)) {
            return *score;
        }
        let score = score();
        self.kept[self.next % self.kept.len()] = Some((*pose, score));
        self.next += 1;
        score
    }
}

/// Compass search for the best alignment at a level, minus a penalty for the distance from the start.
fn climb(level: &TemplateLevel, matched: &MatchedLevel<'_>, range: &CaptureRange, from: Pose) -> Pose {
    let units = step_units(level, matched, &from);
    let last = RefCell::new(LastScores::default());
    let evaluate = |pose: &Pose| {
        let score =
            || matched.mean_alignment(level, pose, LevelSampling::Bilinear) - DISTANCE_PENALTY * range.distance(pose);
        last.borrow_mut().score(pose, score)
    };
    let neighbour = |pose: &Pose, coordinate: usize, step: f64| {
        let mut change = [0.0; 4];
        change[coordinate] = step * units[coordinate];
        (range.limits[coordinate] > 0.0).then(|| range.clamped(&pose.moved(change)))
    };
    CLIMB.climb(from, neighbour, evaluate).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use std::cell::Cell;

    #[test]
    fn the_score_of_one_of_the_last_poses_is_not_computed_again() {
        let at = |x: f64| Pose { center: Point2::new(x, 1.0), angle_rad: 0.1, log_scale: 0.0 };
        let computed = Cell::new(0);
        let mut last = LastScores::default();
        let mut score = |pose: &Pose| {
            last.score(pose, || {
                computed.set(computed.get() + 1);
                pose.center.x
            })
        };
        assert_eq!([1.0, 2.0, 1.0 + 1e-12, 2.0].map(|x| score(&at(x))), [1.0, 2.0, 1.0, 2.0]);
        assert_eq!(computed.get(), 2);
        // Eight scores are kept.
        (10..18).for_each(|x| assert_eq!(score(&at(f64::from(x))), f64::from(x)));
        assert_eq!((score(&at(1.0)), computed.get()), (1.0, 11));
    }
}
