//! Views: the input of the network.

use std::sync::Arc;

use burn::tensor::{Device, Int, Tensor, TensorData};
use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};
use sdg_picture::{CropWindow, OUTSIDE, Pyramid};

use crate::config::ComparisonConfig;

/// Channels of each image: the colours, and the colours normalised by their mean and deviation on the part.
const COLOURS: usize = 6;
/// Channels of differences: for each colour channel the difference of the two images on the part, and the fraction of
/// each cell inside the outline.
pub const DIFFERENCES: usize = COLOURS + 1;

/// Side of a view relative to the longer side of the outline's box. The margin is for small errors of the pose.
const SIDE_PER_LENGTH: f64 = 1.25;
/// Grey values per unit of the colours: about the standard deviation of photos.
const GREY_VALUES_PER_UNIT: f32 = 58.0;
/// Added to the standard deviation on the part, in grey values, so that noise on a uniform part stays small.
const DEVIATION_EPSILON: f32 = 12.0;
/// Sample points per pixel along each axis for the fraction inside the outline.
const MASK_SAMPLES: u32 = 2;

/// The two images to compare.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The demonstration's colours, `[3, S, S]`; all views of one reference share them.
    demonstration: Arc<[f32]>,
    /// The picture's colours, `[3, S, S]`.
    picture: Vec<f32>,
    /// Means over the cells of the trunk's map, `[DIFFERENCES, M, M]`.
    differences: Vec<f32>,
}

impl View {
    /// The differences of the two images on the part, `[DIFFERENCES, M, M]`: three colours, three normalised colours,
    /// and the fraction of each cell inside the outline. M is [`ComparisonConfig::trunk_map_px`].
    pub fn differences(&self) -> &[f32] {
        &self.differences
    }
}

/// The demonstration, prepared for comparisons.
#[derive(Debug, Clone)]
pub struct Reference {
    window: CropWindow,
    /// Fraction of each pixel inside the outline, `[S, S]`.
    mask: Vec<f32>,
    /// `[COLOURS, S, S]`.
    own: Vec<f32>,
    /// The first three channels of `own`, which all views share.
    shared: Arc<[f32]>,
    input_px: u32,
    /// Side of a cell in pixels.
    cell_px: usize,
}

impl Reference {
    /// The part inside `outline` of `image`, for the views of a network. Pixels outside the outline do not count in the
    /// differences.
    pub fn new(image: &RgbImage, outline: &Polygon, config: &ComparisonConfig) -> Self {
        let input_px = config.input_px;
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
        let own = colours(&Pyramid::new(image).read(&window, input_px), &mask);
        let shared = own[..3 * mask.len()].into();
        let cell_px = input_px as usize / config.trunk_map_px().max(1);
        Self { window, mask, own, shared, input_px, cell_px }
    }

    /// The view of the picture at a pose, which maps pixels of the demonstration's image to pixels of the picture.
    pub fn view(&self, picture: &Pyramid<'_>, image_from_demonstration: &PlanarSimilarity) -> View {
        let window = CropWindow {
            center: image_from_demonstration.apply(&self.window.center),
            side: self.window.side * image_from_demonstration.scale,
            turn: image_from_demonstration.angle,
        };
        let mut seen = colours(&picture.read(&window, self.input_px), &self.mask);
        let num_pixels = self.mask.len();
        let mut differences = Vec::with_capacity(DIFFERENCES * num_pixels / self.cell_px.pow(2));
        let mut differing = vec![0f32; num_pixels];
        for (own, seen) in self.own.chunks_exact(num_pixels).zip(seen.chunks_exact(num_pixels)) {
            let pixels = own.iter().zip(seen).zip(&self.mask);
            for (difference, ((own, seen), inside)) in differing.iter_mut().zip(pixels) {
                *difference = inside * (own - seen).abs();
            }
            self.append_means(&differing, &mut differences);
        }
        self.append_means(&self.mask, &mut differences);
        seen.truncate(3 * num_pixels);
        View { demonstration: self.shared.clone(), picture: seen, differences }
    }

    /// A pose of this demonstration, corrected by the offset of its view's [`crate::Alignment`].
    pub fn corrected(&self, pose: &PlanarSimilarity, offset: &PlanarSimilarity) -> PlanarSimilarity {
        let px_per_cell = self.window.side / f64::from(self.input_px) * self.cell_px as f64;
        let center = self.window.center;
        let target = center + px_per_cell * Vector2::new(offset.tx, offset.ty);
        pose.compose(&PlanarSimilarity::about(center, target, offset.angle, offset.scale))
    }

    /// Appends the mean of a channel over each cell.
    fn append_means(&self, channel: &[f32], means: &mut Vec<f32>) {
        let (side, cell) = (self.input_px as usize, self.cell_px);
        let share = 1.0 / (cell * cell) as f32;
        for rows in channel.chunks_exact(side * cell) {
            for first in (0..side).step_by(cell) {
                let in_row = |row: &[f32]| row[first..first + cell].iter().sum::<f32>();
                means.push(share * rows.chunks_exact(side).map(in_row).sum::<f32>());
            }
        }
    }
}

/// The colours of a crop as input channels, `[COLOURS, S, S]`.
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

/// Views as input tensors of the network.
pub(crate) struct Batch {
    /// Each demonstration once, `[D, 3, S, S]`.
    pub(crate) demonstrations: Tensor<4>,
    /// The index of each view's demonstration, `[N]`.
    pub(crate) demonstration_of_view: Tensor<1, Int>,
    /// `[N, 3, S, S]`.
    pub(crate) pictures: Tensor<4>,
    /// `[N, DIFFERENCES, M, M]`.
    pub(crate) differences: Tensor<4>,
}

