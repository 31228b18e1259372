//! Strokes that mark areas as part or not: the region that a stroke selects, and the correction of the part.
//!
//! A stroke on the wrong side of the cut selects the whole piece of the picture there: the pixels reached from the
//! stroke by small steps of colour, without leaving the wrong side. A stroke over a shadow selects the whole shadow:
//! colours of the surroundings in the shadow under the stroke, and in weaker ones. The part is then cut again, and the
//! changes near the stroke are applied. People draw into the middle of the wrong area, so the distance from the stroke
//! to the part's border indicates the size of that area.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::color_mixture::ColorMixture;
use super::frame::Frame;
use super::lab::Lab;
use super::pieces::{neighbours, pieces};
use super::stroke::Stroke;

/// Largest sum of colour differences on the path to a pixel of the region, in units of L*a*b*. Chosen by hand: a
/// shadow's edge is about 20 units wide; the steps of an even surface sum to less than 10.
const MAX_WAY: f32 = 14.0;
/// Largest difference of a region's pixel from the stroke's pixel from which it is reached, in units of L*a*b*.
const MAX_DIFFERENCE: f32 = 24.0;
/// Added to the colour difference of each step: close pixels come first, and noise does not lead across the whole
/// picture.
const STEP: f32 = 0.05;
/// Size of the stroke's own surroundings, which belong to its region, as a fraction of the frame's diagonal.
const RADIUS_SHARE: f64 = 0.012;
/// A stroke changes pixels within this many times its distance to the part's border: wrong areas are often longer than
/// wide.
const REACH: f32 = 5.0;
/// A stroke for the part takes in colours of the table within this many times its distance to the part's border: parts
/// may have the table's colour.
const TABLE_REACH: f32 = 1.0;
/// Minimum distance to the part's border that [`REACH`] multiplies, in pixels.
const MIN_DISTANCE_PX: f32 = 2.0;
/// Edge strengths at which a selected shadow ends. Each is tried. The removed shadow is the one without which the
/// largest fraction of the part's border runs along edges.
const MAX_EDGES: [f32; 3] = [1.1, 0.9, 0.6];
/// Minimum distance of a shadow stroke from the outline, in pixels: closer pixels mix part and table, which looks like
/// shadow.
const MIN_SHADOW_PX: f32 = 3.0;
/// Minimum size of the largest piece that remains without a shadow, as a fraction of the part; otherwise the part has
/// the shadow's colour.
const MIN_LEFT: f64 = 0.12;
/// Minimum size of the largest remaining piece, as a fraction of all that remains.
const MIN_IN_ONE_PIECE: f64 = 0.6;
/// Minimum area of another piece of the same shadow, as a fraction of the part's area.
const MIN_PIECE_SHARE: f64 = 0.005;
/// Largest difference of the other piece's mean colour from that under the stroke, in units of L*a*b*.
const MAX_PIECE_DIFFERENCE: f32 = 14.0;
/// Number of rounds of learning colours and cutting after a stroke.
const ROUNDS: usize = 3;

/// The corrected part, and the strokes so far.
pub(crate) struct Correction<'a> {
    frame: &'a Frame,
    /// Colours around the box, and of the whole photo outside the box.
    surroundings: Option<ColorMixture>,
    pub in_part: Vec<bool>,
    /// The fixed side of a pixel, if a stroke set it.
    pinned: Vec<Option<bool>>,
    /// The pixels that the strokes may change.
    reached: Vec<bool>,
}

impl<'a> Correction<'a> {
    pub fn new(frame: &'a Frame, in_part: Vec<bool>) -> Self {
        let count = in_part.len();
        Self {
            frame,
            surroundings: frame.surroundings(),
            in_part,
            pinned: vec![None; count],
            reached: vec![false; count],
        }
    }

    /// Corrects the part by a further stroke. Distant pixels are not changed.
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
                        // Earlier strokes stay in force.
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

    /// Radius of a stroke's own surroundings, in pixels.
    fn radius(&self) -> f32 {
        (RADIUS_SHARE * (self.frame.width as f64).hypot(self.frame.height() as f64)) as f32
    }

    /// Returns the fraction of the remaining part's border that runs along edges, and the shadow under a stroke, as
    /// pixels of the part. `None` if there is no shadow under the stroke.
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
            // Dark areas in the middle of a part belong to the part, and so do areas that only partly have the shadow's
            // colour.
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

    /// Marks the region that a stroke selects by its colour alone, and the pixels that it may change. A stroke for the
    /// part takes in no colours of the table, except close to it.
    fn pin_alike(&mut self, stroke: &Stroke, distances: &[f32]) {
        let radius = self.radius();
        let Self { frame, surroundings, in_part, pinned, reached } = self;
        let (width, count) = (frame.width, in_part.len());
        let deepest = depth(stroke, in_part, width);
        let reach = REACH * deepest.max(MIN_DISTANCE_PX);
        let own = radius.max(TABLE_REACH * deepest);
        let is_table = |at: usize| {
            stroke.is_inside
                && distances[at] > own
                && surroundings.as_ref().is_some_and(|around| around.explains(&frame.colors[at]))
        };
        let is_open: Vec<bool> = (0..count).map(|at| !is_table(at)).collect();
        for at in 0..count {
            reached[at] |= distances[at] <= reach && is_open[at];
            if distances[at] <= radius {
                pinned[at] = Some(stroke.is_inside);
            }
        }
        pin(stroke, &frame.colors, width, in_part, &is_open, pinned);
    }
}

