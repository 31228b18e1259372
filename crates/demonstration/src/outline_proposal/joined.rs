//! A corrected outline with the vertices of the known one where nothing was changed.
//!
//! ```text
//! known outline ───── outside the changed area ─┐
//!                                               ├─ joined where the known outline enters and leaves this area
//! corrected outline ─ inside the changed area ──┘
//! ```
//! The corrected outline is traced in pixels of the frame, which are several pixels of a large photo wide.

use nalgebra::Point2;
use sdg_geometry::Polygon;

use super::frame::Frame;
use super::strokes::grown;

/// The changed area is extended by this many pixels of the frame, because the outline runs beside the changed pixels.
const MARGIN_STEPS: usize = 2;
/// Minimum fraction of the changed pixels that the joined outline assigns as the corrected one does. Chosen by hand.
const MIN_CHANGED_SHARE: f64 = 0.9;
/// Minimum IoU of the joined outline with the corrected one: a lower value means that the outlines were joined at wrong
/// places. Chosen by hand.
const MIN_IOU: f64 = 0.95;

/// Joins the outlines, given the changed pixels of the frame; `None` if no vertex of the known outline is left, if the
/// outlines cannot be joined, or if the result crosses itself.
pub(crate) fn joined(frame: &Frame, known: &Polygon, corrected: &Polygon, changed: &[bool]) -> Option<Polygon> {
    if !changed.contains(&true) {
        return Polygon::new(known.vertices.clone()).ok().filter(|known| !known.crosses_itself());
    }
    let area = grown(changed, frame.width, MARGIN_STEPS);
    let is_changed = |point: &Point2<f64>| frame.pixel_of(point).is_some_and(|at| area[at]);
    let mut known = known.clone();
    if is_clockwise(&known) != is_clockwise(corrected) {
        known.vertices.reverse();
    }
    let ring = sampled(frame, &known);
    let start = ring.iter().position(|(point, is_vertex)| *is_vertex && !is_changed(point))?;
    let mut before = ring[start].0;
    let mut vertices = vec![before];
    let mut is_inside = false;
    for (point, is_vertex) in ring.iter().cycle().skip(start + 1).take(ring.len()) {
        if is_changed(point) {
            if !is_inside && vertices.last() != Some(&before) {
                vertices.push(before);
            }
            is_inside = true;
            continue;
        }
        if is_inside {
            vertices.extend(between(corrected, &before, point)?);
        }
        if is_inside || *is_vertex {
            vertices.push(*point);
        }
        (before, is_inside) = (*point, false);
    }
    // The ring ends at its start.
    vertices.pop();
    let joined = Polygon::new(vertices).ok()?;
    let [own, expected] = [&joined, corrected].map(|outline| frame.pixels_of(outline));
    let at_changed = |at: &usize| changed[*at];
    let num_changed = (0..changed.len()).filter(at_changed).count();
    let num_alike = (0..changed.len()).filter(at_changed).filter(|&at| own[at] == expected[at]).count();
    let is_alike = num_alike as f64 >= MIN_CHANGED_SHARE * num_changed as f64
        && frame.mask(&own).iou(&frame.mask(&expected)) >= MIN_IOU;
    (is_alike && !joined.crosses_itself()).then_some(joined)
}

fn is_clockwise(outline: &Polygon) -> bool {
    outline.edges().map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>() > 0.0
}

/// Points along an outline, two for each pixel of the frame, and whether each is a vertex.
fn sampled(frame: &Frame, outline: &Polygon) -> Vec<(Point2<f64>, bool)> {
    let along = |(from, to): (Point2<f64>, Point2<f64>)| {
        let length = (frame.place_of(&to) - frame.place_of(&from)).norm();
        let steps = (2.0 * length).ceil().max(1.0) as usize;
        (0..steps).map(move |step| (from + (to - from) * (step as f64 / steps as f64), step == 0))
    };
    outline.edges().flat_map(along).collect()
}

/// The vertices of an outline between the places nearest to two points.
fn between(outline: &Polygon, from: &Point2<f64>, to: &Point2<f64>) -> Option<Vec<Point2<f64>>> {
    let count = outline.vertices.len();
    let [(first, first_share), (last, last_share)] = [nearest_place(outline, from)?, nearest_place(outline, to)?];
    let is_ahead = first != last || first_share <= last_share;
    let num_between = if is_ahead { (last + count - first) % count } else { count };
    Some(outline.vertices.iter().cycle().skip(first + 1).take(num_between).copied().collect())
}

/// The edge nearest to a point, and the fraction of the edge before the place nearest to the point.
fn nearest_place(outline: &Polygon, point: &Point2<f64>) -> Option<(usize, f64)> {
    let places = outline.edges().enumerate().map(|(idx, (from, to))| {
        let edge = to - from;
        let share = ((point - from).dot(&edge) / edge.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        ((point - (from + edge * share)).norm(), (idx, share))
    });
    places.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
}
