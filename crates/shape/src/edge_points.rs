//! The edge points of the demonstration by which the part is recognised: few, sharp, spread out,
//! and chosen so that together they constrain the pose in every direction.

use nalgebra::{Matrix4, Point2, Vector2, Vector4};
use sdg_geometry::{Polygon, upper_median};

use crate::gradient_field::GradientLevel;

/// An edge must exceed the smallest trusted gradient by this factor. Chosen by hand, not measured.
const STRENGTH_OVER_FLOOR: f32 = 1.5;
/// Edges below this share of the strong ones (the 90th percentile) are shading, not shape. Chosen by hand, not
/// measured.
const STRENGTH_OVER_STRONG: f32 = 0.08;
/// Minimum share of energy in one direction; below it the point is a corner or texture. Chosen by hand, not measured.
const MIN_COHERENCE: f32 = 0.5;
/// cos 2φ, with the angle φ between an edge's normal and the outline's, above which the edge is the outline's own: up
/// to 30°. Chosen by hand, not measured.
const OUTLINE_ALIGNMENT: f64 = 0.5;
/// Rounds of the re-weighting that balances the directions of the pose. Chosen by hand, not measured.
const BALANCE_ROUNDS: usize = 3;
/// Smallest and largest factor of that re-weighting. Chosen by hand, not measured.
const BALANCE_LIMITS: (f64, f64) = (0.4, 4.0);

/// One edge point of the demonstration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EdgePoint {
    /// From the part's centre, in demonstration pixels.
    pub(crate) offset: [f32; 2],
    /// Unit vector across the edge; its sign has no meaning.
    pub(crate) normal: [f32; 2],
    /// (cos 2φ, sin 2φ) of the normal.
    pub(crate) double: [f32; 2],
    /// Weight in the agreement; the weights of a level sum to 1.
    pub(crate) weight: f32,
}

/// Criteria of the choice of points.
pub(crate) struct EdgeSelection<'a> {
    pub(crate) outline: &'a Polygon,
    pub(crate) center: Point2<f64>,
    pub(crate) max_points: usize,
    /// Weight of an edge on the outline relative to one inside.
    pub(crate) outline_weight: f64,
    /// Weight of an edge inside: below 1 where the edges there depend on the part's roll.
    pub(crate) inner_weight: f64,
}

struct EdgeCandidate {
    position: Point2<f64>,
    normal: Vector2<f64>,
    strength: f64,
    on_outline: bool,
}

/// Chooses the edge points of one pyramid level whose pixel is `pixel_size` demonstration pixels.
pub(crate) fn select_edge_points(
    level: &GradientLevel,
    pixel_size: f64,
    selection: &EdgeSelection<'_>,
) -> Vec<EdgePoint> {
    let mut candidates = find_candidates(level, pixel_size, selection);
    if selection.inner_weight == 0.0 {
        candidates.retain(|candidate| candidate.on_outline);
    }
    candidates.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let spread = spread_out(&candidates, selection.max_points, pixel_size);
    let median = upper_median(spread.iter().map(|&i| candidates[i].strength)).unwrap_or(1.0);

    let mut points: Vec<EdgePoint> = Vec::with_capacity(spread.len());
    for idx in spread {
        let candidate = &candidates[idx];
        let offset = candidate.position - selection.center;
        let n = candidate.normal;
        let own = candidate.strength / (candidate.strength + median);
        let boost = if candidate.on_outline { selection.outline_weight } else { selection.inner_weight };
        points.push(EdgePoint {
            offset: [offset.x as f32, offset.y as f32],
            normal: [n.x as f32, n.y as f32],
            double: [(n.x * n.x - n.y * n.y) as f32, (2.0 * n.x * n.y) as f32],
            weight: (own * boost) as f32,
        });
    }
    balance_directions(&mut points);
    points
}

