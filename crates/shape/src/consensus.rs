//! The pose on which most edge points agree to a fraction of a pixel.
//!
//! Beside the part's own edge an image often shows another of the same direction: the edge of its
//! shadow, its chamfer, a board it lies along. Least squares on the nearest edges ends between the two.
//! Here each edge point keeps all crests of the gradient near it along its normal, and the pose is
//! sought whose points nearly all have *one* of their crests within a pixel: the shadow lies on one
//! side only, so following it there breaks the other sides.
//!
//! Legend: `row` is how far a point moves along its normal per unit of (x, y, angle, ln scale), units
//! that move edges by about a level pixel; a crest at distance `d` asks for `row · step = d`.

use nalgebra::{Const, DimMin, SMatrix, SVector, Vector4};

use crate::capture_range::{CaptureRange, step_units};
use crate::edge_points::parabola_peak;
use crate::pose::Pose;
use crate::template::{MatchedLevel, TemplateLevel};

/// How far along its normal an edge point looks for crests, in level pixels: first and later rounds. Chosen by hand,
/// not measured.
pub(crate) const FIRST_REACH: usize = 6;
pub(crate) const LATER_REACH: usize = 3;
/// Most crests kept for a point. Chosen by hand, not measured.
const MAX_CRESTS: usize = 3;
/// Least alignment of a crest's direction, noise floor included. Chosen by hand, not measured.
const MIN_TRUST: f32 = 0.2;
/// Width of "on the edge" in level pixels, from the first look to the last. Chosen by hand, not measured.
pub(crate) const WIDTHS: [f64; 3] = [2.0, 1.2, 0.7];
/// Starts of the first round, in level pixels of edge movement by shift and by scale. Chosen by hand, not measured.
const START_STEP: f64 = 3.0;
/// Rounds of gathering crests anew, and the movement (level pixels) below which they stop. Both bound the
/// time; chosen by hand, not measured.
const MAX_ROUNDS: usize = 5;
const STILL: f64 = 0.01;
/// Steps that differ by less, in level pixels, end in the same place. Chosen by hand, for time.
const SAME_PLACE: f64 = 0.02;

/// A pose and how many of the points found a crest there.
pub(crate) struct Snapped {
    pub(crate) pose: Pose,
    /// Weighted share of the points that lie on a crest of their direction, in `[0, 1]`.
    pub(crate) score: f64,
    pub(crate) num_rounds: usize,
}

/// Where the first round begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Starts {
    /// At the pose itself, and a step to each side: an edge beside the part's own does not hold it.
    Around,
    /// At the pose itself, a fifth of the time: it is known to be about a pixel off.
    Here,
}

/// Moves `from` to the consensus nearby.
pub(crate) fn snap(level: &TemplateLevel, matched: &MatchedLevel<'_>, range: &CaptureRange, from: Pose) -> Snapped {
    snap_from(level, matched, range, from, Starts::Around)
}

/// As [`snap`], from fewer starts.
pub(crate) fn snap_from(
    level: &TemplateLevel,
    matched: &MatchedLevel<'_>,
    range: &CaptureRange,
    from: Pose,
    first: Starts,
) -> Snapped {
    let is_free = [0, 1, 2, 3].map(|k| range.limits[k] > 0.0);
    let mut best = Snapped { pose: from, score: 0.0, num_rounds: 0 };
    for round in 1..=MAX_ROUNDS {
        let reach = if round == 1 { FIRST_REACH } else { LATER_REACH };
        let sightings = gather(level, matched, &best.pose, reach);
        let (step, score) = if round == 1 {
            best_fit(&sightings, is_free, starts(is_free, first))
        } else {
            let step = fit_offsets(&sightings, is_free, Vector4::zeros(), &WIDTHS[2..]);
            (step, consensus_at(&sightings, &step))
        };
        let units = step_units(level, matched, &best.pose);
        let moved = best.pose.moved([0, 1, 2, 3].map(|k| step[k] * units[k]));
        best = Snapped { pose: range.clamped(&moved), score, num_rounds: round };
        if step.amax() < STILL {
            break;
        }
    }
    best
}

