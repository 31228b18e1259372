//! Views: what the network looks at.

use burn::tensor::{Device, Tensor, TensorData};
use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};
use sdg_orientation::{CropWindow, OUTSIDE};

/// Channels of one side: the colours, and the same less their mean on the part and over their deviation there.
const COLOURS: usize = 6;
/// Channels that say how far the two sides differ on the part, colour by colour, and the share of each pixel inside the
/// outline.
pub const DIFFERENCES: usize = COLOURS + 1;
/// Channels of a view: the demonstration's colours, the picture's, and [`DIFFERENCES`].
pub const CHANNELS: usize = 6 + DIFFERENCES;

/// Side of a view over the longer side of the outline's box: room for a pose that is a little off.
const SIDE_PER_LENGTH: f64 = 1.25;
/// Grey values that make one unit of the colours: about the deviation of photos.
const GREY_VALUES_PER_UNIT: f32 = 58.0;
/// Added to the deviation on the part, so that noise on an even part stays small, in grey values.
const DEVIATION_EPSILON: f32 = 12.0;
/// Points of a pixel along each axis that are asked whether they lie inside the outline.
const MASK_SAMPLES: u32 = 2;

/// A view's values, `[CHANNELS, S, S]`.
#[derive(Debug, Clone, PartialEq)]
pub struct View(Vec<f32>);

impl View {
    /// `[CHANNELS, S, S]`.
    pub fn values(&self) -> &[f32] {
        &self.0
    }
}

/// The demonstration's side of the comparison.
#[derive(Debug, Clone)]
pub struct Reference {
    window: CropWindow,
    /// Share of each pixel inside the outline, `[S, S]`.
    mask: Vec<f32>,
    /// `[COLOURS, S, S]`.
    own: Vec<f32>,
    input_px: u32,
}

impl Reference {
    /// The part inside `outline` of `image`, for views of `input_px` pixels a side. What is outside of the outline is not seen.
    pub fn new(image: &RgbImage, outline: &Polygon, input_px: u32) -> Self {
        let bounds = outline.bounds();
        let side = (SIDE_PER_LENGTH * bounds.width().max(bounds.height())).max(1.0);
        let window = CropWindow { center: bounds.center(), side, turn: Angle::ZERO };
        let fine = input_px * MASK_SAMPLES;
        let in_window = PlanarSimilarity::about(
            window.center,
            Point2::new(0.5 * f64::from(fine), 0.5 * f64::from(fine)),
            Angle::ZERO,
            f64::from(fine) / side,
        );
        let inside = outline.transformed(&in_window).rasterize(fine, fine);
        let share = 1.0 / (MASK_SAMPLES * MASK_SAMPLES) as f32;
        let pixel = |i: u32| {
            let (x, y) = (i % input_px * MASK_SAMPLES, i / input_px * MASK_SAMPLES);
            let samples = (0..MASK_SAMPLES).flat_map(|dy| (0..MASK_SAMPLES).map(move |dx| (x + dx, y + dy)));
            samples.filter(|&(x, y)| inside.get(x, y)).count() as f32 * share
        };
        let mask: Vec<f32> = (0..input_px * input_px).map(pixel).collect();
        let own = colours(&window.read(image, input_px), &mask);
        Self { window, mask, own, input_px }
    }

    /// The demonstration, and what an image shows where a pose puts it; pixels of the demonstration's image to pixels of `image`.
    pub fn view(&self, image: &RgbImage, image_from_demonstration: &PlanarSimilarity) -> View {
        let window = CropWindow {
            center: image_from_demonstration.apply(&self.window.center),
            side: self.window.side * image_from_demonstration.scale,
            turn: image_from_demonstration.angle,
        };
        let seen = colours(&window.read(image, self.input_px), &self.mask);
        let num_pixels = self.mask.len();
        let mut values = Vec::with_capacity(CHANNELS * num_pixels);
        values.extend_from_slice(&self.own[..3 * num_pixels]);
        values.extend_from_slice(&seen[..3 * num_pixels]);
        let pairs = self.own.iter().zip(&seen).zip(self.mask.iter().cycle());
        values.extend(pairs.map(|((own, seen), inside)| inside * (own - seen).abs()));
        values.extend_from_slice(&self.mask);
        View(values)
    }
}