impl Batch {
    /// Stacks the views' values.
    ///
    /// # Panics
    /// Without a view, or with views of several sizes.
    pub(crate) fn new(views: &[View], device: &Device) -> Self {
        let mut demonstrations: Vec<&Arc<[f32]>> = Vec::new();
        let demonstration_of_view: Vec<i32> = views
            .iter()
            .map(|view| {
                let known = demonstrations.iter().position(|other| Arc::ptr_eq(other, &view.demonstration));
                known.unwrap_or_else(|| {
                    demonstrations.push(&view.demonstration);
                    demonstrations.len() - 1
                }) as i32
            })
            .collect();
        let stacked = |channels: usize, parts: Vec<&[f32]>| {
            let len = parts.first().map_or(0, |part| part.len());
            assert!(len > 0 && parts.iter().all(|part| part.len() == len), "all views of a batch have the same size");
            let (n, side) = (parts.len(), (len / channels).isqrt());
            Tensor::<4>::from_data(TensorData::new::<f32, _>(parts.concat(), [n, channels, side, side]), device)
        };
        let n = views.len();
        Self {
            demonstrations: stacked(3, demonstrations.iter().map(|values| &***values).collect()),
            demonstration_of_view: Tensor::from_data(TensorData::new(demonstration_of_view, [n]), device),
            pictures: stacked(3, views.iter().map(|view| &*view.picture).collect()),
            differences: stacked(DIFFERENCES, views.iter().map(|view| &*view.differences).collect()),
        }
    }
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

    /// A network for views of 32 pixels, whose cells are single pixels.
    fn config() -> ComparisonConfig {
        ComparisonConfig { input_px: 32, trunk_channels: Vec::new(), ..ComparisonConfig::edge() }
    }

    /// The greatest difference between the demonstration and the picture inside the outline, over the three channels
    /// from `first`.
    fn difference(reference: &Reference, view: &View, first: usize) -> f32 {
        let n = reference.mask.len();
        let inside = |i: &usize| reference.mask[*i] == 1.0;
        let of_channel = |channel: usize| (0..n).filter(inside).map(move |i| view.differences[channel * n + i]);
        (first..first + 3).flat_map(of_channel).fold(0.0, f32::max)
    }

    #[test]
    fn under_its_pose_the_part_looks_as_in_the_demonstration_and_what_lies_around_it_is_not_seen_in_that() {
        let (image, outline) = photo();
        let reference = Reference::new(&image, &outline, &config());
        let turned = image::imageops::rotate90(&image);
        let turned = Pyramid::new(&turned);
        // A rotation by 90°, clockwise: (x, y) is mapped to (height - y, x).
        let pose = PlanarSimilarity { scale: 1.0, angle: Angle::from_degrees(90.0), tx: 90.0, ty: 0.0 };
        let seen = reference.view(&turned, &pose);
        assert!(difference(&reference, &seen, 0) < 0.1 && difference(&reference, &seen, 3) < 0.1);
        let wrong = reference.view(
            &turned,
            &PlanarSimilarity { tx: 90.0, ty: 140.0, ..PlanarSimilarity { angle: Angle::from_degrees(-90.0), ..pose } },
        );
        assert!(difference(&reference, &wrong, 0) > 0.5);
        let n = reference.mask.len();
        assert!((0..n).filter(|i| reference.mask[*i] == 0.0).all(|i| seen.differences[i] == 0.0));
        // A bar of 80 x 20 pixels in a square of 100.
        let share = reference.mask.iter().sum::<f32>() / n as f32;
        assert!((share - 0.16).abs() < 0.02, "{share}");
    }

    #[test]
    fn light_and_colour_of_the_light_do_not_change_the_normalised_channels() {
        let (image, outline) = photo();
        let reference = Reference::new(&image, &outline, &config());
        let mut dark = image.clone();
        dark.pixels_mut().for_each(|p| p.0 = [p[0] / 2 + 20, p[1] / 2 + 5, p[2] / 2]);
        let seen = reference.view(&Pyramid::new(&dark), &PlanarSimilarity::IDENTITY);
        assert!(difference(&reference, &seen, 0) > 0.5);
        assert!(difference(&reference, &seen, 3) < 0.3);
    }

    #[test]
    fn cells_are_means_of_their_pixels_and_a_reference_is_in_a_batch_once() {
        let (image, outline) = photo();
        let (one, other) = (Reference::new(&image, &outline, &config()), {
            let coarse = ComparisonConfig { input_px: 32, ..ComparisonConfig::edge() };
            Reference::new(&image, &outline, &coarse)
        });
        let picture = Pyramid::new(&image);
        let shifted = PlanarSimilarity { tx: 7.0, ..PlanarSimilarity::IDENTITY };
        let (fine, coarse) = (one.view(&picture, &shifted), other.view(&picture, &shifted));
        let cell = |channel: usize, x: usize, y: usize| {
            let pixels = (0..4).flat_map(|dy| (0..4).map(move |dx| channel * 1024 + (4 * y + dy) * 32 + 4 * x + dx));
            pixels.map(|i| fine.differences[i]).sum::<f32>() / 16.0
        };
        for (channel, x, y) in [(0, 1, 3), (4, 6, 4), (6, 5, 2)] {
            let found = coarse.differences[channel * 64 + y * 8 + x];
            assert!((found - cell(channel, x, y)).abs() < 1e-5, "{channel} {x} {y}: {found}");
        }
        let views = [coarse.clone(), other.view(&picture, &PlanarSimilarity::IDENTITY), coarse];
        let batch = Batch::new(&views, &Device::flex());
        assert_eq!((batch.demonstrations.dims(), batch.pictures.dims()), ([1, 3, 32, 32], [3, 3, 32, 32]));
        assert_eq!(batch.differences.dims(), [3, DIFFERENCES, 8, 8]);
    }
}
