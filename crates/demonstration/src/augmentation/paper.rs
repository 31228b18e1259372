//! The paper's augmentation: the photo turned, tinted, shifted and scaled, black where nothing is known.

use image::RgbImage;
use nalgebra::Point2;
use rand::Rng;
use sdg_geometry::{Angle, PlanarSimilarity};

use super::config::PaperStyle;
use super::homography::Homography;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, uniform};

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

    /// Photo after rotation, after shift, after scaling, each from the photo, in photo pixels.
    fn stages(&self, photo_size: [f64; 2]) -> [PlanarSimilarity; 3] {
        let center = Point2::new(0.5 * photo_size[0], 0.5 * photo_size[1]);
        let angle = Angle::from_degrees(f64::from(self.rotation_deg));
        let rotated = PlanarSimilarity::about(center, center, angle, 1.0);
        let [dx, dy] = self.shift_px.map(f64::from);
        let shifted = PlanarSimilarity { tx: rotated.tx + dx, ty: rotated.ty + dy, ..rotated };
        let scaling = PlanarSimilarity::about(center, center, Angle::ZERO, f64::from(self.scale));
        [rotated, shifted, scaling.compose(&shifted)]
    }

    /// Output from photo: the three stages, then fitted into the output and centred there.
    pub fn image_from_photo(&self, part: &Prepared, width: u32, height: u32) -> PlanarSimilarity {
        fitted(part, width, height).compose(&self.stages(part.photo_size)[2])
    }

    /// Paints the sample. What an earlier stage has cut off stays black, even if a later one moves its place inside.
    pub fn paint(&self, part: &Prepared, width: u32, height: u32) -> RgbImage {
        let [rotated, shifted, scaled] = self.stages(part.photo_size);
        let fit = fitted(part, width, height);
        let map = |similarity: &PlanarSimilarity| Homography::from_similarity(similarity);
        let photo_from_image = map(&fit.compose(&scaled)).inverse();
        let prepared_from_image = Homography::scaling(part.prepared_from_photo).compose(&photo_from_image);
        // Where the pixel stood after each earlier stage; outside the frame it was cut off.
        let frames = [scaled, shifted, rotated].map(|stage| map(&stage).compose(&photo_from_image));
        let [right, bottom] = part.photo_size.map(|side| side as f32);
        let mut image = RgbImage::new(width, height);
        for y in 0..height {
            let source = prepared_from_image.row(y as usize);
            let frames = frames.map(|frame| frame.row(y as usize));
            let photo = photo_from_image.row(y as usize);
            for x in 0..width {
                let kept = |(u, v): (f32, f32)| u >= 0.0 && v >= 0.0 && u <= right && v <= bottom;
                if !kept(photo.at(x as usize)) || !frames.iter().all(|frame| kept(frame.at(x as usize))) {
                    continue;
                }
                let (u, v) = source.at(x as usize);
                let pixel = part.photo.bilinear(u, v);
                for (k, out) in image.get_pixel_mut(x, y).0.iter_mut().enumerate() {
                    *out = (pixel[k] * self.channel_gain[k] * 255.0 + 0.5) as u8;
                }
            }
        }
        image
    }
}

/// Output from photo where the photo is fitted into the output and centred.
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
    use super::super::random::{Stream, sample_rng};
    use super::*;

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
