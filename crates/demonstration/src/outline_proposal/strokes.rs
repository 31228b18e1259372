//! Strokes over places that belong to the part or do not: the region that a stroke means, and the part corrected by it.
//!
//! A stroke over a place that the cut has on the wrong side means the whole piece of the picture there: what is reached from the stroke
//! over small steps of colour, without leaving the wrong side. A stroke over a shadow means the whole shadow: what the surroundings look
//! like in as much shadow as under the stroke, and in less. The part is then cut anew, and what changes near the stroke is taken over.
//! People draw into the middle of what is wrong, so that the way from the stroke to the part's border tells how large that is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::color_mixture::ColorMixture;
use super::frame::Frame;
use super::lab::Lab;
use super::pieces::{neighbours, pieces};
use super::stroke::Stroke;

/// The colours on the way to a pixel of the region differ by at most so much in sum, in units of L*a*b*. Chosen by hand: a shadow's
/// edge is some 20 units wide, the steps of an even surface sum to less than 10.
const MAX_WAY: f32 = 14.0;
/// A pixel of the region differs from the stroke's colour by at most so much.
const MAX_DIFFERENCE: f32 = 24.0;
/// Length of a step in the same units: near pixels come first, and noise does not lead across the whole picture.
const STEP: f32 = 0.05;
/// The stroke's own surroundings belong to its region, as a share of the frame's diagonal.
const RADIUS_SHARE: f64 = 0.012;
/// A stroke changes what lies within so many of its distances to the part's border: what is wrong is often longer than wide.
const REACH: f32 = 5.0;
/// That distance is at least so many pixels.
const MIN_DISTANCE_PX: f32 = 2.0;
/// A shadow that a stroke means ends at edges of at least one of these strengths: at that which leaves a part that runs along edges.
const MAX_EDGES: [f32; 3] = [1.1, 0.9, 0.6];
/// A stroke over a shadow lies so far from the outline, in pixels: nearer to it, pixels are mixed of part and table, which looks like shadow.
const MIN_SHADOW_PX: f32 = 3.0;
/// A shadow leaves so much of an outline, and most of that in one piece; otherwise the part has the shadow's colour.
const MIN_LEFT: f64 = 0.12;
const MIN_IN_ONE_PIECE: f64 = 0.6;
/// Another piece of the same shadow has at least this share of the part's area.
const MIN_PIECE_SHARE: f64 = 0.005;
/// Its mean colour differs from that under the stroke by at most so much, in units of L*a*b*.
const MAX_PIECE_DIFFERENCE: f32 = 14.0;
/// How often colours are learnt again after a stroke.
const ROUNDS: usize = 3;

/// A part as far as it was corrected, and what was said.
pub(crate) struct Correction<'a> {
    frame: &'a Frame,
    /// Colours around the box, and of the whole photo.
    surroundings: Option<ColorMixture>,
    pub in_part: Vec<bool>,
    /// On which side a pixel stays, where that was said.
    pinned: Vec<Option<bool>>,
    /// What the strokes may change.
    reached: Vec<bool>,
}

impl<'a> Correction<'a> {
    pub fn new(frame: &'a Frame, in_part: Vec<bool>) -> Self {
        let count = in_part.len();
        let (_, mut around) = frame.colors_of(&frame.candidates);
        around.extend_from_slice(&frame.elsewhere);
        let surroundings = ColorMixture::learn(&around);
        Self { frame, surroundings, in_part, pinned: vec![None; count], reached: vec![false; count] }
    }

    /// Corrects the part by a further stroke. What is right far from it stays as it is.
    pub fn apply(&mut self, stroke: &Stroke) {
        let count = self.in_part.len();
        let distances = stroke.distances(self.frame.width, count);
        let shadows = MAX_EDGES.iter().filter_map(|&max_edge| self.shadow(stroke, max_edge));
        match shadows.max_by(|(a, _), (b, _)| a.total_cmp(b)) {
            Some((_, shadow)) => {
                let around = grown(&shadow, self.frame.width, self.radius().ceil() as usize + 1);
                for at in 0..count {
                    self.reached[at] |= around[at];
                    if shadow[at] || distances[at] <= self.radius() {
                        // What was said before stays.
                        self.pinned[at].get_or_insert(false);
                    }
                }
            }
            None => self.pin_alike(stroke, &distances),
        }
        let Self { frame, in_part, pinned, reached, .. } = self;
        let start: Vec<bool> = in_part.iter().zip(&*pinned).map(|(&now, pinned)| pinned.unwrap_or(now)).collect();
        let cut = frame.cut(start.clone(), &[], pinned, ROUNDS).unwrap_or(start);
        let changed: Vec<bool> = (0..count).map(|at| reached[at] && cut[at] != in_part[at]).collect();
        for piece in pieces(&changed, frame.width) {
            if piece.iter().any(|&at| pinned[at].is_some()) {
                piece.iter().for_each(|&at| in_part[at] = cut[at]);
            }
        }
    }

