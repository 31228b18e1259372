//! A square around the part, in the frame of its photo, into which photo and pictures are sampled.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use pulp::{Simd, WithSimd};
use sdg_geometry::{BoundingBox, PlanarSimilarity};
use wide::f32x4;

use crate::lanes::{LANES, in_lanes};
use crate::pixel_cell::PixelReader;

/// The square, `side` pixels wide.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    /// Cut-out pixels per pixel of the square.
    step: f64,
    /// In pixels of the cut-out.
    center: Point2<f64>,
    pub(crate) side: usize,
}

impl Frame {
    /// A square in which the longer side of the part is `part_side` pixels long; `bounds` are the part's, in pixels of
    /// the cut-out.
    pub(crate) fn about(bounds: &BoundingBox, part_side: f64, side: usize) -> Self {
        Self { step: bounds.width().max(bounds.height()) / part_side, center: bounds.center(), side }
    }

    /// Cut-out pixels per pixel of the square.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// The position in the cut-out of a point of the square.
    pub(crate) fn place(&self, at: [f64; 2]) -> Point2<f64> {
        self.center + self.step * Vector2::from(at.map(|coordinate| coordinate - 0.5 * self.side as f64))
    }

    /// The position in the square of a point of the cut-out.
    pub(crate) fn place_of(&self, point: &Point2<f64>) -> [f64; 2] {
        let from_center = (point - self.center) / self.step;
        [from_center.x, from_center.y].map(|coordinate| coordinate + 0.5 * self.side as f64)
    }

    /// Pixel centres, row by row.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        let side = self.side;
        (0..side * side).map(move |i| [i % side, i / side].map(|k| k as f64 + 0.5))
    }

    /// Mean colours over the pixels, from 0 to 1, row by row; `None` where there is no image. Enough samples are taken
    /// per side that no pixel of the image is skipped.
    pub(crate) fn sampled(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Option<[f32; 3]>> {
        self.sampled_by(image, image_from_cutout, (self.step * image_from_cutout.scale).ceil())
    }

    /// Mean colours as [`Self::sampled`] returns them, but from fewer samples, so that some pixels may be skipped.
    pub(crate) fn sampled_sparsely(
        &self,
        image: &RgbImage,
        image_from_cutout: &PlanarSimilarity,
    ) -> Vec<Option<[f32; 3]>> {
        self.sampled_by(image, image_from_cutout, (self.step * image_from_cutout.scale).round())
    }

    fn sampled_by(
        &self,
        image: &RgbImage,
        image_from_cutout: &PlanarSimilarity,
        samples_a_side: f64,
    ) -> Vec<Option<[f32; 3]>> {
        let num = samples_a_side.max(1.0) as usize;
        let first = [0.5 / num as f64; 2];
        let origin = image_from_cutout.apply(&self.place(first));
        let across = image_from_cutout.apply(&self.place([first[0] + 1.0, first[1]])) - origin;
        let reader = PixelReader::new(image);
        in_lanes(SampleFrame { reader, side: self.side, num, origin, across })
    }
}

/// Reads `num` × `num` samples per pixel, the first at `origin`; `across` is the step between neighbouring pixels of a
/// row.
struct SampleFrame<'a> {
    reader: PixelReader<'a>,
    side: usize,
    num: usize,
    origin: Point2<f64>,
    across: Vector2<f64>,
}

impl WithSimd for SampleFrame<'_> {
    type Output = Vec<Option<[f32; 3]>>;

    /// Plain loops; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { reader, side, num, origin, across } = self;
        let down = Vector2::new(-across.y, across.x);
        let one_more = 1.0 / num as f64;
        let [step_x, step_y] = [across.x as f32, across.y as f32];
        let mut pixels = Vec::with_capacity(side * side);
        for row in 0..side {
            for left in (0..side).step_by(LANES) {
                let (mut sums, mut counts) = ([f32x4::ZERO; LANES], [0.0f32; LANES]);
                for i in 0..num * num {
                    let [right, below] = [i % num, i / num].map(|k| k as f64 * one_more);
                    let start = origin + (left as f64 + right) * across + (row as f64 + below) * down;
                    let x: [f32; LANES] = std::array::from_fn(|k| start.x as f32 + k as f32 * step_x);
                    let y: [f32; LANES] = std::array::from_fn(|k| start.y as f32 + k as f32 * step_y);
                    let mut colors = [f32x4::ZERO; LANES];
                    let inside = reader.colors(&x, &y, &mut colors);
                    for k in 0..LANES {
                        sums[k] += colors[k];
                        counts[k] += inside[k];
                    }
                }
                for (sum, count) in sums.iter().zip(counts).take(side - left) {
                    let [r, g, b, _] = (*sum * f32x4::splat(1.0 / (255.0 * count.max(1.0)))).to_array();
                    pixels.push((count > 0.0).then_some([r, g, b]));
                }
            }
        }
        pixels
    }
}
