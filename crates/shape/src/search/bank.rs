//! The template at every angle and scale that is tried, as offsets into the look-up tables.

use std::f64::consts::TAU;

use crate::edge_points::EdgePoint;
use crate::search::responses::{NUM_DIRECTIONS, PITCH, SPREAD, direction_idx, table_idx};

/// Largest movement of the outer points from one pose to the next, in level pixels: the image's directions are spread
/// by half of this movement to each side. Derived from the spread.
const POSE_STEP: f64 = 2.0 * SPREAD as f64;

/// One angle and scale.
#[derive(Debug, Clone)]
pub(crate) struct Variant {
    pub(crate) angle_rad: f64,
    pub(crate) log_scale: f64,
    looks: Vec<Look>,
}

/// One read: the table, and the distance from the part's place, in places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Look {
    table: u8,
    dy: i16,
    dx: i16,
}

/// All angles and scales of one template, ordered by angle.
#[derive(Debug, Clone)]
pub(crate) struct Bank {
    pub(crate) variants: Vec<Variant>,
    /// Number of scales at every angle.
    pub(crate) num_scales: usize,
    /// Step of the angle.
    pub(crate) angle_step_rad: f64,
    /// Largest distance of a read from the part's place, in places.
    pub(crate) reach: usize,
    /// Points of every variant; the largest score of a pose is this many times a full response.
    pub(crate) num_points: usize,
}

impl Bank {
    /// Rotates and scales at most `num_points` of `points`, for a level whose pixel is `pixel_size` demonstration
    /// pixels; `log_scales` are the smallest and the largest ln scale.
    pub(crate) fn new(points: &[EdgePoint], num_points: usize, pixel_size: f64, log_scales: [f64; 2]) -> Self {
        let sampled = sample_by_weight(points, num_points);
        let outer = outer_radius(&sampled) / pixel_size;
        let step = POSE_STEP / outer.max(1.0);
        let num_angles = (TAU / step).ceil().max(8.0) as usize;
        let range = log_scales[1] - log_scales[0];
        let num_scales = (range / step).ceil() as usize + 1;
        let angle_step_rad = TAU / num_angles as f64;
        let log_scale_step = if num_scales > 1 { range / (num_scales - 1) as f64 } else { 0.0 };

        let mut variants = Vec::with_capacity(num_angles * num_scales);
        for angle_idx in 0..num_angles {
            for scale_idx in 0..num_scales {
                // A single scale is in the middle of its range.
                let log_scale = if num_scales > 1 {
                    log_scales[0] + scale_idx as f64 * log_scale_step
                } else {
                    0.5 * (log_scales[0] + log_scales[1])
                };
                variants.push(Variant::new(&sampled, angle_idx as f64 * angle_step_rad, log_scale, pixel_size));
            }
        }
        let reach = variants.iter().flat_map(|v| &v.looks).map(|l| l.dx.unsigned_abs().max(l.dy.unsigned_abs())).max();
        Self { variants, num_scales, angle_step_rad, reach: usize::from(reach.unwrap_or(0)), num_points: sampled.len() }
    }
}

impl Variant {
    fn new(points: &[EdgePoint], angle_rad: f64, log_scale: f64, pixel_size: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let factor = log_scale.exp() / pixel_size;
        let (sin2, cos2) = (2.0 * angle_rad).sin_cos();
        let mut looks: Vec<Look> = points
            .iter()
            .map(|point| {
                let [x, y] = point.offset.map(f64::from);
                let [dx, dy] = point.double.map(f64::from);
                // The part's centre is in the middle of its place.
                let middle = 0.5 * PITCH as f64;
                let col = (factor * (cos * x - sin * y) + middle).floor() as i32;
                let row = (factor * (sin * x + cos * y) + middle).floor() as i32;
                let pitch = PITCH as i32;
                let k = direction_idx([(cos2 * dx - sin2 * dy) as f32, (sin2 * dx + cos2 * dy) as f32]);
                Look {
                    table: table_idx(k, col.rem_euclid(pitch) as usize, row.rem_euclid(pitch) as usize) as u8,
                    dx: col.div_euclid(pitch) as i16,
                    dy: row.div_euclid(pitch) as i16,
                }
            })
            .collect();
        // Sorted, so that consecutive reads are near each other in memory.
        looks.sort_unstable();
        Self { angle_rad, log_scale, looks }
    }

    /// `(table, offset)` of every read, in tables whose rows are `stride` apart.
    pub(crate) fn shifts(&self, stride: usize) -> Vec<(usize, isize)> {
        self.looks
            .iter()
            .map(|look| (usize::from(look.table), isize::from(look.dy) * stride as isize + isize::from(look.dx)))
            .collect()
    }
}

/// At most `count` points, each repeated in proportion to its weight, because equal weights can be summed in bytes.
fn sample_by_weight(points: &[EdgePoint], count: usize) -> Vec<EdgePoint> {
    let total: f64 = points.iter().map(|p| f64::from(p.weight)).sum();
    let mut sampled = Vec::with_capacity(count);
    let mut passed = 0.0;
    for point in points {
        passed += f64::from(point.weight) / total * count as f64;
        while (sampled.len() as f64) + 0.5 < passed && sampled.len() < count {
            sampled.push(*point);
        }
    }
    sampled
}

/// Distance from the centre within which nine points of ten lie, in demonstration pixels. The share was chosen by hand;
/// with it a single distant point does not make all steps small.
fn outer_radius(points: &[EdgePoint]) -> f64 {
    let mut radii: Vec<f64> = points.iter().map(|p| f64::from(p.offset[0]).hypot(f64::from(p.offset[1]))).collect();
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() * 9 / 10).copied().unwrap_or(0.0)
}

const _: () = assert!(NUM_DIRECTIONS * PITCH * PITCH <= 256, "tables are numbered in a byte");