    /// A stroke's own surroundings reach so far, in pixels.
    fn radius(&self) -> f32 {
        (RADIUS_SHARE * (self.frame.width as f64).hypot(self.frame.height() as f64)) as f32
    }

    /// All of the part that is the shadow which a stroke runs over, on both sides of the part, and the share along edges of what is left;
    /// `None` where it runs over none.
    fn shadow(&self, stroke: &Stroke, max_edge: f32) -> Option<(f64, Vec<bool>)> {
        let Self { frame, in_part, pinned, .. } = self;
        let surroundings = self.surroundings.as_ref().filter(|_| !stroke.is_inside)?;
        if depth(stroke, in_part, frame.width) < MIN_SHADOW_PX {
            return None;
        }
        let looks_so = shadow_under(stroke, surroundings, &frame.colors);
        let count = in_part.len();
        let is_shadow =
            |at: usize| in_part[at] && looks_so[at] && frame.edges.strength(at) < max_edge && pinned[at] != Some(true);
        let marked: Vec<bool> = (0..count).map(is_shadow).collect();
        let part = in_part.iter().filter(|&&in_part| in_part).count();
        let touches_outside =
            |piece: &[usize]| piece.iter().flat_map(|&at| neighbours(at, frame.width, count)).any(|to| !in_part[to]);
        let deep = mean(stroke.pixels.iter().map(|&at| &frame.colors[at]));
        let looks_alike = |piece: &[usize]| {
            let color = mean(piece.iter().map(|&at| &frame.colors[at]));
            color.distance_squared(&deep) <= MAX_PIECE_DIFFERENCE * MAX_PIECE_DIFFERENCE
        };
        let mut shadow = vec![false; count];
        for piece in pieces(&marked, frame.width) {
            let is_under = piece.iter().any(|at| stroke.pixels.contains(at));
            let is_large = piece.len() as f64 >= MIN_PIECE_SHARE * part as f64;
            // Dark places in the middle of a part are the part's, and so is what has only something of the shadow's colour.
            if is_under || (is_large && touches_outside(&piece) && looks_alike(&piece)) {
                piece.iter().for_each(|&at| shadow[at] = true);
            }
        }
        let left: Vec<bool> = in_part.iter().zip(&shadow).map(|(&in_part, &shadow)| in_part && !shadow).collect();
        let largest_left = pieces(&left, frame.width).iter().map(Vec::len).max().unwrap_or(0);
        let is_under = stroke.pixels.iter().any(|&at| shadow[at]);
        let all_left = left.iter().filter(|&&left| left).count();
        let is_enough = largest_left as f64 >= (MIN_LEFT * part as f64).max(MIN_IN_ONE_PIECE * all_left as f64);
        (is_under && is_enough).then(|| (frame.share_along_edges(&left), shadow))
    }

    /// Marks what a stroke means by its colour alone, and what it may change.
    fn pin_alike(&mut self, stroke: &Stroke, distances: &[f32]) {
        let radius = self.radius();
        let Self { frame, in_part, pinned, reached, .. } = self;
        let (width, count) = (frame.width, in_part.len());
        let deepest = depth(stroke, in_part, width);
        let reach = REACH * deepest.max(MIN_DISTANCE_PX);
        for at in 0..count {
            reached[at] |= distances[at] <= reach;
            if distances[at] <= radius {
                pinned[at] = Some(stroke.is_inside);
            }
        }
        pin(stroke, &frame.colors, width, in_part, pinned);
    }
}

/// How deep a stroke lies in what is wrong, in pixels: its point that is farthest from the side that it means.
fn depth(stroke: &Stroke, in_part: &[bool], width: usize) -> f32 {
    let of_its_side: Vec<usize> = (0..in_part.len()).filter(|&at| in_part[at] == stroke.is_inside).collect();
    let to_side = |&pixel: &usize| {
        let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
        let away = |&at: &usize| ((at % width) as f32 - x).hypot((at / width) as f32 - y);
        of_its_side.iter().map(away).fold(f32::INFINITY, f32::min)
    };
    // Some of a long stroke's pixels tell as much as all.
    let some = stroke.pixels.iter().step_by(1 + stroke.pixels.len() / 32);
    some.map(to_side).fold(0.0, f32::max)
}