/// Crests of the gradient, to a fraction of a pixel, inside the outline or on it.
fn find_candidates(level: &GradientLevel, pixel_size: f64, selection: &EdgeSelection<'_>) -> Vec<EdgeCandidate> {
    // An outline drawn by hand or cut from a mask has an error of about 1.5 pixels at any level: estimated, not
    // measured.
    let margin_px = 1.5 + pixel_size;
    let bounds = selection.outline.bounds();
    let first = |bound: f64| ((bound - margin_px) / pixel_size).floor().max(0.0) as usize;
    let end = |bound: f64, limit: usize| (((bound + margin_px) / pixel_size).ceil().max(0.0) as usize).min(limit);
    let (cols, rows) =
        (first(bounds.x1)..end(bounds.x2, level.width()), first(bounds.y1)..end(bounds.y2, level.height()));

    let mut candidates = Vec::new();
    for row in rows {
        for col in cols.clone() {
            let Some((position, normal, strength)) = crest_at(level, col, row) else { continue };
            let position = position * pixel_size;
            let inside = selection.outline.contains(&position);
            let on_outline = outline_normal_near(selection.outline, &position, margin_px)
                .is_some_and(|outline_normal| 2.0 * normal.dot(&outline_normal).powi(2) - 1.0 > OUTLINE_ALIGNMENT);
            // Just outside the outline, only edges in the outline's direction belong to the part.
            if inside || on_outline {
                candidates.push(EdgeCandidate { position, normal, strength, on_outline });
            }
        }
    }
    let mut strengths: Vec<f64> = candidates.iter().map(|c| c.strength).collect();
    strengths.sort_by(f64::total_cmp);
    if let Some(&strong) = strengths.get(strengths.len() * 9 / 10) {
        candidates.retain(|c| c.strength > f64::from(STRENGTH_OVER_STRONG) * strong);
    }
    candidates
}

/// Position in level pixels, unit normal and gradient if pixel `(col, row)` is a crest.
fn crest_at(level: &GradientLevel, col: usize, row: usize) -> Option<(Point2<f64>, Vector2<f64>, f64)> {
    let (x, y) = (col as f32 + 0.5, row as f32 + 0.5);
    let [dx, dy, energy] = level.nearest(x, y)?;
    let share = energy / (energy + level.floor());
    let length = dx.hypot(dy);
    if energy < STRENGTH_OVER_FLOOR.powi(2) * level.floor() || length < MIN_COHERENCE * share {
        return None;
    }
    let angle = 0.5 * dy.atan2(dx);
    let (ny, nx) = angle.sin_cos();
    let strength = |t: f32| {
        let [dx2, dy2, tr] = level.bilinear(x + t * nx, y + t * ny)?;
        let along = (dx2 * dx + dy2 * dy) / length * (tr + level.floor());
        Some(along.max(0.0).sqrt())
    };
    let (before, here, after) = (strength(-1.0)?, strength(0.0)?, strength(1.0)?);
    // `>=` on one side only, so that one of two equal neighbours is kept.
    if before > here || after >= here {
        return None;
    }
    let shift = parabola_peak(before, here, after);
    let position = Point2::new(f64::from(x + shift * nx), f64::from(y + shift * ny));
    Some((position, Vector2::new(f64::from(nx), f64::from(ny)), f64::from(here)))
}

