//! Converts the given image to the network's input, and boxes back.
//!
//! The transform runs on the host without tensors, so threads that prepare batches can run it. Coordinates
//! scale with the pixel edges: `x_resized = x_original · width_resized / width_original`, which holds for
//! pixel centres at (0.5, 0.5).

use image::RgbImage;
use sdg_geometry::BoundingBox;

use crate::boxes::Corners;
use crate::config::{ChannelOrder, ImageTransformConfig, PixelRange, ResizeFilter, ResizeRule, SizeRounding};
use crate::error::{DetectionError, Result};
use crate::resample;

/// Resizes and normalises images as configured.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageTransform {
    config: ImageTransformConfig,
}

/// An image ready for batching, with the sizes for the conversion back to the original.
#[derive(Debug, Clone, PartialEq)]
pub struct TransformedImage {
    /// Normalised channels, `[3, height, width]` row by row.
    pub pixels: Vec<f32>,
    /// Height after resizing, without padding.
    pub height: usize,
    /// Width after resizing, without padding.
    pub width: usize,
    /// Height of the given image.
    pub original_height: usize,
    /// Width of the given image.
    pub original_width: usize,
}

impl ImageTransform {
    /// A transform with the given configuration.
    pub fn new(config: &ImageTransformConfig) -> Self {
        Self { config: config.clone() }
    }

    /// Resizes, orders the channels and normalises.
    ///
    /// # Errors
    /// [`DetectionError::EmptyImage`] for an image without pixels.
    pub fn apply(&self, image: &RgbImage) -> Result<TransformedImage> {
        self.apply_part(image, image.dimensions().into())
    }

    /// Like [`Self::apply`], for an `image` that is a part of a larger image with width and height `whole`. The part is
    /// resized by the factor of the larger image.
    ///
    /// # Errors
    /// The errors of [`Self::apply`].
    pub fn apply_part(&self, image: &RgbImage, whole: [u32; 2]) -> Result<TransformedImage> {
        let (original_width, original_height) = image.dimensions();
        if original_width == 0 || original_height == 0 {
            return Err(DetectionError::EmptyImage { width: original_width, height: original_height });
        }
        let (width, height) = part_size(self.config.resize, [original_width, original_height], whole);
        let range = match self.config.pixel_range {
            PixelRange::Byte => 1.0,
            PixelRange::Unit => 255.0,
        };
        let normalised =
            |value: f32, channel: usize| (value / range - self.config.mean[channel]) / self.config.std[channel];
        let pixels = match self.config.filter {
            ResizeFilter::AntialiasedBytes => {
                // A byte has 256 values.
                let table: [[f32; 256]; 3] = [0, 1, 2].map(|c| std::array::from_fn(|byte| normalised(byte as f32, c)));
                let bytes = resample::antialiased_bytes(image, width, height);
                self.planes(&bytes, |byte, channel| table[channel][usize::from(byte)])
            }
            ResizeFilter::Bilinear => self.planes(&resample::bilinear(image, width, height), normalised),
        };
        Ok(TransformedImage {
            pixels,
            height,
            width,
            original_height: original_height as usize,
            original_width: original_width as usize,
        })
    }

    /// One plane for each channel of the network, from interleaved RGB.
    fn planes<T: Copy>(&self, rgb: &[T], normalised: impl Fn(T, usize) -> f32) -> Vec<f32> {
        let mut pixels = Vec::with_capacity(rgb.len());
        for channel in 0..3 {
            let source = match self.config.channel_order {
                ChannelOrder::Rgb => channel,
                ChannelOrder::Bgr => 2 - channel,
            };
            pixels.extend(rgb.chunks_exact(3).map(|rgb| normalised(rgb[source], channel)));
        }
        pixels
    }
}

/// Width and height after resizing.
pub fn resized_size(rule: ResizeRule, width: u32, height: u32) -> (usize, usize) {
    let (w, h) = (f64::from(width), f64::from(height));
    let (scale, rounding) = match rule {
        ResizeRule::ShortSide { short_px, max_long_px, rounding } => {
            ((f64::from(short_px) / w.min(h)).min(f64::from(max_long_px) / w.max(h)), rounding)
        }
        ResizeRule::FitWithin { width_px, height_px } => {
            ((f64::from(width_px) / w).min(f64::from(height_px) / h), SizeRounding::Nearest)
        }
    };
    let round = |exact: f64| {
        let whole = match rounding {
            SizeRounding::Nearest => (exact + 0.5).floor(),
            SizeRounding::Floor => exact.floor(),
        };
        whole.max(1.0) as usize
    };
    (round(w * scale), round(h * scale))
}

/// Width and height of a part of an image when the whole image is resized.
fn part_size(rule: ResizeRule, part: [u32; 2], whole: [u32; 2]) -> (usize, usize) {
    let (width, height) = resized_size(rule, whole[0], whole[1]);
    let side = |part: u32, whole: u32, resized: usize| {
        let exact = f64::from(part) * resized as f64 / f64::from(whole.max(1));
        (exact.round() as usize).max(1)
    };
    (side(part[0], whole[0], width), side(part[1], whole[1], height))
}

impl TransformedImage {
    /// Factors from original to resized pixels, along x and y.
    pub fn resized_from_original(&self) -> [f64; 2] {
        [self.width as f64 / self.original_width as f64, self.height as f64 / self.original_height as f64]
    }

    /// Converts a box of the original image to resized pixels.
    pub fn resized_box(&self, original: &BoundingBox) -> Corners {
        let [sx, sy] = self.resized_from_original();
        [(original.x1 * sx) as f32, (original.y1 * sy) as f32, (original.x2 * sx) as f32, (original.y2 * sy) as f32]
    }

