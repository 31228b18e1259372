//! The arm at several configurations in parallel, one for each SIMD lane: arrays of one coordinate each, which the
//! compiler vectorises.
//!
//! The inner loops run over the lanes and avoid branches.
#![allow(clippy::needless_range_loop, reason = "one index for the lanes of several arrays")]

use crate::capsule::nearest_shares;
use crate::geometry::DhJoint;
use crate::joints::{JointVector, NUM_JOINTS};

use super::shape::DistanceAndSlope;

/// Number of configurations computed in parallel.
pub const NUM_LANES: usize = 8;

/// One number for each lane.
pub(super) type Lane = [f64; NUM_LANES];

/// One point or vector for each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lane3 {
    pub(super) x: Lane,
    pub(super) y: Lane,
    pub(super) z: Lane,
}

impl Lane3 {
    pub(super) const ZERO: Self = Self { x: [0.0; NUM_LANES], y: [0.0; NUM_LANES], z: [0.0; NUM_LANES] };

    #[inline(always)]
    pub(super) fn repeat(p: [f64; 3]) -> Self {
        Self { x: [p[0]; NUM_LANES], y: [p[1]; NUM_LANES], z: [p[2]; NUM_LANES] }
    }

    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> [f64; 3] {
        [self.x[lane], self.y[lane], self.z[lane]]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, p: [f64; 3]) {
        (self.x[lane], self.y[lane], self.z[lane]) = (p[0], p[1], p[2]);
    }
}

/// A frame in the base frame: its axes and its origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameLanes {
    axes: [Lane3; 3],
    origin: Lane3,
}

impl FrameLanes {
    /// The base frame itself.
    pub(super) fn base() -> Self {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Lane3::repeat);
        Self { axes, origin: Lane3::ZERO }
    }

    /// A point of this frame in the base frame.
    #[inline(always)]
    pub(super) fn place(&self, p: [f64; 3]) -> Lane3 {
        let mut placed = Lane3::ZERO;
        let [a, b, c] = &self.axes;
        for i in 0..NUM_LANES {
            placed.x[i] = self.origin.x[i] + a.x[i] * p[0] + b.x[i] * p[1] + c.x[i] * p[2];
            placed.y[i] = self.origin.y[i] + a.y[i] * p[0] + b.y[i] * p[1] + c.y[i] * p[2];
            placed.z[i] = self.origin.z[i] + a.z[i] * p[0] + b.z[i] * p[1] + c.z[i] * p[2];
        }
        placed
    }
}

/// The frames of links 1 to 7; see `geometry.rs` for the convention.
#[inline(always)]
pub(super) fn link_frames(joints: &[DhJoint; NUM_JOINTS], q: &[JointVector; NUM_LANES]) -> [FrameLanes; NUM_JOINTS] {
    let mut frames = [FrameLanes::base(); NUM_JOINTS];
    let mut parent = FrameLanes::base();
    for joint_idx in 0..NUM_JOINTS {
        let (mut sine, mut cosine) = ([0.0; NUM_LANES], [0.0; NUM_LANES]);
        for i in 0..NUM_LANES {
            (sine[i], cosine[i]) = q[i][joint_idx].sin_cos();
        }
        // alpha is 0 or ±90°, so the rotated axes are the parent's in another order and with other signs.
        let (sin_alpha, cos_alpha) = joints[joint_idx].twist();
        let (a, d) = (joints[joint_idx].a_m, joints[joint_idx].d_m);
        let mut next = FrameLanes::base();
        for (of, from_x, from_y, from_z, origin, parent_origin) in [
            (0, parent.axes[0].x, parent.axes[1].x, parent.axes[2].x, &mut next.origin.x, &parent.origin.x),
            (1, parent.axes[0].y, parent.axes[1].y, parent.axes[2].y, &mut next.origin.y, &parent.origin.y),
            (2, parent.axes[0].z, parent.axes[1].z, parent.axes[2].z, &mut next.origin.z, &parent.origin.z),
        ] {
            let [x_axis, y_axis, z_axis] = &mut next.axes;
            let (x_out, y_out, z_out) = match of {
                0 => (&mut x_axis.x, &mut y_axis.x, &mut z_axis.x),
                1 => (&mut x_axis.y, &mut y_axis.y, &mut z_axis.y),
                _ => (&mut x_axis.z, &mut y_axis.z, &mut z_axis.z),
            };
            for i in 0..NUM_LANES {
                let y = from_y[i] * cos_alpha + from_z[i] * sin_alpha;
                let z = from_z[i] * cos_alpha - from_y[i] * sin_alpha;
                origin[i] = parent_origin[i] + from_x[i] * a + z * d;
                x_out[i] = from_x[i] * cosine[i] + y * sine[i];
                y_out[i] = y * cosine[i] - from_x[i] * sine[i];
                z_out[i] = z;
            }
        }
        frames[joint_idx] = next;
        parent = next;
    }
    frames
}

