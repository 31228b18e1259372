//! The grasp of a part by a parallel gripper: two marks along the part, with jaws that close across their line.

use sdg_geometry::RotationalSymmetry;

use crate::relief::Relief;

/// Maximum opening of the jaws for a grasp, in millimetres.
pub(crate) const MAX_JAW_WIDTH_MM: f32 = 76.0;

/// Number of line directions tried over half a turn.
const NUM_DIRECTIONS: usize = 24;

/// Half of the pads' width along the line, in millimetres, if the part is long enough.
const HALF_PAD_MM: f32 = 8.0;

/// A grasp in the part's frame, in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartGrasp {
    /// First mark.
    pub start: [f32; 2],
    /// Second mark.
    pub end: [f32; 2],
    /// Width of the part between the jaws, in millimetres.
    pub jaw_width_mm: f32,
    /// Height of the marks above the table, in millimetres.
    pub height_mm: f32,
}

/// The best grasp; `None` if the part is too wide everywhere or, for a part with rotational symmetry, at its centre.
pub(crate) fn find(relief: &Relief, center: [f32; 2], symmetry: RotationalSymmetry) -> Option<PartGrasp> {
    let level = &relief.levels[2];
    let mut points = Vec::new();
    for y in 0..level.height {
        for x in 0..level.width {
            let texel = level.texels[y * level.width + x];
            if texel.top > 0 {
                points.push((relief.place(level, x, y), texel.top as f32 * relief.step));
            }
        }
    }
    let diagonal = diagonal(points.iter().map(|(place, _)| *place))?;
    let mut best: Option<(f32, PartGrasp)> = None;
    for k in 0..NUM_DIRECTIONS {
        let angle = k as f32 / NUM_DIRECTIONS as f32 * std::f32::consts::PI;
        for (cost, grasp) in along(&points, level.cell, center, diagonal, angle, symmetry) {
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, grasp));
            }
        }
    }
    best.map(|(_, grasp)| grasp)
}

/// The diagonal of the bounding box of points.
fn diagonal(points: impl Iterator<Item = [f32; 2]>) -> Option<f32> {
    let b = points.fold([f32::MAX, f32::MAX, f32::MIN, f32::MIN], |b, p| {
        [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
    });
    (b[2] > b[0]).then(|| (b[2] - b[0]).hypot(b[3] - b[1]))
}

/// All grasps with a line in this direction, with their costs.
fn along(
    points: &[([f32; 2], f32)],
    cell: f32,
    center: [f32; 2],
    diagonal: f32,
    angle: f32,
    symmetry: RotationalSymmetry,
) -> Vec<(f32, PartGrasp)> {
    let (sin, cos) = angle.sin_cos();
    let bin = cell * 1.5;
    // Coordinates along and across the line, from the centre, and the height; `extents` has, for each bin along the
    // line, the range across it and the largest height.
    let turned: Vec<(f32, f32, f32)> = points
        .iter()
        .map(|&([x, y], top)| {
            let (dx, dy) = (x - center[0], y - center[1]);
            (cos * dx + sin * dy, cos * dy - sin * dx, top)
        })
        .collect();
    let low = turned.iter().map(|p| p.0).fold(f32::MAX, f32::min);
    let high = turned.iter().map(|p| p.0).fold(f32::MIN, f32::max);
    let count = ((high - low) / bin) as usize + 1;
    let mut extents = vec![[f32::MAX, f32::MIN, 0.0]; count];
    for &(a, b, top) in &turned {
        let extent = &mut extents[((a - low) / bin) as usize];
        *extent = [extent[0].min(b), extent[1].max(b), extent[2].max(top)];
    }
    let half_pad = HALF_PAD_MM.min(0.3 * (high - low));
    let reach = ((half_pad / bin).round() as usize).max(1);
    let mut found = Vec::new();
    for middle in reach..count.saturating_sub(reach) {
        let band = &extents[middle - reach..=middle + reach];
        let lower = band.iter().map(|e| e[0]).fold(f32::MAX, f32::min);
        let upper = band.iter().map(|e| e[1]).fold(f32::MIN, f32::max);
        let width = upper - lower + cell;
        if !(1.0..=MAX_JAW_WIDTH_MM).contains(&width) {
            continue;
        }
        // Flanks that are not parallel to the line give a bad grip.
        let uneven = band.iter().map(|e| (e[0] - lower) + (upper - e[1])).filter(|u| u.is_finite()).sum::<f32>()
            / (band.len() as f32 * width);
        let mut a = low + (middle as f32 + 0.5) * bin;
        let mut b = 0.5 * (lower + upper);
        let off_center = a.hypot(b) / diagonal;
        if symmetry != RotationalSymmetry::None {
            // Only the centre does not move under the part's rotations.
            if off_center > 0.02 {
                continue;
            }
            (a, b) = (0.0, 0.0);
        }
        // The marks do not extend beyond the part's ends, unless they would be too close together.
        let room = (high - a).min(a - low);
        let half = (0.3 * (high - low)).min(0.28 * diagonal).min(room).max((0.06 * diagonal).max(1.5));
        let place = |along: f32| [center[0] + cos * along - sin * b, center[1] + sin * along + cos * b];
        let top = extents[middle][2];
        let grasp =
            PartGrasp { start: place(a - half), end: place(a + half), jaw_width_mm: width, height_mm: 0.5 * top };
        let cost = 1.2 * off_center + 0.5 * width / MAX_JAW_WIDTH_MM + 0.8 * uneven
            - 0.15 * (high - low) / diagonal
            - 0.6 * (half / diagonal).min(0.15);
        found.push((cost, grasp));
    }
    found
}