/// The colours of a crop as the network sees them, `[COLOURS, S, S]`.
fn colours(crop: &RgbImage, mask: &[f32]) -> Vec<f32> {
    let num_pixels = mask.len();
    let mut values = vec![0f32; COLOURS * num_pixels];
    let weight = mask.iter().sum::<f32>().max(1.0);
    let (mut means, mut variance) = ([0f32; 3], 0.0);
    for (rgb, inside) in crop.as_raw().chunks_exact(3).zip(mask) {
        (0..3).for_each(|channel| means[channel] += inside * f32::from(rgb[channel]) / weight);
    }
    for (rgb, inside) in crop.as_raw().chunks_exact(3).zip(mask) {
        let squares: f32 = (0..3).map(|channel| (f32::from(rgb[channel]) - means[channel]).powi(2)).sum();
        variance += inside * squares / (3.0 * weight);
    }
    let deviation = variance.sqrt() + DEVIATION_EPSILON;
    for (i, rgb) in crop.as_raw().chunks_exact(3).enumerate() {
        for channel in 0..3 {
            let grey = f32::from(rgb[channel]);
            values[channel * num_pixels + i] = (grey - f32::from(OUTSIDE[channel])) / GREY_VALUES_PER_UNIT;
            values[(3 + channel) * num_pixels + i] = (grey - means[channel]) / deviation;
        }
    }
    values
}

/// Views as the network's input, `[N, CHANNELS, S, S]`.
///
/// # Panics
/// Without a view, or with views of several sizes.
pub fn batch(views: &[View], device: &Device) -> Tensor<4> {
    let len = views.first().expect("a batch has a view at least").0.len();
    assert!(views.iter().all(|view| view.0.len() == len), "views of one batch have one size");
    let side = (len / CHANNELS).isqrt();
    let values = views.iter().flat_map(|view| view.0.iter().copied()).collect();
    Tensor::from_data(TensorData::new::<f32, _>(values, [views.len(), CHANNELS, side, side]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::BoundingBox;

    /// A bar of two colours on a table.
    fn photo() -> (RgbImage, Polygon) {
        let outline = Polygon::from_box(&BoundingBox { x1: 20.0, y1: 30.0, x2: 100.0, y2: 50.0 });
        let image = RgbImage::from_fn(140, 90, |x, y| {
            let inside = outline.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            Rgb(if !inside {
                [30; 3]
            } else if x < 60 {
                [200, 120, 60]
            } else {
                [90, 140, 220]
            })
        });
        (image, outline)
    }

    /// The greatest difference between the demonstration and the picture inside the outline, over three channels.
    fn difference(reference: &Reference, view: &View, first: usize) -> f32 {
        let n = reference.mask.len();
        let inside = |i: &usize| reference.mask[*i] == 1.0;
        let of_channel = |channel: usize| (0..n).filter(inside).map(move |i| view.0[(6 + channel) * n + i]);
        (first..first + 3).flat_map(of_channel).fold(0.0, f32::max)
    }

    #[test]
    fn under_its_pose_the_part_looks_as_in_the_demonstration_and_what_lies_around_it_is_not_seen_in_that() {
        let (image, outline) = photo();
        let reference = Reference::new(&image, &outline, 32);
        let turned = image::imageops::rotate90(&image);
        // A quarter turn clockwise as seen: (x, y) goes to (height - y, x).
        let pose = PlanarSimilarity { scale: 1.0, angle: Angle::from_degrees(90.0), tx: 90.0, ty: 0.0 };
        let seen = reference.view(&turned, &pose);
        assert!(difference(&reference, &seen, 0) < 0.1 && difference(&reference, &seen, 3) < 0.1);
        let wrong = reference.view(
            &turned,
            &PlanarSimilarity { tx: 90.0, ty: 140.0, ..PlanarSimilarity { angle: Angle::from_degrees(-90.0), ..pose } },
        );
        assert!(difference(&reference, &wrong, 0) > 0.5);
        let n = reference.mask.len();
        assert!((0..n).filter(|i| reference.mask[*i] == 0.0).all(|i| seen.0[6 * n + i] == 0.0));
        // A bar of 80 x 20 pixels in a square of 100.
        let share = reference.mask.iter().sum::<f32>() / n as f32;
        assert!((share - 0.16).abs() < 0.02, "{share}");
    }

    #[test]
    fn light_and_colour_of_the_light_do_not_change_the_normalised_channels() {
        let (image, outline) = photo();
        let reference = Reference::new(&image, &outline, 32);
        let mut dark = image.clone();
        dark.pixels_mut().for_each(|p| p.0 = [p[0] / 2 + 20, p[1] / 2 + 5, p[2] / 2]);
        let seen = reference.view(&dark, &PlanarSimilarity::IDENTITY);
        assert!(difference(&reference, &seen, 0) > 0.5);
        assert!(difference(&reference, &seen, 3) < 0.3);
    }
}
