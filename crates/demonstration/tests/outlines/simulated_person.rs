//! A simulated person who corrects a proposed outline: by a click into the widest part of the largest wrong piece, or
//! by a stroke along that piece.

use std::collections::HashSet;

use nalgebra::{Matrix2, Point2, SymmetricEigen};
use sdg_demonstration::{OutlineStroke, propose_outline_with};
use sdg_geometry::{BoundingBox, Mask, Polygon};

use image::RgbImage;

/// An outline compared with the true one.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Overlap of the areas.
    pub iou: f64,
    /// Fraction of the true outline that runs within 3 px, or 1 % of the part's diagonal where that is more, of the
    /// proposed one.
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
    let truth = truth.rasterize(image.width(), image.height());
    let mut clicks = Vec::new();
    let mut outlines = vec![propose_outline_with(image, bbox, &clicks)];
    for _ in 0..num_clicks {
        let Some(click) = stroke(&outlines[outlines.len() - 1], &truth, bbox, 1) else { break };
        clicks.push(click);
        outlines.push(propose_outline_with(image, bbox, &clicks));
    }
    outlines
}

/// A stroke of this many points along the largest wrong piece, through its widest part; with one point, a click there.
pub fn stroke(proposed: &Polygon, truth: &Mask, bbox: &BoundingBox, num_points: usize) -> Option<OutlineStroke> {
    let proposed = proposed.rasterize(truth.width(), truth.height());
    let (place, piece) = widest_of_largest_error(&proposed, truth, bbox)?;
    let at = |[x, y]: [u32; 2]| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let is_inside = truth.get(place[0], place[1]);
    let middle = at(place);
    // Along the piece: from its widest part in both directions, towards most of its area, as far as the piece extends.
    let scatter = piece.iter().map(|&pixel| at(pixel) - middle).map(|off| off * off.transpose()).sum::<Matrix2<f64>>();
    let eigen = SymmetricEigen::new(scatter);
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let lies_in = |point: &Point2<f64>| piece.contains(&[point.x as u32, point.y as u32]);
    let steps = |towards: f64| (0..).map(move |step| middle + along * (towards * f64::from(step))).take_while(lies_in);
    let mut line: Vec<Point2<f64>> = steps(-1.0).collect();
    line.reverse();
    line.extend(steps(1.0).skip(1));
    // The stroke ends before the rim, as people's strokes do.
    let rim = line.len() / 6;
    let line = &line[rim..line.len() - rim];
    let points = match num_points {
        1 => vec![middle],
        _ => (0..num_points).map(|i| line[i * (line.len() - 1) / (num_points - 1)]).collect(),
    };
    Some(OutlineStroke { points, is_inside })
}

type Pixel = [u32; 2];

/// The largest connected wrong piece of one kind, starting with its pixel that is farthest from its border.
fn widest_of_largest_error(proposed: &Mask, truth: &Mask, bbox: &BoundingBox) -> Option<(Pixel, HashSet<Pixel>)> {
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
    // Peeled layer by layer: the last remaining pixel is the widest place.
    let place = |at: usize| [(at % width as usize) as u32, (at / width as usize) as u32];
    let piece = largest.iter().map(|&at| place(at)).collect();
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
    Some((place(widest), piece))
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
