//! Whether the picture shows the photo's features at the photo's places: holes, lugs, print, lengths.
//!
//! A second network beside the likeness ([`crate::likeness`]). The likeness network has an input of 64 pixels and
//! distinguishes parts from background. This network has an input of 128 pixels and was trained only on rendered parts
//! and their look-alikes. In a look-alike one feature is moved, absent, added or of another size, or the print differs
//! (docs/decisions/026-details.md).

mod network;

use image::RgbImage;
use sdg_geometry::{PlanarSimilarity, Polygon};

use self::network::{Answer, CELL, CELLS_SIDE, Features, NUM_CHANNELS, Network, SIDE};
use crate::frame::Frame;
use crate::likeness::exposed_values;

/// Minimum longer side of the part in photo and picture, in pixels.
const MIN_PX: f64 = 40.0;
/// Below this size only evidence for the part counts: a bearing of 50 pixels is mistaken for another one, although the
/// training set contains such parts.
const MIN_PX_AGAINST: f64 = 75.0;
/// The part's longer side in the network's input.
const PART_SIDE: f64 = SIDE as f64 / 1.2;

/// A demonstration prepared for comparison with pictures by the network.
#[derive(Debug, Clone)]
pub struct Details {
    frame: Frame,
    colors: Vec<Option<[f32; 3]>>,
    inside: Vec<bool>,
    /// The photo's features, used where the picture covers the whole frame.
    features: Features,
}

