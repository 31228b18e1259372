//! Clicks on places that belong to the part or do not: the region that a click stands for.
//!
//! A click on a place that the cut has on the wrong side means the whole piece of the picture there: what is reached from the click
//! over small steps of colour, without leaving the wrong side.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::lab::Lab;

/// The colours on the way to a pixel of the region differ by at most so much in sum, in units of L*a*b*. Chosen by hand: a shadow's
/// edge is some 20 units wide, the steps of an even surface sum to less than 10.
const MAX_WAY: f32 = 14.0;
/// A pixel of the region differs from the click's colour by at most so much.
const MAX_DIFFERENCE: f32 = 24.0;
/// Length of a step in the same units: near pixels come first, and noise does not lead across the whole picture.
const STEP: f32 = 0.05;
/// The click's own surroundings belong to its region, as a share of the frame's diagonal.
const RADIUS_SHARE: f64 = 0.012;

/// A click, in pixels of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Click {
    pub x: usize,
    pub y: usize,
    pub is_inside: bool,
}

/// Marks the pixels that a click means in `pinned`: inside, or outside.
pub(crate) fn pin(click: &Click, colors: &[Lab], width: usize, in_part: &[bool], pinned: &mut [Option<bool>]) {
    let height = colors.len() / width;
    let radius = RADIUS_SHARE * (width as f64).hypot(height as f64);
    let near = |at: usize| (at % width).abs_diff(click.x) as f64;
    let around = (0..colors.len()).filter(|&at| near(at).hypot((at / width).abs_diff(click.y) as f64) <= radius);
    for at in around {
        pinned[at] = Some(click.is_inside);
    }
    let start = click.y * width + click.x;
    // Costs in thousandths, so that they can be ordered.
    let mut cost = vec![u32::MAX; colors.len()];
    let mut open = BinaryHeap::from([Reverse((0u32, start))]);
    cost[start] = 0;
    let budget = (1e3 * MAX_WAY) as u32;
    while let Some(Reverse((so_far, at))) = open.pop() {
        if so_far > cost[at] {
            continue;
        }
        // Another click's region is not taken back.
        if pinned[at] != Some(!click.is_inside) {
            pinned[at] = Some(click.is_inside);
        }
        let (x, y) = (at % width, at / width);
        let neighbours = [
            (x > 0).then(|| at - 1),
            (x + 1 < width).then(|| at + 1),
            (y > 0).then(|| at - width),
            (y + 1 < height).then(|| at + width),
        ];
        for to in neighbours.into_iter().flatten() {
            let is_wrong_side = in_part[to] != click.is_inside;
            let is_alike = colors[to].distance_squared(&colors[start]) <= MAX_DIFFERENCE * MAX_DIFFERENCE;
            let step = STEP + colors[at].distance_squared(&colors[to]).sqrt();
            let through = so_far.saturating_add((1e3 * step) as u32);
            if is_wrong_side && is_alike && through <= budget && through < cost[to] {
                cost[to] = through;
                open.push(Reverse((through, to)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_click_means_the_piece_of_one_colour_on_the_wrong_side() {
        // Left half light, right half dark, all of it taken for the part.
        let (width, height) = (40, 20);
        let colors: Vec<Lab> =
            (0..width * height).map(|at| Lab([if at % width < 20 { 80.0 } else { 30.0 }, 0.0, 0.0])).collect();
        let mut pinned = vec![None; colors.len()];
        pin(&Click { x: 30, y: 10, is_inside: false }, &colors, width, &vec![true; colors.len()], &mut pinned);
        for (at, pinned) in pinned.iter().enumerate() {
            assert_eq!(*pinned, (at % width >= 20).then_some(false), "{at}");
        }
        // On the right side already, it means its own surroundings alone.
        let mut pinned = vec![None; colors.len()];
        pin(&Click { x: 5, y: 10, is_inside: true }, &colors, width, &vec![true; colors.len()], &mut pinned);
        assert_eq!(pinned.iter().filter(|pinned| pinned.is_some()).count(), 1);
    }
}
