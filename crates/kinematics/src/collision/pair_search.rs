//! The smallest distance between the arm and all bodies around it, for the configurations of all lanes.
//!
//! Bodies are compared as spheres; with an obstacle, each capsule is then compared as a sphere around its centre. The
//! exact distance is computed only if these bounds are not sufficient.
#![allow(clippy::needless_range_loop, reason = "one index for the lanes of several arrays")]

use super::arm_shape::{FIRST_MOVING, NUM_BODIES};
use super::lanes::{
    FrameLanes, Lane, Lane3, NUM_LANES, ToLocal, link_frames, point_distances, segment_distances,
    segment_shape_distances, shape_distances,
};
use super::model::CollisionModel;
use super::shape::{self, DistanceAndSlope, Shape};
use crate::joints::{JointVector, NUM_JOINTS};

/// Positions of the bodies' spheres and capsules, for each lane.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    balls: [Lane3; NUM_BODIES],
    capsules: [Vec<(Lane3, Lane3)>; NUM_BODIES],
}

impl Placed {
    /// Allocates memory for the bodies of a model, which [`evaluate`] fills.
    pub(super) fn new(model: &CollisionModel) -> Self {
        let capsules = std::array::from_fn(|body| vec![(Lane3::ZERO, Lane3::ZERO); model.arm.capsules[body].len()]);
        Self { balls: [Lane3::ZERO; NUM_BODIES], capsules }
    }
}

/// Factors by which distances are multiplied before the minimum is taken: for each pair of the arm's bodies, and for
/// each body and the obstacles.
#[derive(Debug, Clone)]
pub(super) struct Weights {
    pub(super) self_pairs: [[f64; NUM_BODIES]; NUM_BODIES],
    pub(super) bodies: [f64; NUM_BODIES],
    /// Length that is added to each distance before the multiplication, m.
    pub(super) offset_m: f64,
}

impl Weights {
    pub(super) const DISTANCES: Self =
        Self { self_pairs: [[1.0; NUM_BODIES]; NUM_BODIES], bodies: [1.0; NUM_BODIES], offset_m: 0.0 };
}

/// The result of each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// The smallest weighted distance.
    pub(super) least: Lane,
    /// Whether a distance is below the margin.
    pub(super) is_blocked: [bool; NUM_LANES],
}

/// Compares all pairs. With `until_blocked`, it ends as soon as a lane is blocked.
#[inline(always)]
pub(super) fn evaluate(
    model: &CollisionModel,
    margin_m: f64,
    placed: &mut Placed,
    q: &[JointVector; NUM_LANES],
    weights: &Weights,
    until_blocked: bool,
) -> Found {
    place(model, placed, q);
    let mut search = Search {
        margin_m,
        offset_m: weights.offset_m,
        found: Found { least: [f64::INFINITY; NUM_LANES], is_blocked: [false; NUM_LANES] },
    };
    for (index, obstacle) in model.obstacles.iter().enumerate() {
        let to_local = &model.obstacle_frames[index];
        match obstacle.shape {
            Shape::Plane => {
                search.obstacle(model, placed, index, to_local, weights, shape::plane);
            }
            Shape::Box { half_m } => {
                search.obstacle(model, placed, index, to_local, weights, |p, d| shape::solid_box(p, d, half_m));
            }
            Shape::Cylinder { radius_m, half_length_m } => {
                search.obstacle(model, placed, index, to_local, weights, |p, d| {
                    shape::cylinder(p, d, radius_m, half_length_m)
                });
            }
            Shape::Capsule { radius_m, half_length_m } => {
                search.obstacle(model, placed, index, to_local, weights, |p, d| {
                    shape::capsule(p, d, radius_m, half_length_m)
                });
            }
        }
        if until_blocked && search.is_any_blocked() {
            return search.found;
        }
    }
    search.self_pairs(model, placed, weights);
    search.found
}

#[inline(always)]
fn place(model: &CollisionModel, placed: &mut Placed, q: &[JointVector; NUM_LANES]) {
    let frames = link_frames(&model.geometry.joints, q);
    for body in 0..NUM_BODIES {
        let frame = if body == 0 { FrameLanes::base() } else { frames[body.min(NUM_JOINTS) - 1] };
        placed.balls[body] = frame.place(model.arm.bounds[body].0.coords.into());
        for (out, capsule) in placed.capsules[body].iter_mut().zip(&model.arm.capsules[body]) {
            *out = (frame.place(capsule.from.coords.into()), frame.place(capsule.to.coords.into()));
        }
    }
}

