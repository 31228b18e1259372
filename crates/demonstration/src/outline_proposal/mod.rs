//! A first outline of the part in a box, for a person to correct.
//!
//! ```text
//! photo, box ─ frame: box and surroundings, shrunk ─ L*a*b*
//!    │
//!    └─ what the surroundings do not explain, lit or in shadow: the first guess of the part
//!         │
//!         ├─▶ two ColorMixtures ─ evidence of each pixel ─ minimal_cut ─┐   a few rounds
//!         └───────────────────────────◀─────────────────────────────────┤
//!                                     largest piece ─ outer_outline ────┴─ Polygon
//! clicks ─ the pieces of the picture that they mean stay on their side while the rest is cut again
//! ```
//!
//! The energy is that of GrabCut (Rother, Kolmogorov, Blake 2004): how badly each pixel's colour suits its side, and the
//! boundary's length, cheaper along edges of the picture. Two things differ. A part's shadow is mostly inside the box and
//! would be learnt as the part's colour, so that the first guess leaves out what the surroundings look like in shadow. And
//! the cut is found as a convex problem, whose boundaries have no preference for the pixels' axes, in some dozen passes
//! over the picture, instead of by a maximum flow.
//!
//! Absent: any knowledge of parts, and randomness. The same photo and box give the same outline.

mod clicks;
mod color_mixture;
mod lab;
mod minimal_cut;

use image::{RgbImage, imageops};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, Mask, Polygon, outer_outline};

use clicks::Click;
use color_mixture::ColorMixture;
use lab::Lab;
use minimal_cut::{Edges, minimal_cut};

/// Pixels of the frame that is cut; larger ones are shrunk. Bounds the time.
const MAX_PIXELS: f64 = 60_000.0;
/// Surroundings around the box, as a share of its longer side …
const MARGIN_SHARE: f64 = 0.2;
/// … and at least, in pixels of the photo.
const MIN_MARGIN_PX: f64 = 12.0;
/// How often colours are learnt again from the last cut.
const ROUNDS: usize = 6;
/// The same after clicks.
const ROUNDS_AFTER_CLICKS: usize = 3;
/// A piece smaller than this share of the box is no part.
const MIN_AREA_SHARE: f64 = 0.02;
/// Where less of the box than this is left when shadows are taken out, the part itself has a shadow's colour.
const MIN_UNSHADED_SHARE: f64 = 0.05;
/// No pixel's colour alone decides: shadows, highlights and noise have the colours of the other side.
const MAX_EVIDENCE: f32 = 10.0;

/// Proposes the outline of the part that a person drew a box around.
///
/// The outline lies in the box. Where nothing in the box differs from its surroundings, the box itself is proposed.
///
/// # Units and frames
/// Pixels of the photo; the centre of the first pixel is (0.5, 0.5).
pub fn propose_outline(image: &RgbImage, bbox: &BoundingBox) -> Polygon {
    propose_outline_with(image, bbox, &OutlineClicks::default())
}

/// Places of the photo that a person clicked, in pixels: what belongs to the part, and what does not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OutlineClicks {
    /// On the part.
    pub inside: Vec<Point2<f64>>,
    /// Beside it.
    pub outside: Vec<Point2<f64>>,
}

/// The same, corrected by clicks: each means the piece of the picture that it lies on. Clicks outside the box count for nothing.
pub fn propose_outline_with(image: &RgbImage, bbox: &BoundingBox, clicks: &OutlineClicks) -> Polygon {
    let inside = bbox.clip(f64::from(image.width()), f64::from(image.height()));
    let nothing_found = || Polygon::from_box(&if inside.area() > 0.0 { inside } else { *bbox });
    let Some(frame) = Frame::cut_out(image, &inside) else { return nothing_found() };
    let Some(mask) = frame.segment(&frame.clicks(clicks)) else { return nothing_found() };
    let Some(outline) = outer_outline(&mask) else { return nothing_found() };
    // Pieces of the mask reach the edges of whole pixels, the box may lie within one.
    let outline = frame.in_photo(&outline, &inside);
    if outline.area() >= MIN_AREA_SHARE * inside.area() && !outline.crosses_itself() {
        outline
    } else {
        nothing_found()
    }
}

/// The box and its surroundings, in pixels of their own.
struct Frame {
    width: usize,
    height: usize,
    colors: Vec<Lab>,
    /// Whether the centre of a pixel lies in the box: the others are surroundings.
    in_box: Vec<bool>,
    /// Colours of the whole photo outside the box, thinned out.
    elsewhere: Vec<Lab>,
    /// Upper left corner in the photo.
    origin: [f64; 2],
    /// Pixels of the photo for one of the frame, across and down.
    scale: [f64; 2],
}