fn mean<'a>(colors: impl Iterator<Item = &'a Lab>) -> Lab {
    let (mut sum, mut count) = ([0.0f32; 3], 0.0f32);
    for color in colors {
        (0..3).for_each(|axis| sum[axis] += color.0[axis]);
        count += 1.0;
    }
    Lab(sum.map(|sum| sum / count.max(1.0)))
}

/// The marked pixels and those around them, across and down, so many steps away.
fn grown(marked: &[bool], width: usize, steps: usize) -> Vec<bool> {
    let mut grown = marked.to_vec();
    let mut rim: Vec<usize> = (0..marked.len()).filter(|&at| marked[at]).collect();
    for _ in 0..steps {
        let mut next = Vec::new();
        for to in rim.iter().flat_map(|&at| neighbours(at, width, marked.len())) {
            if !grown[to] {
                grown[to] = true;
                next.push(to);
            }
        }
        rim = next;
    }
    grown
}

/// The pixels that look like the surroundings in as much shadow as there is under a stroke, or in less.
fn shadow_under(stroke: &Stroke, surroundings: &ColorMixture, colors: &[Lab]) -> Vec<bool> {
    let shades: Vec<_> = stroke
        .pixels
        .iter()
        .step_by(1 + stroke.pixels.len() / 16)
        .filter_map(|&at| surroundings.shade_of(&colors[at]))
        .collect();
    colors.iter().map(|color| shades.iter().any(|shade| surroundings.explains_under(color, shade))).collect()
}

/// Marks the pixels that a stroke means in `pinned`: inside, or outside.
fn pin(stroke: &Stroke, colors: &[Lab], width: usize, in_part: &[bool], pinned: &mut [Option<bool>]) {
    // Costs in thousandths, so that they can be ordered. Each pixel is compared with that of the stroke that it was reached from.
    let mut cost = vec![u32::MAX; colors.len()];
    let mut open: BinaryHeap<_> = stroke.pixels.iter().map(|&start| Reverse((0u32, start, start))).collect();
    stroke.pixels.iter().for_each(|&start| cost[start] = 0);
    let budget = (1e3 * MAX_WAY) as u32;
    while let Some(Reverse((so_far, at, start))) = open.pop() {
        if so_far > cost[at] {
            continue;
        }
        // Another stroke's region is not taken back.
        if pinned[at] != Some(!stroke.is_inside) {
            pinned[at] = Some(stroke.is_inside);
        }
        for to in neighbours(at, width, colors.len()) {
            let is_wrong_side = in_part[to] != stroke.is_inside;
            let is_alike = colors[to].distance_squared(&colors[start]) <= MAX_DIFFERENCE * MAX_DIFFERENCE;
            let step = STEP + colors[at].distance_squared(&colors[to]).sqrt();
            let through = so_far.saturating_add((1e3 * step) as u32);
            if is_wrong_side && is_alike && through <= budget && through < cost[to] {
                cost[to] = through;
                open.push(Reverse((through, to, start)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_geometry::BoundingBox;

    use super::super::OutlineStroke;
    use super::*;

    #[test]
    fn a_click_means_the_piece_of_one_colour_on_the_wrong_side() {
        // Left half light, right half dark, all of it taken for the part.
        let (width, height) = (40, 20);
        let colors: Vec<Lab> =
            (0..width * height).map(|at| Lab([if at % width < 20 { 80.0 } else { 30.0 }, 0.0, 0.0])).collect();
        let mut pinned = vec![None; colors.len()];
        let click = |x: usize, y: usize, is_inside| Stroke { pixels: vec![y * width + x], is_inside };
        let pin_all = |stroke: Stroke, pinned: &mut [Option<bool>]| {
            pin(&stroke, &colors, width, &vec![true; width * height], pinned);
        };
        pin_all(click(30, 10, false), &mut pinned);
        for (at, pinned) in pinned.iter().enumerate() {
            assert_eq!(*pinned, (at % width >= 20).then_some(false), "{at}");
        }
        // On the right side already, it means its own surroundings alone.
        let mut pinned = vec![None; colors.len()];
        pin_all(click(5, 10, true), &mut pinned);
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
        let click = OutlineStroke::click(Point2::new(53.0, 100.0), true);
        correction.apply(&frame.stroke(&click).unwrap());
        let has = |x: f64, y: f64| {
            let at = frame.stroke(&OutlineStroke::click(Point2::new(x, y), true)).unwrap();
            correction.in_part[at.pixels[0]]
        };
        assert!(has(53.0, 100.0) && has(52.0, 104.0) && !has(147.0, 100.0));
    }
}
