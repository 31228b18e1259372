//! The cut of minimum cost through a picture, as a convex problem.
//!
//! Minimises Σ weight · |∇share| + Σ evidence · share over shares in [0, 1]. The pixels whose share in a minimiser is
//! above one half form a cut of minimum cost among all cuts (Chan, Esedoglu, Nikolova 2006).
//!
//! # Source
//! Chambolle and Pock, "A first-order primal-dual algorithm for convex problems with applications to imaging", 2011,
//! algorithm 1, with both steps at their bound for the gradient's norm, √8.

use super::lab::Lab;

/// Evidence of a pixel that cannot belong to the part, for any colour.
pub(crate) const SURELY_OUTSIDE: f32 = 1e3;
/// Cost of a boundary in a flat area of the picture, per pixel of its length.
const BOUNDARY_COST: f32 = 10.0;
/// Fraction of [`BOUNDARY_COST`] that remains on the strongest edges; it keeps outlines smooth.
const MIN_COST_SHARE: f32 = 0.05;
/// Number of passes over the picture.
const PASSES: usize = 60;
/// Step length of both variables, 1 / √8.
const STEP: f32 = 0.353_553_4;

/// The cost of a boundary at each pixel: low at edges of the picture.
pub(crate) struct Edges {
    width: usize,
    cost: Vec<f32>,
}

impl Edges {
    /// From the colours of a picture, row by row.
    pub fn new(colors: &[Lab], width: usize) -> Self {
        // To the right and down, like the gradient of the shares.
        let contrast = |at: usize| {
            let right =
                if !(at + 1).is_multiple_of(width) { colors[at].distance_squared(&colors[at + 1]) } else { 0.0 };
            let down = colors.get(at + width).map_or(0.0, |below| colors[at].distance_squared(below));
            right + down
        };
        let contrasts: Vec<f32> = (0..colors.len()).map(contrast).collect();
        let mean = contrasts.iter().sum::<f32>() / contrasts.len().max(1) as f32;
        let softness = 1.0 / (2.0 * mean).max(f32::MIN_POSITIVE);
        let cost = contrasts
            .iter()
            .map(|c| BOUNDARY_COST * (MIN_COST_SHARE + (1.0 - MIN_COST_SHARE) * (-softness * c).exp()))
            .collect();
        Self { width, cost }
    }

    /// The strength of the edge at a pixel, in [0, 1].
    pub fn strength(&self, at: usize) -> f32 {
        (1.0 - self.cost[at] / BOUNDARY_COST) / (1.0 - MIN_COST_SHARE)
    }
}

/// Moves `share` to the cut of minimum cost, starting from its present values.
pub(crate) fn minimal_cut(evidence: &[f32], edges: &Edges, share: &mut [f32]) {
    let (width, count) = (edges.width, share.len());
    let mut dual_x = vec![0.0f32; count];
    let mut dual_y = vec![0.0f32; count];
    let mut ahead = share.to_vec();
    for _ in 0..PASSES {
        for row in (0..count).step_by(width) {
            let last_row = row + width >= count;
            for at in row..row + width {
                let right = if at + 1 < row + width { ahead[at + 1] - ahead[at] } else { 0.0 };
                let down = if last_row { 0.0 } else { ahead[at + width] - ahead[at] };
                let (x, y) = (dual_x[at] + STEP * right, dual_y[at] + STEP * down);
                let shorten = (edges.cost[at] / (x * x + y * y).sqrt().max(f32::MIN_POSITIVE)).min(1.0);
                dual_x[at] = x * shorten;
                dual_y[at] = y * shorten;
            }
        }
        for row in (0..count).step_by(width) {
            for at in row..row + width {
                let from_left = if at > row { dual_x[at - 1] } else { 0.0 };
                let from_above = if row > 0 { dual_y[at - width] } else { 0.0 };
                let divergence = dual_x[at] - from_left + dual_y[at] - from_above;
                let before = share[at];
                let after = (before + STEP * (divergence - evidence[at])).clamp(0.0, 1.0);
                share[at] = after;
                ahead[at] = 2.0 * after - before;
            }
        }
    }
}