    /// Converts a box of the resized image to original pixels, clipped to the original image.
    pub fn original_box(&self, resized: &Corners) -> BoundingBox {
        let [sx, sy] = self.resized_from_original();
        let [x1, y1, x2, y2] = resized.map(f64::from);
        BoundingBox { x1: x1 / sx, y1: y1 / sy, x2: x2 / sx, y2: y2 / sy }
            .clip(self.original_width as f64, self.original_height as f64)
    }
}

/// Pixels of a batch `[N, 3, H, W]`, padded with zeros on the right and below.
#[derive(Debug, Clone, PartialEq)]
pub struct PaddedBatch {
    /// Values, row by row.
    pub pixels: Vec<f32>,
    /// N, 3, H, W.
    pub dims: [usize; 4],
}

/// Pads images to the largest height and the largest width among them, rounded up to multiples of `size_divisibility`.
pub fn pad_batch(images: &[TransformedImage], size_divisibility: usize) -> PaddedBatch {
    let padded = |extent: fn(&TransformedImage) -> usize| {
        let largest = images.iter().map(extent).max().unwrap_or(0);
        largest.div_ceil(size_divisibility) * size_divisibility
    };
    let (height, width) = (padded(|i| i.height), padded(|i| i.width));
    let dims = [images.len(), 3, height, width];
    let mut pixels = vec![0f32; dims.iter().product()];
    for (image, out) in images.iter().zip(pixels.chunks_exact_mut(3 * height * width)) {
        for channel in 0..3 {
            for row in 0..image.height {
                let from = (channel * image.height + row) * image.width;
                let to = (channel * height + row) * width;
                out[to..to + image.width].copy_from_slice(&image.pixels[from..from + image.width]);
            }
        }
    }
    PaddedBatch { pixels, dims }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets;
    use image::Rgb;

    #[test]
    fn a_part_is_resized_as_the_whole() {
        let rule = ResizeRule::FitWithin { width_px: 320, height_px: 320 };
        // 640 × 480 becomes 320 × 240: half of each side.
        assert_eq!(part_size(rule, [200, 100], [640, 480]), (100, 50));
        assert_eq!(part_size(rule, [640, 480], [640, 480]), resized_size(rule, 640, 480));
        assert_eq!(part_size(rule, [1, 1], [640, 480]), (1, 1));
    }

    #[test]
    fn short_side_rule_by_hand() {
        let rule = |rounding| ResizeRule::ShortSide { short_px: 800, max_long_px: 1333, rounding };
        // 640x480: 800/480 · 640 = 1066.67.
        assert_eq!(resized_size(rule(SizeRounding::Nearest), 640, 480), (1067, 800));
        assert_eq!(resized_size(rule(SizeRounding::Floor), 640, 480), (1066, 800));
        // A long image hits the bound: 1333/2000 · 500 = 333.25.
        assert_eq!(resized_size(rule(SizeRounding::Nearest), 2000, 500), (1333, 333));
    }

    #[test]
    fn normalises_and_orders_channels() {
        let image = RgbImage::from_pixel(640, 480, Rgb([255, 0, 51]));
        let rgb = ImageTransform::new(&presets::edge(12).input).apply(&image).unwrap();
        assert_eq!((rgb.width, rgb.height), (320, 240));
        assert!((rgb.pixels[0] - (1.0 - 0.485) / 0.229).abs() < 1e-5);
        let kind = presets::RcnnKind::Faster { num_classes: 1 };
        let bgr = ImageTransform::new(&presets::r50_detectron2(kind).input).apply(&image).unwrap();
        assert!((bgr.pixels[0] - (51.0 - 103.53)).abs() < 1e-4);
        assert!((bgr.pixels[2 * bgr.width * bgr.height] - (255.0 - 123.675)).abs() < 1e-4);
    }

    #[test]
    fn boxes_go_there_and_back() {
        let image = RgbImage::new(640, 360);
        let transformed = ImageTransform::new(&presets::edge(12).input).apply(&image).unwrap();
        let original = BoundingBox { x1: 10.0, y1: 20.0, x2: 200.0, y2: 300.0 };
        let resized = transformed.resized_box(&original);
        assert_eq!(resized, [5.0, 10.0, 100.0, 150.0]);
        assert_eq!(transformed.original_box(&resized), original);
    }

    #[test]
    fn padding_is_zero_and_a_multiple() {
        let transform = ImageTransform::new(&presets::edge(12).input);
        let wide = transform.apply(&RgbImage::from_pixel(64, 40, Rgb([9, 9, 9]))).unwrap();
        let tall = transform.apply(&RgbImage::from_pixel(40, 60, Rgb([9, 9, 9]))).unwrap();
        assert_eq!((wide.width, wide.height), (320, 200));
        assert_eq!((tall.width, tall.height), (160, 240));
        let batch = pad_batch(&[wide.clone(), tall], 32);
        assert_eq!(batch.dims, [2, 3, 256, 320]);
        assert_eq!(batch.pixels[199 * 320 + 319], wide.pixels[199 * 320 + 319]);
        assert_eq!(batch.pixels[200 * 320], 0.0);
    }

    #[test]
    fn an_image_without_pixels_is_an_error() {
        let result = ImageTransform::new(&presets::edge(12).input).apply(&RgbImage::new(0, 5));
        assert_eq!(result, Err(DetectionError::EmptyImage { width: 0, height: 5 }));
    }
}
