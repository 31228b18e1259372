//! A person who clicks where a proposed outline is wrong: into the widest part of the largest wrong piece.

use nalgebra::Point2;
use sdg_demonstration::{OutlineClick, propose_outline_with};
use sdg_geometry::{BoundingBox, Mask, Polygon};

use image::RgbImage;

/// An outline against the true one.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Overlap of the areas.
    pub iou: f64,
    /// Share of the true outline that runs within 3 px, or 1 % of the part's diagonal where that is more, of the proposed one.
    pub near: f64,
}

pub fn agreement(proposed: &Polygon, truth: &Polygon, image: &RgbImage) -> Agreement {
    let (width, height) = image.dimensions();
    let iou = proposed.rasterize(width, height).iou(&truth.rasterize(width, height));
    let bounds = truth.bounds();
    let tolerance = (0.01 * bounds.width().hypot(bounds.height())).max(3.0);
    let mut points = Vec::new();
    for (from, to) in truth.edges() {
        let steps = (to - from).norm().ceil().max(1.0) as usize;
        points.extend((0..steps).map(|step| from + (to - from) * (step as f64 / steps as f64)));
    }
    let near = points.iter().filter(|point| proposed.distance_to_edge(point) <= tolerance).count();
    Agreement { iou, near: near as f64 / points.len() as f64 }
}

/// The outlines after no, one, two … clicks.
pub fn outlines(image: &RgbImage, bbox: &BoundingBox, truth: &Polygon, num_clicks: usize) -> Vec<Polygon> {
    let (width, height) = image.dimensions();
    let truth = truth.rasterize(width, height);
    let mut clicks = Vec::new();
    let mut outlines = vec![propose_outline_with(image, bbox, &clicks)];
    for _ in 0..num_clicks {
        let proposed = outlines[outlines.len() - 1].rasterize(width, height);
        let Some(place) = widest_of_largest_error(&proposed, &truth, bbox) else { break };
        let at = Point2::new(f64::from(place[0]) + 0.5, f64::from(place[1]) + 0.5);
        clicks.push(OutlineClick { at, is_inside: truth.get(place[0], place[1]) });
        outlines.push(propose_outline_with(image, bbox, &clicks));
    }
    outlines
}

/// The pixel that is farthest from the border of the largest connected wrong piece of one kind.
fn widest_of_largest_error(proposed: &Mask, truth: &Mask, bbox: &BoundingBox) -> Option<[u32; 2]> {
    let (width, height) = (truth.width(), truth.height());
    let kind = |x: u32, y: u32| {
        let lies_in = bbox.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        match (proposed.get(x, y), truth.get(x, y)) {
            (true, false) if lies_in => 1u8,
            (false, true) if lies_in => 2,
            _ => 0,
        }
    };
    let kinds: Vec<u8> = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| kind(x, y)).collect();
    let mut seen = vec![false; kinds.len()];
    let mut largest: Vec<usize> = Vec::new();
    for start in 0..kinds.len() {
        if kinds[start] == 0 || seen[start] {
            continue;
        }
        seen[start] = true;
        let mut piece = vec![start];
        let mut next = 0;
        while next < piece.len() {
            let at = piece[next];
            next += 1;
            for to in neighbours(at, width as usize, kinds.len()) {
                if !seen[to] && kinds[to] == kinds[start] {
                    seen[to] = true;
                    piece.push(to);
                }
            }
        }
        if piece.len() > largest.len() {
            largest = piece;
        }
    }
    // Peeled layer by layer: the last pixel left is the widest place.
    let mut left = vec![false; kinds.len()];
    largest.iter().for_each(|&at| left[at] = true);
    let mut layer = largest;
    let mut widest = *layer.first()?;
    while let Some(&first) = layer.first() {
        widest = first;
        let (inner, rim): (Vec<usize>, Vec<usize>) = layer.into_iter().partition(|&at| {
            let around = neighbours(at, width as usize, left.len());
            around.len() == 4 && around.into_iter().all(|to| left[to])
        });
        rim.iter().for_each(|&at| left[at] = false);
        layer = inner;
    }
    Some([(widest % width as usize) as u32, (widest / width as usize) as u32])
}

fn neighbours(at: usize, width: usize, count: usize) -> Vec<usize> {
    let mut to = Vec::with_capacity(4);
    if !at.is_multiple_of(width) {
        to.push(at - 1);
    }
    if !(at + 1).is_multiple_of(width) {
        to.push(at + 1);
    }
    if at >= width {
        to.push(at - width);
    }
    if at + width < count {
        to.push(at + width);
    }
    to
}