/// Distances between segments.
#[inline(always)]
pub(super) fn segment_distances(a: &(Lane3, Lane3), b: &(Lane3, Lane3)) -> Lane {
    let mut distances = [0.0; NUM_LANES];
    for (i, distance) in distances.iter_mut().enumerate() {
        let (a0, a1, b0, b1) = (a.0.at(i), a.1.at(i), b.0.at(i), b.1.at(i));
        let u = [a1[0] - a0[0], a1[1] - a0[1], a1[2] - a0[2]];
        let v = [b1[0] - b0[0], b1[1] - b0[1], b1[2] - b0[2]];
        let w = [a0[0] - b0[0], a0[1] - b0[1], a0[2] - b0[2]];
        let (s, t) = nearest_shares(u, v, w);
        let apart = [w[0] + u[0] * s - v[0] * t, w[1] + u[1] * s - v[1] * t, w[2] + u[2] * s - v[2] * t];
        *distance = (apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]).sqrt();
    }
    distances
}

/// Distances between points.
#[inline(always)]
pub(super) fn point_distances(a: &Lane3, b: &Lane3) -> Lane {
    let mut distances = [0.0; NUM_LANES];
    for i in 0..NUM_LANES {
        let (x, y, z) = (a.x[i] - b.x[i], a.y[i] - b.y[i], a.z[i] - b.z[i]);
        distances[i] = (x * x + y * y + z * z).sqrt();
    }
    distances
}

/// The inverse of a fixed frame: rows of its rotation, and its origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct ToLocal {
    pub(super) rows: [[f64; 3]; 3],
    pub(super) origin: [f64; 3],
}

impl ToLocal {
    /// Points of the base frame in the fixed frame.
    #[inline(always)]
    pub(super) fn apply(&self, p: &Lane3) -> Lane3 {
        let mut local = Lane3::ZERO;
        let [r0, r1, r2] = self.rows;
        for i in 0..NUM_LANES {
            let (x, y, z) = (p.x[i] - self.origin[0], p.y[i] - self.origin[1], p.z[i] - self.origin[2]);
            local.x[i] = r0[0] * x + r0[1] * y + r0[2] * z;
            local.y[i] = r1[0] * x + r1[1] * y + r1[2] * z;
            local.z[i] = r2[0] * x + r2[1] * y + r2[2] * z;
        }
        local
    }
}

/// Signed distances of points to a shape in its own frame.
#[inline(always)]
pub(super) fn shape_distances(points: &Lane3, shape: impl Fn([f64; 3], [f64; 3]) -> DistanceAndSlope) -> Lane {
    let mut distances = [0.0; NUM_LANES];
    for (i, distance) in distances.iter_mut().enumerate() {
        *distance = shape(points.at(i), [0.0; 3]).0;
    }
    distances
}

/// Smallest signed distances of segments to a shape in its own frame, too large by at most 2⁻¹³ of the segment's
/// length.
#[inline(always)]
pub(super) fn segment_shape_distances(
    segment: &(Lane3, Lane3),
    shape: impl Fn([f64; 3], [f64; 3]) -> DistanceAndSlope,
) -> Lane {
    const NUM_BISECTIONS: usize = 12;
    let mut direction = Lane3::ZERO;
    for i in 0..NUM_LANES {
        let (from, to) = (segment.0.at(i), segment.1.at(i));
        direction.set(i, [to[0] - from[0], to[1] - from[1], to[2] - from[2]]);
    }
    let mut share = [0.5; NUM_LANES];
    let mut step = 0.25;
    let point = |i: usize, share: f64| {
        let (from, along) = (segment.0.at(i), direction.at(i));
        [from[0] + along[0] * share, from[1] + along[1] * share, from[2] + along[2] * share]
    };
    for _ in 0..NUM_BISECTIONS {
        for i in 0..NUM_LANES {
            let slope = shape(point(i, share[i]), direction.at(i)).1;
            share[i] += if slope > 0.0 { -step } else { step };
        }
        step *= 0.5;
    }
    let mut distances = [0.0; NUM_LANES];
    for i in 0..NUM_LANES {
        distances[i] = shape(point(i, share[i]), [0.0; 3]).0;
    }
    distances
}