/// The vertex of the parabola through three values one apart, relative to the middle one, in `[-1/2, 1/2]`.
pub(crate) fn parabola_peak(before: f32, here: f32, after: f32) -> f32 {
    let bend = before - 2.0 * here + after;
    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Unit normal of the nearest outline edge within `reach` of `point`.
fn outline_normal_near(outline: &Polygon, point: &Point2<f64>, reach: f64) -> Option<Vector2<f64>> {
    let mut best = (reach, None);
    for (a, b) in outline.edges() {
        let edge = b - a;
        let length = edge.norm();
        if length == 0.0 {
            continue;
        }
        let along = ((point - a).dot(&edge) / (length * length)).clamp(0.0, 1.0);
        let distance = (point - (a + edge * along)).norm();
        if distance < best.0 {
            best = (distance, Some(Vector2::new(-edge.y, edge.x) / length));
        }
    }
    best.1
}

/// Indices of at most `max_points` candidates, strong ones first, with a minimum distance between them.
fn spread_out(candidates: &[EdgeCandidate], max_points: usize, pixel_size: f64) -> Vec<usize> {
    if candidates.len() <= max_points {
        return (0..candidates.len()).collect();
    }
    // An even distribution along the edges would give this distance; it shrinks until enough points fit.
    let mut distance = pixel_size * candidates.len() as f64 / max_points as f64;
    loop {
        let mut kept: Vec<usize> = Vec::with_capacity(max_points);
        for (idx, candidate) in candidates.iter().enumerate() {
            let is_free = kept
                .iter()
                .all(|&k| (candidates[k].position - candidate.position).norm_squared() >= distance * distance);
            if is_free && kept.len() < max_points {
                kept.push(idx);
            }
        }
        // Nine tenths of the requested points are enough: a smaller distance would give more points, but fewer in weak
        // regions. The factors 9/10 and 0.85 trade time for an even spread; chosen by hand.
        if kept.len() >= max_points * 9 / 10 || distance < 0.5 * pixel_size {
            return kept;
        }
        distance *= 0.85;
    }
}

/// Gives more weight to points whose normals constrain a direction of the pose that few others constrain.
///
/// The ends of a tube have few points compared with its flanks, but only they fix its position along its axis.
///
/// # Source
/// The multiplicative algorithm for D-optimal designs (Silvey, Titterington and Torsney, 1978), with
/// exponent 1/2, stopped after a few rounds and bounded.
fn balance_directions(points: &mut [EdgePoint]) {
    if points.is_empty() {
        return;
    }
    let radius = rms_radius(points).max(1e-6);
    let rows: Vec<Vector4<f64>> = points.iter().map(|p| pose_row(p, radius)).collect();
    let base: Vec<f64> = points.iter().map(|p| f64::from(p.weight)).collect();
    let mut boosts = vec![1.0; points.len()];
    for _ in 0..BALANCE_ROUNDS {
        let total: f64 = base.iter().zip(&boosts).map(|(w, b)| w * b).sum();
        let mut information = Matrix4::zeros();
        for ((row, w), boost) in rows.iter().zip(&base).zip(&boosts) {
            information += row * row.transpose() * (w * boost / total);
        }
        // The angle of a ring is undetermined; without this bound its noise would get a large weight. Chosen by hand.
        information += Matrix4::identity() * (1e-2 * information.trace() / 4.0);
        let Some(inverse) = information.try_inverse() else { return };
        for (row, boost) in rows.iter().zip(&mut boosts) {
            let leverage = (row.transpose() * inverse * row)[0] / 4.0;
            *boost = (*boost * leverage.sqrt()).clamp(BALANCE_LIMITS.0, BALANCE_LIMITS.1);
        }
    }
    let total: f64 = base.iter().zip(&boosts).map(|(w, b)| w * b).sum();
    for ((point, w), boost) in points.iter_mut().zip(&base).zip(&boosts) {
        point.weight = (w * boost / total) as f32;
    }
}

/// Weighted root mean square distance of the points from the centre, in demonstration pixels.
pub(crate) fn rms_radius(points: &[EdgePoint]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for p in points {
        let w = f64::from(p.weight);
        sum += w * (f64::from(p.offset[0]).powi(2) + f64::from(p.offset[1]).powi(2));
        total += w;
    }
    if total > 0.0 { (sum / total).sqrt() } else { 0.0 }
}

/// How far the edge moves along its normal per unit of (x, y, radius · angle, radius · ln scale).
fn pose_row(point: &EdgePoint, radius: f64) -> Vector4<f64> {
    let [x, y] = point.offset.map(f64::from);
    let [nx, ny] = point.normal.map(f64::from);
    Vector4::new(nx, ny, (ny * x - nx * y) / radius, (nx * x + ny * y) / radius)
}
