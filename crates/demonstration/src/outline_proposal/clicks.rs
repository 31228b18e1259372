//! Clicks on places that belong to the part or do not: the region that a click means, and the part corrected by it.
//!
//! A click on a place that the cut has on the wrong side means the whole piece of the picture there: what is reached from the click
//! over small steps of colour, without leaving the wrong side. The part is then cut anew, and what changes near the click is taken
//! over. People click into the middle of what is wrong, so that the way from the click to the part's border tells how large that is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::click::Click;
use super::frame::Frame;
use super::lab::Lab;
use super::pieces::{neighbours, pieces};

/// The colours on the way to a pixel of the region differ by at most so much in sum, in units of L*a*b*. Chosen by hand: a shadow's
/// edge is some 20 units wide, the steps of an even surface sum to less than 10.
const MAX_WAY: f32 = 14.0;
/// A pixel of the region differs from the click's colour by at most so much.
const MAX_DIFFERENCE: f32 = 24.0;
/// Length of a step in the same units: near pixels come first, and noise does not lead across the whole picture.
const STEP: f32 = 0.05;
/// The click's own surroundings belong to its region, as a share of the frame's diagonal.
const RADIUS_SHARE: f64 = 0.012;
/// A click changes what lies within so many of its distances to the part's border: what is wrong is often longer than wide.
const REACH: f64 = 5.0;
/// That distance is at least so many pixels.
const MIN_DISTANCE_PX: f64 = 2.0;
/// How often colours are learnt again after a click.
const ROUNDS: usize = 3;

/// A part as far as it was corrected, and what was said.
pub(crate) struct Correction<'a> {
    frame: &'a Frame,
    pub in_part: Vec<bool>,
    /// On which side a pixel stays, where that was said.
    pinned: Vec<Option<bool>>,
    /// What the clicks may change.
    reached: Vec<bool>,
}

impl<'a> Correction<'a> {
    pub fn new(frame: &'a Frame, in_part: Vec<bool>) -> Self {
        let count = in_part.len();
        Self { frame, in_part, pinned: vec![None; count], reached: vec![false; count] }
    }

    /// Corrects the part by a further click. What is right far from it stays as it is.
    pub fn apply(&mut self, click: &Click) {
        let Self { frame, in_part, pinned, reached } = self;
        let width = frame.width;
        let of_its_side = (0..in_part.len()).filter(|&at| in_part[at] == click.is_inside);
        let to_border = of_its_side.map(|at| click.distance(at, width)).fold(f64::INFINITY, f64::min);
        let reach = REACH * to_border.max(MIN_DISTANCE_PX);
        reached.iter_mut().enumerate().for_each(|(at, reached)| *reached |= click.distance(at, width) <= reach);
        pin(*click, &frame.colors, width, in_part, pinned);

        let start: Vec<bool> = in_part.iter().zip(&*pinned).map(|(&now, pinned)| pinned.unwrap_or(now)).collect();
        let cut = frame.cut(start.clone(), &[], pinned, ROUNDS).unwrap_or(start);
        let changed: Vec<bool> = (0..cut.len()).map(|at| reached[at] && cut[at] != in_part[at]).collect();
        for piece in pieces(&changed, width) {
            if piece.iter().any(|&at| pinned[at].is_some()) {
                piece.iter().for_each(|&at| in_part[at] = cut[at]);
            }
        }
    }
}

/// Marks the pixels that a click means in `pinned`: inside, or outside.
fn pin(click: Click, colors: &[Lab], width: usize, in_part: &[bool], pinned: &mut [Option<bool>]) {
    let height = colors.len() / width;
    let radius = RADIUS_SHARE * (width as f64).hypot(height as f64);
    for at in (0..colors.len()).filter(|&at| click.distance(at, width) <= radius) {
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
        for to in neighbours(at, width, colors.len()) {
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
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_geometry::BoundingBox;

    use super::super::OutlineClick;
    use super::*;

    #[test]
    fn a_click_means_the_piece_of_one_colour_on_the_wrong_side() {
        // Left half light, right half dark, all of it taken for the part.
        let (width, height) = (40, 20);
        let colors: Vec<Lab> =
            (0..width * height).map(|at| Lab([if at % width < 20 { 80.0 } else { 30.0 }, 0.0, 0.0])).collect();
        let mut pinned = vec![None; colors.len()];
        pin(Click { x: 30, y: 10, is_inside: false }, &colors, width, &vec![true; colors.len()], &mut pinned);
        for (at, pinned) in pinned.iter().enumerate() {
            assert_eq!(*pinned, (at % width >= 20).then_some(false), "{at}");
        }
        // On the right side already, it means its own surroundings alone.
        let mut pinned = vec![None; colors.len()];
        pin(Click { x: 5, y: 10, is_inside: true }, &colors, width, &vec![true; colors.len()], &mut pinned);
        assert_eq!(pinned.iter().filter(|pinned| pinned.is_some()).count(), 1);
    }

    #[test]
    fn what_is_wrong_far_from_a_click_stays() {
        let in_disc = |x: f64, y: f64| (x - 100.0).hypot(y - 100.0) < 50.0;
        let image = RgbImage::from_fn(200, 200, |x, y| {
            let noise = (x * 7 + y * 13) as u8 % 5;
            if in_disc(f64::from(x), f64::from(y)) { Rgb([170 + noise, 60, 50]) } else { Rgb([120, 130 + noise, 125]) }
        });
        let bbox = BoundingBox { x1: 45.0, y1: 45.0, x2: 155.0, y2: 155.0 };
        let frame = Frame::cut_out(&image, &bbox, 1e9).unwrap();
        // In pixels of the frame; slivers are missing left and right.
        let [left, top] = [45.0 - 22.0, 45.0 - 22.0];
        let without_slivers = |at: usize| {
            let (x, y) = (left + (at % frame.width) as f64, top + (at / frame.width) as f64);
            in_disc(x, y) && (56.0..144.0).contains(&x)
        };
        let start: Vec<bool> = (0..frame.colors.len()).map(without_slivers).collect();
        let mut correction = Correction::new(&frame, start);
        let click = OutlineClick { at: Point2::new(53.0, 100.0), is_inside: true };
        correction.apply(&frame.click(&click).unwrap());
        let has = |x: f64, y: f64| {
            let at = frame.click(&OutlineClick { at: Point2::new(x, y), is_inside: true }).unwrap();
            correction.in_part[at.y * frame.width + at.x]
        };
        assert!(has(53.0, 100.0) && has(52.0, 104.0) && !has(147.0, 100.0));
    }
}
