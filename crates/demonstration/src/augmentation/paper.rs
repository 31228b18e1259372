//! The paper's augmentation: the photo rotated, tinted, shifted and scaled, black outside the photo.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use rand::Rng;
use sdg_geometry::{Angle, PlanarSimilarity};

use super::config::PaperStyle;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, uniform};
use super::warp::{Gains, RowMap};

/// The numbers of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PaperDraw {
    pub rotation_deg: i32,
    pub channel_gain: [f32; 3],
    pub shift_px: [i32; 2],
    pub scale: f32,
}

impl PaperDraw {
    pub fn draw(style: &PaperStyle, rng: &mut SampleRng) -> Self {
        let rotation_deg = rng.random_range(-style.max_rotation_deg..=style.max_rotation_deg);
        let [low, high] = style.channel_gain;
        let channel_gain = if chance(rng, style.per_channel_probability) {
            std::array::from_fn(|_| uniform(rng, low, high))
        } else {
            [uniform(rng, low, high); 3]
        };
        let mut shift = || rng.random_range(-style.max_shift_px..=style.max_shift_px);
        let shift_px = [shift(), shift()];
        Self { rotation_deg, channel_gain, shift_px, scale: uniform(rng, style.scale[0], style.scale[1]) }
    }

    /// Transforms from the photo to the photo after rotation, after shift and after scaling, in photo pixels.
    fn stages(&self, photo_size: [f64; 2]) -> [PlanarSimilarity; 3] {
        let center = Point2::new(0.5 * photo_size[0], 0.5 * photo_size[1]);
        let angle = Angle::from_degrees(f64::from(self.rotation_deg));
        let rotated = PlanarSimilarity::about(center, center, angle, 1.0);
        let [dx, dy] = self.shift_px.map(f64::from);
        let shifted = rotated.shifted(Vector2::new(dx, dy));
        let scaling = PlanarSimilarity::about(center, center, Angle::ZERO, f64::from(self.scale));
        [rotated, shifted, scaling.compose(&shifted)]
    }

    /// Output from photo: the three stages, then scaled to fit the output and centred.
    pub fn image_from_photo(&self, part: &Prepared, width: u32, height: u32) -> PlanarSimilarity {
        fitted(part, width, height).compose(&self.stages(part.photo_size)[2])
    }

    /// Paints the sample. Areas cropped by an earlier stage stay black, even if a later one moves them inside.
    pub fn paint(&self, part: &Prepared, width: u32, height: u32) -> RgbImage {
        let stages = self.stages(part.photo_size);
        let photo_from_image = fitted(part, width, height).compose(&stages[2]).inverse();
        let prepared_from_photo = PlanarSimilarity { scale: part.prepared_from_photo, ..PlanarSimilarity::IDENTITY };
        let prepared_from_image = RowMap::new(&prepared_from_photo.compose(&photo_from_image));
        // The position of a pixel in the photo and after each stage; a pixel outside one of these frames was cropped.
        let frames = stages.map(|stage| RowMap::new(&stage.compose(&photo_from_image)));
        let frames = [[RowMap::new(&photo_from_image)].as_slice(), &frames].concat();
        let gains = Gains::new(self.channel_gain);
        let width = width as usize;
        let mut bytes = vec![0; 3 * width * height as usize];
        for (y, out) in bytes.chunks_exact_mut(3 * width).enumerate() {
            let kept = frames.iter().fold(0..width, |kept, frame| frame.row(y).inside(part.photo_size, kept));
            let out = &mut out[3 * kept.start..3 * kept.end];
            part.lanes.read(&prepared_from_image.row(y), kept, &gains, out);
        }
        RgbImage::from_raw(width as u32, height, bytes).expect("three bytes were made for each pixel")
    }
}

/// Output from photo when the photo is scaled to fit the output and centred.
fn fitted(part: &Prepared, width: u32, height: u32) -> PlanarSimilarity {
    PlanarSimilarity {
        scale: part.nominal_scale,
        angle: Angle::ZERO,
        tx: 0.5 * (f64::from(width) - part.photo_size[0] * part.nominal_scale),
        ty: 0.5 * (f64::from(height) - part.photo_size[1] * part.nominal_scale),
    }
}

#[cfg(test)]
mod tests {
    use image::Rgb;
    use sdg_geometry::{BoundingBox, Polygon};

    use super::super::random::{Stream, sample_rng};
    use super::*;
    use crate::{Annotation, Demonstration};

