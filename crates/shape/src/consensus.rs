//! The pose on which most edge points agree to a fraction of a pixel.
//!
//! Beside the part's own edge an image often shows another of the same direction: the edge of its
//! shadow, its chamfer, a board next to it. Least squares on the nearest edges ends between the two.
//! Here each edge point keeps all gradient crests near it along its normal, and the search maximises
//! the number of points that have *one* of their crests within a pixel. A shadow lies on one side only,
//! so a pose that follows it there loses the other sides.
//!
//! Legend: `row` is how far a point moves along its normal per unit of (x, y, angle, ln scale), in
//! units that move edges by about a level pixel; a crest at distance `d` requires `row · step = d`.

use nalgebra::{Const, DimMin, SMatrix, SVector, Vector4};
use pulp::{Simd, WithSimd};

use crate::capture_range::{CaptureRange, step_units};
use crate::edge_points::EdgePoint;
use crate::lanes::{LANES, in_lanes, larger};
use crate::pose::Pose;
use crate::sightings::{EdgePlace, FIRST_REACH, Group, LATER_REACH, Sightings};
use crate::template::{MatchedLevel, TemplateLevel};

/// Widths of the kernel that decides whether a crest counts, in level pixels, from the first fit to the last. Chosen by
/// hand, not measured.
pub(crate) const WIDTHS: [f64; 3] = [2.0, 1.2, 0.7];
/// Distance of the starts of the first round from the pose, in level pixels of edge movement by shift and by scale.
/// Chosen by hand, not measured.
const START_STEP: f64 = 3.0;
/// Maximum rounds of gathering crests. Chosen by hand to save time, not measured.
const MAX_ROUNDS: usize = 5;
/// Movement in level pixels below which the rounds stop. Chosen by hand to save time, not measured.
const CONVERGED_PX: f64 = 0.01;
/// Steps that differ by less, in level pixels, are treated as one. Chosen by hand to save time.
const MERGE_PX: f64 = 0.02;

/// A pose and the share of points with a crest there.
pub(crate) struct Snapped {
    pub(crate) pose: Pose,
    /// Weighted share of the points that lie on a crest of their direction, in `[0, 1]`.
    pub(crate) score: f64,
    pub(crate) num_rounds: usize,
}

/// Starts of the first round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Starts {
    /// At the pose itself and one step to each side, so that an edge beside the part's own does not capture it.
    Around,
    /// At the pose itself only, for a fifth of the time: its error is known to be about a pixel.
    Here,
}

/// Moves `from` to the nearby consensus.
pub(crate) fn snap(level: &TemplateLevel, matched: &MatchedLevel<'_>, range: &CaptureRange, from: Pose) -> Snapped {
    snap_from(level, matched, range, from, Starts::Around)
}

/// As [`snap`], from the starts `first`.
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
        if step.amax() < CONVERGED_PX {
            break;
        }
    }
    best
}

fn gather(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Pose, reach: usize) -> Sightings<4> {
    let map = pose.level_map(matched.image_pixel_size);
    let radius = (level.radius_px * pose.log_scale.exp() / matched.image_pixel_size).max(1.0) as f32;
    let [center_x, center_y] = map.apply([0.0, 0.0]);
    let place = |point: &EdgePoint| {
        let [x, y] = map.apply(point.offset);
        let [nx, ny] = map.turn(point.normal);
        let (rx, ry) = ((x - center_x) / radius, (y - center_y) / radius);
        let row = [nx, ny, ny * rx - nx * ry, nx * rx + ny * ry];
        EdgePlace { at: [x, y], normal: [nx, ny], double: map.turn_double(point.double), row, weight: point.weight }
    };
    let places: Vec<EdgePlace<4>> = level.points.iter().map(place).collect();
    Sightings::gather(matched.image_level, &places, reach)
}

/// The step of highest consensus from any of the starts; starts that converge to the same step are merged.
fn best_fit(sightings: &Sightings<4>, is_free: [bool; 4], mut steps: Vec<Vector4<f64>>) -> (Vector4<f64>, f64) {
    for width in &WIDTHS {
        let mut fitted: Vec<Vector4<f64>> = Vec::with_capacity(steps.len());
        for step in steps {
            let step = fit_offsets(sightings, is_free, step, std::slice::from_ref(width));
            if fitted.iter().all(|other| (other - step).amax() > MERGE_PX) {
                fitted.push(step);
            }
        }
        steps = fitted;
    }
    let scored = steps.into_iter().map(|step| (step, consensus_at(sightings, &step)));
    scored.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Vector4::zeros(), 0.0))
}