struct Search {
    margin_m: f64,
    offset_m: f64,
    found: Found,
}

impl Search {
    /// Whether lower bounds of the distances, `bounds - radius_m`, exclude in every lane both a smaller weighted
    /// distance and a distance below the margin.
    #[inline(always)]
    fn can_skip(&self, bounds: &Lane, radius_m: f64, weight: f64) -> bool {
        let mut is_needed = false;
        for i in 0..NUM_LANES {
            let bound = bounds[i] - radius_m;
            is_needed |= (bound + self.offset_m) * weight < self.found.least[i] || bound < self.margin_m;
        }
        !is_needed
    }

    #[inline(always)]
    fn take(&mut self, distances: &Lane, radius_m: f64, weight: f64) {
        for i in 0..NUM_LANES {
            let distance_m = distances[i] - radius_m;
            let weighted = (distance_m + self.offset_m) * weight;
            self.found.least[i] = if weighted < self.found.least[i] { weighted } else { self.found.least[i] };
            self.found.is_blocked[i] |= distance_m < self.margin_m;
        }
    }

    #[inline(always)]
    fn is_any_blocked(&self) -> bool {
        self.found.is_blocked.iter().any(|&is_blocked| is_blocked)
    }

    #[inline(always)]
    fn obstacle(
        &mut self,
        model: &CollisionModel,
        placed: &Placed,
        index: usize,
        to_local: &ToLocal,
        weights: &Weights,
        shape: impl Fn([f64; 3], [f64; 3]) -> DistanceAndSlope + Copy,
    ) {
        // In the order from the held part to link 1, because the outer bodies are close to an obstacle most often.
        for body in (FIRST_MOVING..NUM_BODIES).rev() {
            let capsules = &model.arm.capsules[body];
            let allowed_m = model.allowed_overlap_m[body][index];
            if allowed_m.is_infinite() || capsules.is_empty() {
                continue;
            }
            let weight = weights.bodies[body];
            let ball = shape_distances(&to_local.apply(&placed.balls[body]), shape);
            if self.can_skip(&ball, model.arm.bounds[body].1 - allowed_m, weight) {
                continue;
            }
            for (capsule, (from, to)) in capsules.iter().zip(&placed.capsules[body]) {
                let local = (to_local.apply(from), to_local.apply(to));
                let middle = shape_distances(&middle(&local), shape);
                let half_length_m = 0.5 * (capsule.to - capsule.from).norm();
                if self.can_skip(&middle, half_length_m + capsule.radius_m - allowed_m, weight) {
                    continue;
                }
                self.take(&segment_shape_distances(&local, shape), capsule.radius_m - allowed_m, weight);
            }
        }
    }

    #[inline(always)]
    fn self_pairs(&mut self, model: &CollisionModel, placed: &Placed, weights: &Weights) {
        let arm = &model.arm;
        for &(one, other) in &model.geometry.self_pairs {
            let (ones, others) = (&arm.capsules[one], &arm.capsules[other]);
            if others.is_empty() {
                continue;
            }
            let weight = weights.self_pairs[one][other];
            let balls = point_distances(&placed.balls[one], &placed.balls[other]);
            if self.can_skip(&balls, arm.bounds[one].1 + arm.bounds[other].1, weight) {
                continue;
            }
            for (a, a_placed) in ones.iter().zip(&placed.capsules[one]) {
                for (b, b_placed) in others.iter().zip(&placed.capsules[other]) {
                    self.take(&segment_distances(a_placed, b_placed), a.radius_m + b.radius_m, weight);
                }
            }
        }
    }
}

#[inline(always)]
fn middle(segment: &(Lane3, Lane3)) -> Lane3 {
    let mut middle = Lane3::ZERO;
    for i in 0..NUM_LANES {
        middle.x[i] = 0.5 * (segment.0.x[i] + segment.1.x[i]);
        middle.y[i] = 0.5 * (segment.0.y[i] + segment.1.y[i]);
        middle.z[i] = 0.5 * (segment.0.z[i] + segment.1.z[i]);
    }
    middle
}