/// Depth of a stroke in the wrong area, in pixels: at its point farthest from the right side.
fn depth(stroke: &Stroke, in_part: &[bool], width: usize) -> f32 {
    let of_its_side: Vec<usize> = (0..in_part.len()).filter(|&at| in_part[at] == stroke.is_inside).collect();
    let to_side = |&pixel: &usize| {
        let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
        let away = |&at: &usize| ((at % width) as f32 - x).hypot((at / width) as f32 - y);
        of_its_side.iter().map(away).fold(f32::INFINITY, f32::min)
    };
    // A sample of a long stroke's pixels is sufficient.
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

/// The marked pixels and those up to this many horizontal and vertical steps away.
pub(crate) fn grown(marked: &[bool], width: usize, steps: usize) -> Vec<bool> {
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

/// The pixels that look like the surroundings in the shadow under a stroke, or in a weaker one.
fn shadow_under(stroke: &Stroke, surroundings: &ColorMixture, colors: &[Lab]) -> Vec<bool> {
    let shades: Vec<_> = stroke
        .pixels
        .iter()
        .step_by(1 + stroke.pixels.len() / 16)
        .filter_map(|&at| surroundings.shade_of(&colors[at]))
        .collect();
    colors.iter().map(|color| shades.iter().any(|shade| surroundings.explains_under(color, shade))).collect()
}

/// Marks the selected pixels of a stroke in `pinned`: inside, or outside. Only open pixels are selected.
fn pin(stroke: &Stroke, colors: &[Lab], width: usize, in_part: &[bool], is_open: &[bool], pinned: &mut [Option<bool>]) {
    // Costs in thousandths, so that they can be ordered. Each pixel is compared with the stroke's pixel from which it
    // was reached.
    let mut cost = vec![u32::MAX; colors.len()];
    let mut open: BinaryHeap<_> = stroke.pixels.iter().map(|&start| Reverse((0u32, start, start))).collect();
    stroke.pixels.iter().for_each(|&start| cost[start] = 0);
    let budget = (1e3 * MAX_WAY) as u32;
    while let Some(Reverse((so_far, at, start))) = open.pop() {
        if so_far > cost[at] {
            continue;
        }
        // Another stroke's region is not reverted.
        if pinned[at] != Some(!stroke.is_inside) {
            pinned[at] = Some(stroke.is_inside);
        }
        for to in neighbours(at, width, colors.len()) {
            let is_wrong_side = in_part[to] != stroke.is_inside;
            let is_alike = colors[to].distance_squared(&colors[start]) <= MAX_DIFFERENCE * MAX_DIFFERENCE;
            let step = STEP + colors[at].distance_squared(&colors[to]).sqrt();
            let through = so_far.saturating_add((1e3 * step) as u32);
            if is_open[to] && is_wrong_side && is_alike && through <= budget && through < cost[to] {
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
            pin(&stroke, &colors, width, &vec![true; width * height], &vec![true; width * height], pinned);
        };
        pin_all(click(30, 10, false), &mut pinned);
        for (at, pinned) in pinned.iter().enumerate() {
            assert_eq!(*pinned, (at % width >= 20).then_some(false), "{at}");
        }
        // A click on a pixel that is already on the right side selects only this pixel.
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
        // The frame's first pixel is at (23, 23). The start lacks slivers at the left and the right of the disc.
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

    #[test]
    fn a_stroke_for_the_part_takes_in_no_table() {
        // A disc whose right half is hardly lighter than the table; only the left half is in the outline.
        let in_disc = |x: f64, y: f64| (x - 100.0).hypot(y - 100.0) < 50.0;
        let image = RgbImage::from_fn(200, 200, |x, y| {
            let noise = (x * 7 + y * 13) as u8 % 5;
            match (in_disc(f64::from(x), f64::from(y)), x < 100) {
                (true, true) => Rgb([170 + noise, 60, 50]),
                (true, false) => Rgb([140 + noise, 146, 142]),
                (false, _) => Rgb([120, 125 + noise, 121]),
            }
        });
        let bbox = BoundingBox { x1: 45.0, y1: 45.0, x2: 155.0, y2: 155.0 };
        let frame = Frame::cut_out(&image, &bbox, 1e9).unwrap();
        let place = |at: usize| (23.0 + (at % frame.width) as f64, 23.0 + (at / frame.width) as f64);
        let half = |at: usize| in_disc(place(at).0, place(at).1) && place(at).0 < 100.0;
        let start: Vec<bool> = (0..frame.colors.len()).map(half).collect();
        let mut correction = Correction::new(&frame, start);
        let points = [80.0, 100.0, 120.0].map(|y| Point2::new(125.0, y)).to_vec();
        correction.apply(&frame.stroke(&OutlineStroke { points, is_inside: true }).unwrap());
        let count = |is_part: bool| {
            let taken = |&at: &usize| correction.in_part[at] && in_disc(place(at).0, place(at).1) == is_part;
            (0..frame.colors.len()).filter(taken).count() as f64
        };
        let disc = std::f64::consts::PI * 50.0 * 50.0;
        assert!(count(true) > 0.95 * disc && count(false) < 0.03 * disc, "{} and {}", count(true), count(false));
    }
}