/// What one edge point sees along its normal; `row` has as many entries as a pose has coordinates.
pub(crate) struct Sighting<const N: usize> {
    row: SVector<f64, N>,
    weight: f64,
    /// (distance, weight) of each crest.
    crests: [(f64, f64); MAX_CRESTS],
    num_crests: usize,
}

fn gather(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Pose, reach: usize) -> Vec<Sighting<4>> {
    let map = pose.level_map(matched.image_pixel_size);
    let radius = (level.radius_px * pose.log_scale.exp() / matched.image_pixel_size).max(1.0) as f32;
    let [center_x, center_y] = map.apply([0.0, 0.0]);
    let mut sightings = Vec::with_capacity(level.points.len());
    for point in &level.points {
        let [x, y] = map.apply(point.offset);
        let [nx, ny] = map.turn(point.normal);
        let (rx, ry) = ((x - center_x) / radius, (y - center_y) / radius);
        let row = Vector4::new(nx, ny, ny * rx - nx * ry, nx * rx + ny * ry).map(f64::from);
        let place = EdgePlace { at: [x, y], normal: [nx, ny], double: map.turn_double(point.double) };
        sightings.extend(Sighting::new(matched, row, f64::from(point.weight), &place, reach));
    }
    sightings
}

/// An edge point laid over a level of the image, in its pixels; (cos 2φ, sin 2φ) of the normal beside it.
pub(crate) struct EdgePlace {
    pub(crate) at: [f32; 2],
    pub(crate) normal: [f32; 2],
    pub(crate) double: [f32; 2],
}

impl<const N: usize> Sighting<N> {
    /// `None` where no crest is in reach.
    pub(crate) fn new(
        matched: &MatchedLevel<'_>,
        row: SVector<f64, N>,
        weight: f64,
        place: &EdgePlace,
        reach: usize,
    ) -> Option<Self> {
        let mut sighting = Self { row, weight, crests: [(0.0, 0.0); MAX_CRESTS], num_crests: 0 };
        sighting.look(matched, place, reach);
        (sighting.num_crests > 0).then_some(sighting)
    }

    /// Finds the crests of the gradient's part along the normal, the nearest first kept.
    fn look(&mut self, matched: &MatchedLevel<'_>, &EdgePlace { at, normal, double }: &EdgePlace, reach: usize) {
        const MAX_LEN: usize = 2 * FIRST_REACH + 3;
        let len = 2 * reach + 3;
        let middle = (reach + 1) as f32;
        let floor = matched.image_level.floor();
        // Of the gradient's strength: roots are taken of crests alone.
        let mut squares = [0.0f32; MAX_LEN];
        let mut trusts = [0.0f32; MAX_LEN];
        for k in 0..len {
            let t = k as f32 - middle;
            // Beyond the border there is no crest.
            if let Some([dx, dy, energy]) = matched.image_level.bilinear(at[0] + t * normal[0], at[1] + t * normal[1]) {
                trusts[k] = (dx * double[0] + dy * double[1]).max(0.0);
                squares[k] = trusts[k] * (energy + floor);
            }
        }
        for k in 1..len - 1 {
            if squares[k] < squares[k - 1] || squares[k] <= squares[k + 1] || trusts[k] < MIN_TRUST {
                continue;
            }
            let [before, here, after] = [squares[k - 1], squares[k], squares[k + 1]].map(f32::sqrt);
            let distance = f64::from(k as f32 - middle + parabola_peak(before, here, after));
            let crest = (distance, f64::from(trusts[k]));
            if self.num_crests < MAX_CRESTS {
                self.crests[self.num_crests] = crest;
                self.num_crests += 1;
            } else if let Some(furthest) = self.crests.iter_mut().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
                && distance.abs() < furthest.0.abs()
            {
                *furthest = crest;
            }
        }
    }

    /// Residual, and the share in the consensus, of the crest that fits `step` best.
    #[inline]
    fn best_crest(&self, step: &SVector<f64, N>, width: f64) -> (f64, f64) {
        let moved = self.row.dot(step);
        let mut best = (0.0, 0.0);
        for &(distance, trust) in &self.crests[..self.num_crests] {
            let share = trust * kernel((distance - moved) / width);
            if share > best.1 {
                best = (distance, share);
            }
        }
        best
    }
}

