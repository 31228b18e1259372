//! How well the directions of a template's edge points agree with those of a picture at a pose, computed for several
//! points at once.
//!
//! Legend: `s` is the picture's direction at a point and `d` the point's own direction, both at twice their angle; `w`
//! is the point's weight; `R` is the rotation by twice the pose's angle, with its `cos` and `sin`. A point adds
//! `w s · R d = cos (w s · d) + sin (w s.y d.x − w s.x d.y)` to the sum. Both products are added up over all points,
//! and the rotation is applied once.

use pulp::{Simd, WithSimd};
use wide::f32x4;

use crate::edge_points::EdgePoint;
use crate::gradient_field::GradientLevel;
use crate::lanes::{LANES, in_lanes};
use crate::pose::LevelMap;

/// Coordinates of the edge points, padded to whole groups with points of zero weight.
#[derive(Debug, Clone)]
pub(crate) struct PointLanes {
    groups: Vec<PointGroup>,
}

#[derive(Debug, Clone, Copy)]
struct PointGroup {
    x: [f32; LANES],
    y: [f32; LANES],
    weights: [f32; LANES],
    /// `w (d.x, d.y, 0, 0)` and `w (−d.y, d.x, 0, 0)`: four numbers, like a sample, so that x and y are multiplied
    /// together.
    along: [f32x4; LANES],
    across: [f32x4; LANES],
}

impl PointLanes {
    pub(crate) fn new(points: &[EdgePoint]) -> Self {
        let group = |points: &[EdgePoint]| {
            let zeros = [0.0; LANES];
            let mut group = PointGroup {
                x: zeros,
                y: zeros,
                weights: zeros,
                along: [f32x4::ZERO; LANES],
                across: [f32x4::ZERO; LANES],
            };
            for (k, point) in points.iter().enumerate() {
                [group.x[k], group.y[k]] = point.offset;
                group.weights[k] = point.weight;
                let [dx, dy] = point.double.map(|d| point.weight * d);
                group.along[k] = f32x4::new([dx, dy, 0.0, 0.0]);
                group.across[k] = f32x4::new([-dy, dx, 0.0, 0.0]);
            }
            group
        };
        Self { groups: points.chunks(LANES).map(group).collect() }
    }

    /// Weighted sum of cos 2(difference of directions) over the points inside the image, and the sum of their weights.
    pub(crate) fn sums(&self, level: &GradientLevel, map: &LevelMap) -> (f32, f32) {
        in_lanes(Sums { points: self, level, map })
    }
}

struct Sums<'a> {
    points: &'a PointLanes,
    level: &'a GradientLevel,
    map: &'a LevelMap,
}

impl WithSimd for Sums<'_> {
    type Output = (f32, f32);

    /// Plain loops; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (f32, f32) {
        let Self { points, level, map } = self;
        let (mut along, mut across, mut visible) = (f32x4::ZERO, f32x4::ZERO, [0.0f32; LANES]);
        for group in &points.groups {
            let [x, y] = map.apply_all(&group.x, &group.y);
            let mut samples = [f32x4::ZERO; LANES];
            let inside = level.bilinear_all(&x, &y, &mut samples);
            for lane in 0..LANES {
                visible[lane] += inside[lane] * group.weights[lane];
                along += samples[lane] * group.along[lane];
                across += samples[lane] * group.across[lane];
            }
        }
        let [cos, sin] = map.double_turn();
        let [along, across] = [along, across].map(|sums| sums.to_array()[0] + sums.to_array()[1]);
        (cos * along + sin * across, visible.into_iter().sum())
    }
}
