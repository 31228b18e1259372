//! The box and its surroundings, reduced for speed.

use image::{RgbImage, imageops};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, Mask, Polygon, outer_boundary};

use super::color_mixture::ColorMixture;
use super::lab::Lab;
use super::minimal_cut::{self, Edges, minimal_cut};
use super::stroke::{OutlineStroke, Stroke};

/// Width of the surroundings on each side of the box, as a fraction of the box's longer side …
const MARGIN_SHARE: f64 = 0.2;
/// … and at least, in pixels of the photo.
const MIN_MARGIN_PX: f64 = 12.0;
/// Maximum evidence of a pixel's colour. It is limited because shadows, highlights and noise have the colours of the
/// other side.
const MAX_EVIDENCE: f32 = 10.0;

/// The box and its surroundings, in their own pixels.
pub(crate) struct Frame {
    pub width: usize,
    pub colors: Vec<Lab>,
    /// The pixels that may belong to the part: those whose centres lie in the box. The other pixels are surroundings.
    pub candidates: Vec<bool>,
    /// Colours of the whole photo outside the box, subsampled.
    pub elsewhere: Vec<Lab>,
    pub edges: Edges,
    /// Upper left corner in the photo.
    origin: [f64; 2],
    /// Photo pixels per pixel of the frame, across and down.
    scale: [f64; 2],
}