/// No movement; with [`Starts::Around`], also one step each way by shift and by scale.
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

/// Tukey's biweight, 1 at 0 and 0 beyond 3 widths: needs no exponential and ignores distant residuals.
#[inline(always)]
fn kernel(x: f32) -> f32 {
    let rest = larger(1.0 - x * x / 9.0, 0.0);
    rest * rest
}

/// For each point, the residual and the weighted consensus share of its crest that fits a step best.
#[inline(always)]
fn best_crests<const N: usize>(group: &Group<N>, step: &[f32; N], width: f32) -> ([f32; LANES], [f32; LANES]) {
    let (mut rests, mut shares) = ([0.0f32; LANES], [0.0f32; LANES]);
    let mut moved = [0.0f32; LANES];
    for (row, step) in group.rows.iter().zip(step) {
        for lane in 0..LANES {
            moved[lane] += row[lane] * step;
        }
    }
    for (distances, trusts) in group.distances.iter().zip(&group.trusts) {
        for lane in 0..LANES {
            let rest = distances[lane] - moved[lane];
            let share = trusts[lane] * kernel(rest / width);
            let is_better = share > shares[lane];
            rests[lane] = if is_better { rest } else { rests[lane] };
            shares[lane] = if is_better { share } else { shares[lane] };
        }
    }
    for (share, weight) in shares.iter_mut().zip(&group.weights) {
        *share *= weight;
    }
    (rests, shares)
}

/// The weighted normal equations of the crests that fit a step best: the matrix (only the lower triangle is filled and
/// read) and the right-hand side.
struct NormalEquations<'a, const N: usize> {
    sightings: &'a Sightings<N>,
    step: [f32; N],
    width: f32,
}

impl<const N: usize> WithSimd for NormalEquations<'_, N> {
    type Output = ([[f32; N]; N], [f32; N]);

    /// Plain loops; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut lower = [[[0.0f32; LANES]; N]; N];
        let mut right = [[0.0f32; LANES]; N];
        for group in &self.sightings.groups {
            let (rests, weights) = best_crests(group, &self.step, self.width);
            for i in 0..N {
                let weighted: [f32; LANES] = std::array::from_fn(|lane| group.rows[i][lane] * weights[lane]);
                for lane in 0..LANES {
                    right[i][lane] += weighted[lane] * rests[lane];
                }
                for (sums, row) in lower[i].iter_mut().zip(&group.rows).take(i + 1) {
                    for lane in 0..LANES {
                        sums[lane] += weighted[lane] * row[lane];
                    }
                }
            }
        }
        (lower.map(|row| row.map(sum)), right.map(sum))
    }
}

struct Consensus<'a, const N: usize> {
    sightings: &'a Sightings<N>,
    step: [f32; N],
    width: f32,
}

impl<const N: usize> WithSimd for Consensus<'_, N> {
    type Output = f32;

    /// As in [`NormalEquations`].
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        let mut sums = [0.0f32; LANES];
        for group in &self.sightings.groups {
            let (_, shares) = best_crests(group, &self.step, self.width);
            for lane in 0..LANES {
                sums[lane] += shares[lane];
            }
        }
        sum(sums)
    }
}

#[inline(always)]
fn sum(lanes: [f32; LANES]) -> f32 {
    lanes.into_iter().sum()
}

fn in_single<const N: usize>(step: &SVector<f64, N>) -> [f32; N] {
    std::array::from_fn(|k| step[k] as f32)
}

/// Weighted share of the sightings that have a crest at a step.
pub(crate) fn consensus_at<const N: usize>(sightings: &Sightings<N>, step: &SVector<f64, N>) -> f64 {
    let width = WIDTHS[WIDTHS.len() - 1] as f32;
    f64::from(in_lanes(Consensus { sightings, step: in_single(step), width }))
}

/// Iteratively re-weighted least squares from `start`, with decreasing width.
pub(crate) fn fit_offsets<const N: usize>(
    sightings: &Sightings<N>,
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
            let equations = NormalEquations { sightings, step: in_single(&step), width: width as f32 };
            let (lower, right) = in_lanes(equations);
            let mut normal_matrix = SMatrix::<f64, N, N>::from_fn(|i, j| f64::from(lower[i][j]));
            let right = SVector::<f64, N>::from_fn(|i, _| f64::from(right[i]));
            // Directions that no edge constrains (the angle of a ring) are not changed. The factor was chosen by hand.
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