impl Details {
    /// Reads the part from its cut-out; `outline` is in pixels of the cut-out.
    pub fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        let frame = Frame::about(&outline.bounds(), PART_SIDE, SIDE);
        let colors = frame.sampled(cutout, &PlanarSimilarity::IDENTITY);
        let inside: Vec<bool> = frame.pixels().map(|at| outline.contains(&frame.place(at))).collect();
        let features = features(&colors, &inside, &vec![true; inside.len()]);
        Self { frame, colors, inside, features }
    }

    /// ln of the odds that the image shows the part at the pose instead of a look-alike or anything else, with the
    /// network's training ratio of three wrong poses for two right ones. `None` where photo or picture shows the part
    /// too small for its details.
    pub fn log_odds(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Option<f64> {
        let log_odds = f64::from(self.compared(image, image_from_cutout)?.log_odds);
        let is_small = self.longer_side_px(image_from_cutout) < MIN_PX_AGAINST;
        Some(if is_small { log_odds.max(0.0) } else { log_odds })
    }

    /// Squares of the image, in its pixels, that probably differ from the photo; empty where the part is too small for
    /// evidence against the pose.
    pub fn differing(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Polygon> {
        if self.longer_side_px(image_from_cutout) < MIN_PX_AGAINST {
            return Vec::new();
        }
        let cells = self.compared(image, image_from_cutout).map(|answer| answer.cells).unwrap_or_default();
        let square = |cell: usize| {
            let [x, y] = [cell % CELLS_SIDE, cell / CELLS_SIDE].map(|k| (k * CELL) as f64);
            let side = CELL as f64;
            let corners = [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
            Polygon { vertices: corners.map(|corner| image_from_cutout.apply(&self.frame.place(corner))).to_vec() }
        };
        let differs = |(cell, log_odds): (usize, Option<f32>)| (log_odds? > 0.0).then(|| square(cell));
        cells.into_iter().enumerate().filter_map(differs).collect()
    }

    /// Length in pixels of the part's longer side: the smaller of its lengths in photo and picture.
    fn longer_side_px(&self, image_from_cutout: &PlanarSimilarity) -> f64 {
        PART_SIDE * self.frame.step() * image_from_cutout.scale.min(1.0)
    }

    fn compared(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Option<Answer> {
        if self.longer_side_px(image_from_cutout) < MIN_PX {
            return None;
        }
        let picture = self.frame.sampled(image, image_from_cutout);
        let is_seen: Vec<bool> = picture.iter().map(Option::is_some).collect();
        let of_picture = features(&picture, &self.inside, &is_seen);
        // Where the frame extends beyond the picture, the photo's features are computed again, with the picture's mask
        // of visible pixels.
        let cut = is_seen.contains(&false).then(|| features(&self.colors, &self.inside, &is_seen));
        let of_photo = cut.as_ref().unwrap_or(&self.features);
        Some(Network::shipped().compared(of_photo, &of_picture, &self.inside))
    }
}

fn features(colors: &[Option<[f32; 3]>], inside: &[bool], is_seen: &[bool]) -> Features {
    let mut values = Vec::with_capacity(NUM_CHANNELS * inside.len());
    for ((color, inside), is_seen) in exposed_values(colors, inside).zip(inside).zip(is_seen) {
        values.extend(color);
        values.extend([*inside, *is_seen].map(|is| f32::from(u8::from(is))));
    }
    Network::shipped().features(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::BoundingBox;

    /// A plate with two holes on a table; the second hole at `hole_x`.
    fn plate(hole_x: f32, light: f32) -> RgbImage {
        RgbImage::from_fn(320, 240, |x, y| {
            let is_hole = |cx: f32, cy: f32| (x as f32 - cx).hypot(y as f32 - cy) < 9.0;
            let on_plate = (80..240).contains(&x) && (70..170).contains(&y);
            let color = match () {
                () if on_plate && !is_hole(110.0, 100.0) && !is_hole(hole_x, 140.0) => [60.0, 62.0, 70.0],
                () if on_plate => [25.0, 25.0, 28.0],
                () => [180.0, 170.0, 160.0],
            };
            Rgb(color.map(|value: f32| (value * light) as u8))
        })
    }

    #[test]
    fn a_hole_elsewhere_speaks_against_the_part_and_other_light_does_not() {
        let outline = Polygon::from_box(&BoundingBox { x1: 80.0, y1: 70.0, x2: 240.0, y2: 170.0 });
        let taught = Details::new(&plate(205.0, 1.0), &outline);
        let seen = |picture: &RgbImage| taught.log_odds(picture, &PlanarSimilarity::IDENTITY).unwrap();
        let (same, darker, moved) = (seen(&plate(205.0, 1.0)), seen(&plate(205.0, 0.6)), seen(&plate(165.0, 1.0)));
        assert!(same > 0.5 && darker > 0.5 && moved < same - 2.0, "{same} {darker} {moved}");
    }

    #[test]
    fn what_differs_is_marked_where_the_hole_was_or_is() {
        let outline = Polygon::from_box(&BoundingBox { x1: 80.0, y1: 70.0, x2: 240.0, y2: 170.0 });
        let taught = Details::new(&plate(205.0, 1.0), &outline);
        let marked = |picture: &RgbImage| taught.differing(picture, &PlanarSimilarity::IDENTITY);
        assert!(marked(&plate(205.0, 0.6)).is_empty());
        let squares = marked(&plate(165.0, 1.0));
        let has = |x: f64, y: f64| squares.iter().any(|square| square.contains(&nalgebra::Point2::new(x, y)));
        assert!((has(205.0, 140.0) || has(165.0, 140.0)) && !has(110.0, 100.0), "{squares:?}");
    }

    #[test]
    fn a_part_at_the_picture_s_edge_is_compared_where_it_is_seen() {
        let outline = Polygon::from_box(&BoundingBox { x1: 80.0, y1: 70.0, x2: 240.0, y2: 170.0 });
        let taught = Details::new(&plate(205.0, 1.0), &outline);
        let cut = image::imageops::crop_imm(&plate(205.0, 1.0), 0, 0, 225, 240).to_image();
        let whole = taught.log_odds(&plate(205.0, 1.0), &PlanarSimilarity::IDENTITY).unwrap();
        let at_edge = taught.log_odds(&cut, &PlanarSimilarity::IDENTITY).unwrap();
        assert!(at_edge > 1.0 && at_edge < whole, "{at_edge} {whole}");
    }

    #[test]
    fn nothing_speaks_against_a_small_part_and_a_tiny_one_is_not_judged() {
        let outline = Polygon::from_box(&BoundingBox { x1: 80.0, y1: 70.0, x2: 240.0, y2: 170.0 });
        let taught = Details::new(&plate(205.0, 1.0), &outline);
        // The same plate, and a table without it.
        let at = |scale: f64, picture: &RgbImage| {
            taught.log_odds(picture, &PlanarSimilarity { scale, ..PlanarSimilarity::IDENTITY })
        };
        let (plate, table) = (plate(205.0, 1.0), RgbImage::from_pixel(320, 240, Rgb([180, 170, 160])));
        assert!(at(0.2, &plate).is_none() && at(2.0, &plate).is_some());
        assert_eq!(at(0.4, &table), Some(0.0));
        assert!(at(0.5, &table).unwrap() < 0.0);
    }
}