impl Frame {
    /// `None` for a box of less than a few pixels.
    fn cut_out(image: &RgbImage, bbox: &BoundingBox) -> Option<Self> {
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
        let shrink = (MAX_PIXELS / (f64::from(view.width()) * f64::from(view.height()))).sqrt().min(1.0);
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
        // Every n-th pixel each way: some ten thousand of them.
        let step = (image.width().max(image.height()) / 128).max(1) as usize;
        let mut elsewhere = Vec::new();
        for y in (0..image.height()).step_by(step) {
            for x in (0..image.width()).step_by(step) {
                if !bbox.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)) {
                    elsewhere.push(Lab::from_srgb(image.get_pixel(x, y).0));
                }
            }
        }
        Some(Self {
            width: width as usize,
            height: height as usize,
            colors: shrunk.pixels().map(|pixel| Lab::from_srgb(pixel.0)).collect(),
            in_box,
            elsewhere,
            origin,
            scale,
        })
    }

    /// The pixels that may be the part's: those in the box.
    fn candidates(&self) -> Vec<bool> {
        let mut candidates = self.in_box.clone();
        if self.in_box.iter().all(|&inside| inside) {
            // The box is the whole photo: what touches its edge stands for the surroundings.
            let edge = 1 + self.width.min(self.height) / 40;
            for (at, candidate) in candidates.iter_mut().enumerate() {
                let (x, y) = (at % self.width, at / self.width);
                *candidate = x.min(y).min(self.width - 1 - x).min(self.height - 1 - y) >= edge;
            }
        }
        candidates
    }

    /// The clicks that lie in the box, those on the part first.
    fn clicks(&self, clicks: &OutlineClicks) -> Vec<Click> {
        let all =
            clicks.inside.iter().map(|place| (place, true)).chain(clicks.outside.iter().map(|place| (place, false)));
        let in_frame = all.filter_map(|(place, is_inside)| {
            let x = (place.x - self.origin[0]) / self.scale[0];
            let y = (place.y - self.origin[1]) / self.scale[1];
            let lies_in = (0.0..self.width as f64).contains(&x) && (0.0..self.height as f64).contains(&y);
            lies_in.then_some(Click { x: x as usize, y: y as usize, is_inside })
        });
        in_frame.filter(|click| self.in_box[click.y * self.width + click.x]).collect()
    }

    /// The part's pixels; `None` where nothing stands out.
    fn segment(&self, clicks: &[Click]) -> Option<Mask> {
        let candidates = self.candidates();
        let unclicked = vec![None; self.colors.len()];
        // Without anything that stands out, what was clicked does.
        let first = match self.first_guess(&candidates) {
            Some(guess) => self.cut(guess, &candidates, &unclicked, ROUNDS),
            None => None,
        };
        if clicks.is_empty() {
            return first.map(|in_part| self.mask(&in_part));
        }
        let mut in_part = first.unwrap_or_else(|| vec![false; self.colors.len()]);
        let mut pinned = unclicked;
        for click in clicks {
            clicks::pin(click, &self.colors, self.width, &in_part, &mut pinned);
        }
        for (in_part, pinned) in in_part.iter_mut().zip(&pinned) {
            *in_part = pinned.unwrap_or(*in_part);
        }
        let corrected = self.cut(in_part.clone(), &candidates, &pinned, ROUNDS_AFTER_CLICKS);
        Some(self.mask(&corrected.unwrap_or(in_part)))
    }

    fn mask(&self, in_part: &[bool]) -> Mask {
        Mask::from_fn(self.width as u32, self.height as u32, |x, y| in_part[y as usize * self.width + x as usize])
    }

    /// Learns colours from a division into part and surroundings, cuts by them, and so on; what is pinned stays on its side. `None`
    /// for too few colours.
    fn cut(
        &self,
        mut in_part: Vec<bool>,
        candidates: &[bool],
        pinned: &[Option<bool>],
        rounds: usize,
    ) -> Option<Vec<bool>> {
        let edges = Edges::new(&self.colors, self.width);
        let mut share: Vec<f32> = candidates.iter().map(|&candidate| if candidate { 0.5 } else { 0.0 }).collect();
        let mut mixtures: Option<[ColorMixture; 2]> = None;
        for _ in 0..rounds {
            let (part, mut surroundings) = self.colors_of(&in_part);
            surroundings.extend_from_slice(&self.elsewhere);
            let [part, surroundings] = match &mixtures {
                None => [ColorMixture::learn(&part)?, ColorMixture::learn(&surroundings)?],
                Some([known, around]) => [known.relearn(&part)?, around.relearn(&surroundings)?],
            };
            let evidence: Vec<f32> = self
                .colors
                .iter()
                .zip(candidates)
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
            minimal_cut(&evidence, &edges, &mut share);
            in_part = share.iter().zip(candidates).map(|(&share, &candidate)| candidate && share > 0.5).collect();
            mixtures = Some([part, surroundings]);
        }
        Some(in_part)
    }

    /// The candidates whose colours the surroundings do not have, neither in the light nor in a shadow; `None` where
    /// there are none.
    fn first_guess(&self, candidates: &[bool]) -> Option<Vec<bool>> {
        let (_, mut surroundings) = self.colors_of(candidates);
        surroundings.extend_from_slice(&self.elsewhere);
        let surroundings = ColorMixture::learn(&surroundings)?;
        let guess = |is_explained: &dyn Fn(&Lab) -> bool| -> (Vec<bool>, f64) {
            let unexplained: Vec<bool> = self
                .colors
                .iter()
                .zip(candidates)
                .map(|(color, &candidate)| candidate && !is_explained(color))
                .collect();
            let count = |marks: &[bool]| marks.iter().filter(|&&mark| mark).count() as f64;
            let share = count(&unexplained) / count(candidates).max(1.0);
            (unexplained, share)
        };
        let (unshaded, share) = guess(&|color| surroundings.explains(color) || surroundings.explains_shaded(color));
        if share >= MIN_UNSHADED_SHARE {
            return Some(unshaded);
        }
        let (unexplained, share) = guess(&|color| surroundings.explains(color));
        (share >= MIN_AREA_SHARE).then_some(unexplained)
    }

    /// The colours of the marked pixels, and those of the others.
    fn colors_of(&self, marked: &[bool]) -> (Vec<Lab>, Vec<Lab>) {
        let mut colors = (Vec::new(), Vec::new());
        for (color, &marked) in self.colors.iter().zip(marked) {
            if marked { colors.0.push(*color) } else { colors.1.push(*color) }
        }
        colors
    }

    fn in_photo(&self, outline: &Polygon, bbox: &BoundingBox) -> Polygon {
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A red disc on a chequered table.
    fn disc(size: u32, radius: f64) -> (RgbImage, BoundingBox) {
        let middle = f64::from(size) / 2.0;
        let image = RgbImage::from_fn(size, size, |x, y| {
            let from_middle = (f64::from(x) + 0.5 - middle).hypot(f64::from(y) + 0.5 - middle);
            if from_middle < radius {
                Rgb([170, 60, 50])
            } else if (x / 8 + y / 8).is_multiple_of(2) {
                Rgb([120, 130, 125])
            } else {
                Rgb([150, 150, 145])
            }
        });
        let (low, high) = (middle - radius, middle + radius);
        (image, BoundingBox { x1: low - 6.0, y1: low - 6.0, x2: high + 6.0, y2: high + 6.0 })
    }

    #[test]
    fn a_disc_is_outlined_to_a_pixel() {
        let (image, bbox) = disc(200, 50.0);
        let outline = propose_outline(&image, &bbox);
        for vertex in &outline.vertices {
            let radius = (vertex - Point2::new(100.0, 100.0)).norm();
            assert!((radius - 50.0).abs() < 1.5, "{vertex}: {radius}");
        }
    }

    #[test]
    fn large_photos_are_shrunk_and_outlined_at_their_own_size() {
        let (image, bbox) = disc(1600, 600.0);
        let outline = propose_outline(&image, &bbox);
        for vertex in &outline.vertices {
            let radius = (vertex - Point2::new(800.0, 800.0)).norm();
            // A pixel of the shrunk picture is some seven of the photo.
            assert!((radius - 600.0).abs() < 10.0, "{vertex}: {radius}");
        }
    }

    #[test]
    fn where_nothing_differs_the_box_is_proposed() {
        let flat = RgbImage::from_pixel(100, 80, Rgb([120, 120, 120]));
        let bbox = BoundingBox { x1: 20.0, y1: 20.0, x2: 60.0, y2: 50.0 };
        assert_eq!(propose_outline(&flat, &bbox), Polygon::from_box(&bbox));
        let speck = BoundingBox { x2: 21.0, ..bbox };
        assert_eq!(propose_outline(&flat, &speck), Polygon::from_box(&speck));
        let outside = BoundingBox { x1: 200.0, x2: 260.0, ..bbox };
        assert_eq!(propose_outline(&flat, &outside), Polygon::from_box(&outside));
    }

    #[test]
    fn a_box_around_the_whole_photo_takes_its_edge_for_the_table() {
        let (image, _) = disc(160, 50.0);
        let whole = BoundingBox { x1: -3.0, y1: 0.0, x2: 160.0, y2: 170.0 };
        let area = propose_outline(&image, &whole).area();
        let expected = std::f64::consts::PI * 50.0 * 50.0;
        assert!((area / expected - 1.0).abs() < 0.05, "{area} for {expected}");
    }
}