impl Frame {
    /// `None` for a box of less than four pixels in width or height.
    pub fn cut_out(image: &RgbImage, bbox: &BoundingBox, max_pixels: f64) -> Option<Self> {
        const MIN_SIDE_PX: f64 = 4.0;
        if bbox.width() < MIN_SIDE_PX || bbox.height() < MIN_SIDE_PX {
            return None;
        }
        let margin = (MARGIN_SHARE * bbox.width().max(bbox.height())).max(MIN_MARGIN_PX);
        let left = (bbox.x1 - margin).floor().max(0.0) as u32;
        let top = (bbox.y1 - margin).floor().max(0.0) as u32;
        let right = ((bbox.x2 + margin).ceil() as u32).min(image.width());
        let bottom = ((bbox.y2 + margin).ceil() as u32).min(image.height());
        let view = imageops::crop_imm(image, left, top, right - left, bottom - top).to_image();
        let shrink = (max_pixels / (f64::from(view.width()) * f64::from(view.height()))).sqrt().min(1.0);
        let small = |side: u32| ((f64::from(side) * shrink).round() as u32).max(1);
        let (width, height) = (small(view.width()), small(view.height()));
        let shrunk = if shrink < 1.0 { imageops::thumbnail(&view, width, height) } else { view };

        let scale = [f64::from(right - left) / f64::from(width), f64::from(bottom - top) / f64::from(height)];
        let origin = [f64::from(left), f64::from(top)];
        let mut in_box = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let photo_y = origin[1] + (f64::from(y) + 0.5) * scale[1];
            in_box.extend((0..width).map(|x| {
                let photo_x = origin[0] + (f64::from(x) + 0.5) * scale[0];
                bbox.contains(&Point2::new(photo_x, photo_y))
            }));
        }
        // Every n-th pixel in both directions: about ten thousand of them.
        let step = (image.width().max(image.height()) / 128).max(1) as usize;
        let mut elsewhere = Vec::new();
        for y in (0..image.height()).step_by(step) {
            for x in (0..image.width()).step_by(step) {
                if !bbox.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)) {
                    elsewhere.push(Lab::from_srgb(image.get_pixel(x, y).0));
                }
            }
        }
        let colors: Vec<Lab> = shrunk.pixels().map(|pixel| Lab::from_srgb(pixel.0)).collect();
        Some(Self {
            width: width as usize,
            edges: Edges::new(&colors, width as usize),
            colors,
            candidates: without_edge_of_photo(in_box, width as usize),
            elsewhere,
            origin,
            scale,
        })
    }

    pub fn height(&self) -> usize {
        self.colors.len() / self.width
    }

    /// A point of the photo, in pixels of the frame.
    pub fn place_of(&self, point: &Point2<f64>) -> Point2<f64> {
        Point2::new((point.x - self.origin[0]) / self.scale[0], (point.y - self.origin[1]) / self.scale[1])
    }

    /// The pixel at a point of the photo; `None` outside the frame.
    pub fn pixel_of(&self, point: &Point2<f64>) -> Option<usize> {
        self.pixel_at(&self.place_of(point))
    }

    /// The pixel at a place in pixels of the frame; `None` outside the frame.
    fn pixel_at(&self, at: &Point2<f64>) -> Option<usize> {
        let lies_in = (0.0..self.width as f64).contains(&at.x) && (0.0..self.height() as f64).contains(&at.y);
        lies_in.then(|| at.y as usize * self.width + at.x as usize)
    }

    /// The stroke in pixels of the frame, as far as it lies in the box; `None` outside the box.
    pub fn stroke(&self, stroke: &OutlineStroke) -> Option<Stroke> {
        let points: Vec<_> = stroke.points.iter().map(|at| self.place_of(at)).collect();
        let mut pixels = Vec::new();
        let (first, last) = (points.first()?, points.last()?);
        for (from, to) in points.iter().zip(points.iter().skip(1)).chain([(first, first), (last, last)]) {
            // Two steps per pixel, so that none is skipped.
            let steps = (2.0 * (to - from).norm()).ceil().min(2.0 * (self.width + self.height()) as f64) as usize;
            for step in 0..=steps {
                let at = from + (to - from) * (step as f64 / steps.max(1) as f64);
                let Some(pixel) = self.pixel_at(&at) else { continue };
                if self.candidates[pixel] {
                    pixels.push(pixel);
                }
            }
        }
        pixels.sort_unstable();
        pixels.dedup();
        (!pixels.is_empty()).then_some(Stroke { pixels, is_inside: stroke.is_inside })
    }

    /// The candidates inside an outline in the photo.
    pub fn pixels_of(&self, outline: &Polygon) -> Vec<bool> {
        self.pixels_in(&Polygon { vertices: outline.vertices.iter().map(|v| self.place_of(v)).collect() })
    }

    /// The largest piece of the marked candidates, without its holes.
    pub fn largest_piece(&self, marked: &[bool]) -> Vec<bool> {
        let boundary = outer_boundary(&self.mask(marked));
        boundary.map_or_else(|| vec![false; marked.len()], |boundary| self.pixels_in(&boundary))
    }

    /// The candidates inside an outline in pixels of the frame.
    fn pixels_in(&self, outline: &Polygon) -> Vec<bool> {
        let mask = outline.rasterize(self.width as u32, self.height() as u32);
        let is_inside = |at: usize| mask.get((at % self.width) as u32, (at / self.width) as u32);
        self.candidates.iter().enumerate().map(|(at, &candidate)| candidate && is_inside(at)).collect()
    }

    pub fn mask(&self, in_part: &[bool]) -> Mask {
        Mask::from_fn(self.width as u32, self.height() as u32, |x, y| in_part[y as usize * self.width + x as usize])
    }

    /// Alternately learns colours from a division into part and surroundings, and cuts by them; pinned pixels stay on
    /// their side. `elsewhere` has further colours of the surroundings. `None` for too few colours.
    pub fn cut(
        &self,
        mut in_part: Vec<bool>,
        elsewhere: &[Lab],
        pinned: &[Option<bool>],
        rounds: usize,
    ) -> Option<Vec<bool>> {
        let mut share: Vec<f32> = self.candidates.iter().map(|&candidate| if candidate { 0.5 } else { 0.0 }).collect();
        let mut mixtures: Option<[ColorMixture; 2]> = None;
        for _ in 0..rounds {
            let (part, mut surroundings) = self.colors_of(&in_part);
            surroundings.extend_from_slice(elsewhere);
            let [part, surroundings] = match &mixtures {
                None => [ColorMixture::learn(&part)?, ColorMixture::learn(&surroundings)?],
                Some([known, around]) => [known.relearn(&part)?, around.relearn(&surroundings)?],
            };
            let evidence: Vec<f32> = self
                .colors
                .iter()
                .zip(&self.candidates)
                .zip(pinned)
                .map(|((color, &candidate), pinned)| match pinned {
                    _ if !candidate => minimal_cut::SURELY_OUTSIDE,
                    Some(true) => -minimal_cut::SURELY_OUTSIDE,
                    Some(false) => minimal_cut::SURELY_OUTSIDE,
                    None => {
                        let evidence = surroundings.log_density(color) - part.log_density(color);
                        evidence.clamp(-MAX_EVIDENCE, MAX_EVIDENCE)
                    }
                })
                .collect();
            minimal_cut(&evidence, &self.edges, &mut share);
            in_part = share.iter().zip(&self.candidates).map(|(&share, &candidate)| candidate && share > 0.5).collect();
            mixtures = Some([part, surroundings]);
        }
        Some(in_part)
    }

    /// The fraction of the border of the marked pixels that runs along edges of the picture, in [0, 1].
    pub fn share_along_edges(&self, marked: &[bool]) -> f64 {
        let (width, height) = (self.width, self.height());
        let (mut length, mut along_edges) = (0.0, 0.0);
        for at in 0..marked.len() {
            let right = at % width + 1 < width && marked[at] != marked[at + 1];
            let below = at / width + 1 < height && marked[at] != marked[at + width];
            for _ in 0..usize::from(right) + usize::from(below) {
                length += 1.0;
                along_edges += f64::from(self.edges.strength(at));
            }
        }
        along_edges / f64::max(length, 1.0)
    }

    /// The colours of the marked pixels, and those of the other pixels.
    pub fn colors_of(&self, marked: &[bool]) -> (Vec<Lab>, Vec<Lab>) {
        let mut colors = (Vec::new(), Vec::new());
        for (color, &marked) in self.colors.iter().zip(marked) {
            if marked { colors.0.push(*color) } else { colors.1.push(*color) }
        }
        colors
    }

    /// Colours around the box, and of the whole photo outside the box.
    pub fn surroundings(&self) -> Option<ColorMixture> {
        let (_, mut around) = self.colors_of(&self.candidates);
        around.extend_from_slice(&self.elsewhere);
        ColorMixture::learn(&around)
    }

    pub fn in_photo(&self, outline: &Polygon, bbox: &BoundingBox) -> Polygon {
        let vertices = outline
            .vertices
            .iter()
            .map(|v| {
                let x = self.origin[0] + v.x * self.scale[0];
                let y = self.origin[1] + v.y * self.scale[1];
                Point2::new(x.clamp(bbox.x1, bbox.x2), y.clamp(bbox.y1, bbox.y2))
            })
            .collect();
        Polygon { vertices }
    }
}

/// If the box is the whole photo, pixels at its edge serve as surroundings.
fn without_edge_of_photo(mut in_box: Vec<bool>, width: usize) -> Vec<bool> {
    if in_box.iter().all(|&inside| inside) {
        let height = in_box.len() / width;
        let edge = 1 + width.min(height) / 40;
        for (at, candidate) in in_box.iter_mut().enumerate() {
            let (x, y) = (at % width, at / width);
            *candidate = x.min(y).min(width - 1 - x).min(height - 1 - y) >= edge;
        }
    }
    in_box
}