    /// A part on a photo of smooth colours, which identify the source of a pixel.
    fn prepared(output: [u32; 2]) -> Prepared {
        let image = RgbImage::from_fn(200, 150, |x, y| Rgb([(x + 40) as u8, (y + 90) as u8, (x / 2 + y) as u8]));
        let bbox = BoundingBox { x1: 60.0, y1: 50.0, x2: 140.0, y2: 100.0 };
        let annotation = Annotation {
            label: "part".into(),
            bbox,
            grasp: None,
            jaw_width: None,
            outline: Some(Polygon::from_box(&bbox)),
        };
        Prepared::new(&Demonstration { image, annotation }, output, &mut sample_rng(1, Stream::Preparation, 0))
    }

    /// Pixel by pixel in double precision, from the definition.
    fn reference(draw: &PaperDraw, part: &Prepared, width: u32, height: u32) -> Vec<Option<[f64; 3]>> {
        let stages = draw.stages(part.photo_size);
        let photo_from_image = draw.image_from_photo(part, width, height).inverse();
        let inside =
            |p: &Point2<f64>| p.x >= 0.0 && p.y >= 0.0 && p.x <= part.photo_size[0] && p.y <= part.photo_size[1];
        let places = (0..width * height).map(|i| Point2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5));
        places
            .map(|place| {
                let photo = photo_from_image.apply(&place);
                let kept = inside(&photo) && stages.iter().all(|stage| inside(&stage.apply(&photo)));
                kept.then(|| {
                    let p = photo * part.prepared_from_photo;
                    let pixel = part.photo.bilinear(p.x as f32, p.y as f32);
                    std::array::from_fn(|k| f64::from((pixel[k] * draw.channel_gain[k] * 255.0).min(255.0)))
                })
            })
            .collect()
    }

    #[test]
    fn samples_agree_with_the_definition_pixel_by_pixel() {
        // The photo's smooth colours need no more than the rounding of a byte and of a weight.
        const TOLERANCE: f64 = 1.0;
        for size in [[200, 150], [100, 75], [90, 160]] {
            let part = prepared(size);
            for index in 0..12 {
                let draw = PaperDraw::draw(&PaperStyle::default(), &mut sample_rng(3, Stream::Training, index));
                let image = draw.paint(&part, size[0], size[1]);
                let expected = reference(&draw, &part, size[0], size[1]);
                let mut seen = 0;
                for (pixel, expected) in image.pixels().zip(&expected) {
                    match expected {
                        None => assert_eq!(pixel.0, [0; 3], "{draw:?} cut this off"),
                        Some(color) => {
                            seen += 1;
                            let off = (0..3).map(|k| (f64::from(pixel[k]) - color[k]).abs()).fold(0.0, f64::max);
                            assert!(off <= TOLERANCE, "{draw:?}: {pixel:?}, not {color:?}");
                        }
                    }
                }
                assert!(seen > expected.len() / 20, "{draw:?} shows {seen} pixels only");
            }
        }
    }

    #[test]
    fn draws_span_the_published_ranges() {
        let draws: Vec<PaperDraw> = (0..3000)
            .map(|index| PaperDraw::draw(&PaperStyle::default(), &mut sample_rng(7, Stream::Training, index)))
            .collect();
        let range = |of: &dyn Fn(&PaperDraw) -> f32| {
            draws.iter().map(of).fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v), high.max(v)))
        };
        let within = |(low, high): (f32, f32), wanted: [f32; 2], slack: f32| {
            assert!(low >= wanted[0] && high <= wanted[1], "{low}..{high} leaves {wanted:?}");
            assert!(low < wanted[0] + slack && high > wanted[1] - slack, "{low}..{high} does not span {wanted:?}");
        };
        within(range(&|d| d.rotation_deg as f32), [-180.0, 180.0], 1.0);
        within(range(&|d| d.shift_px[0] as f32), [-30.0, 30.0], 0.5);
        within(range(&|d| d.shift_px[1] as f32), [-30.0, 30.0], 0.5);
        within(range(&|d| d.scale), [0.75, 1.3], 0.01);
        (0..3).for_each(|k| within(range(&|d| d.channel_gain[k]), [0.4, 1.5], 0.01));
        let same = draws.iter().filter(|d| d.channel_gain[0] == d.channel_gain[1]).count();
        assert!((10..60).contains(&same), "{same} of 3000 without a gain per channel");
    }
}