/// Tukey's biweight, 1 at 0 and 0 beyond 3 widths: no exponential, no far influence.
#[inline]
fn kernel(x: f64) -> f64 {
    let rest = (1.0 - x * x / 9.0).max(0.0);
    rest * rest
}

/// The step of most consensus from any of the starts; those that have come to the same place go on as one.
fn best_fit(sightings: &[Sighting<4>], is_free: [bool; 4], mut steps: Vec<Vector4<f64>>) -> (Vector4<f64>, f64) {
    for width in &WIDTHS {
        let mut fitted: Vec<Vector4<f64>> = Vec::with_capacity(steps.len());
        for step in steps {
            let step = fit_offsets(sightings, is_free, step, std::slice::from_ref(width));
            if fitted.iter().all(|other| (other - step).amax() > SAME_PLACE) {
                fitted.push(step);
            }
        }
        steps = fitted;
    }
    let scored = steps.into_iter().map(|step| (step, consensus_at(sightings, &step)));
    scored.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Vector4::zeros(), 0.0))
}

/// No movement, and one step each way by shift and by scale.
fn starts(is_free: [bool; 4], first: Starts) -> Vec<Vector4<f64>> {
    let mut starts = vec![Vector4::zeros()];
    let directions: &[usize] = if first == Starts::Around { &[0, 1, 3] } else { &[] };
    for &k in directions {
        if is_free[k] {
            for sign in [1.0, -1.0] {
                let mut start = Vector4::zeros();
                start[k] = sign * START_STEP;
                starts.push(start);
            }
        }
    }
    starts
}

/// The weighted normal equations of the crests that fit `step` best: the matrix, of which the lower triangle alone is filled
/// (nothing above it is read), and the right-hand side.
fn normal_equations<const N: usize>(
    sightings: &[Sighting<N>],
    step: &SVector<f64, N>,
    width: f64,
) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    let mut lower = [[0.0; N]; N];
    let mut right = [0.0; N];
    for sighting in sightings {
        let (distance, share) = sighting.best_crest(step, width);
        let weight = sighting.weight * share;
        if weight > 0.0 {
            let rest = distance - sighting.row.dot(step);
            for (i, (lower, right)) in lower.iter_mut().zip(&mut right).enumerate() {
                let weighted = sighting.row[i] * weight;
                *right += weighted * rest;
                for (sum, other) in lower.iter_mut().zip(sighting.row.iter()).take(i + 1) {
                    *sum += weighted * other;
                }
            }
        }
    }
    (SMatrix::from_fn(|i, j| lower[i][j]), SVector::from(right))
}

/// Weighted share of the sightings that have a crest at a step.
pub(crate) fn consensus_at<const N: usize>(sightings: &[Sighting<N>], step: &SVector<f64, N>) -> f64 {
    let width = WIDTHS[WIDTHS.len() - 1];
    sightings.iter().map(|sighting| sighting.weight * sighting.best_crest(step, width).1).sum()
}

/// Iteratively re-weighted least squares from `start`, narrowing.
pub(crate) fn fit_offsets<const N: usize>(
    sightings: &[Sighting<N>],
    is_free: [bool; N],
    start: SVector<f64, N>,
    widths: &[f64],
) -> SVector<f64, N>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut step = start;
    for &width in widths {
        for _ in 0..2 {
            let (mut normal_matrix, right) = normal_equations(sightings, &step, width);
            // Directions that no edge holds (the angle of a ring) stay where they are. The share was chosen by hand.
            normal_matrix += SMatrix::<f64, N, N>::identity() * (2e-3 * normal_matrix.trace()).max(1e-9);
            for k in 0..N {
                if !is_free[k] {
                    normal_matrix[(k, k)] += 1e9;
                }
            }
            let Some(cholesky) = normal_matrix.cholesky() else { break };
            step += cholesky.solve(&right);
        }
    }
    step
}
