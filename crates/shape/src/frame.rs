//! A square about the part, in the frame of its photo, into which photo and pictures are sampled alike.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{BoundingBox, PlanarSimilarity};

use crate::pixel_cell::PixelCell;

/// The square, `side` pixels wide.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    /// Pixels of the cut-out for one of the square's.
    step: f64,
    /// In pixels of the cut-out.
    center: Point2<f64>,
    pub(crate) side: usize,
}

impl Frame {
    /// With the part, whose bounds are in pixels of the cut-out, `part_side` pixels long.
    pub(crate) fn about(bounds: &BoundingBox, part_side: f64, side: usize) -> Self {
        Self { step: bounds.width().max(bounds.height()) / part_side, center: bounds.center(), side }
    }

    /// Pixels of the cut-out for one of the square's.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// Where a point of the square lies in the cut-out.
    pub(crate) fn place(&self, at: [f64; 2]) -> Point2<f64> {
        self.center + self.step * Vector2::from(at.map(|coordinate| coordinate - 0.5 * self.side as f64))
    }

    /// Where a point of the cut-out lies in the square.
    pub(crate) fn place_of(&self, point: &Point2<f64>) -> [f64; 2] {
        let from_center = (point - self.center) / self.step;
        [from_center.x, from_center.y].map(|coordinate| coordinate + 0.5 * self.side as f64)
    }

    /// Middles of the pixels, row by row.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        let side = self.side;
        (0..side * side).map(move |i| [i % side, i / side].map(|k| k as f64 + 0.5))
    }

    /// Mean colours over the pixels, from 0 to 1, row by row; `None` where there is no image. So many samples a side are taken that no
    /// pixel of the image is skipped.
    pub(crate) fn sampled(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Option<[f32; 3]>> {
        self.sampled_by(image, image_from_cutout, (self.step * image_from_cutout.scale).ceil())
    }

    /// The same with fewer samples where few pixels are skipped.
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
        let origin = image_from_cutout.apply(&self.place([0.5 / num as f64; 2]));
        let across = image_from_cutout.apply(&self.place([1.0 + 0.5 / num as f64, 0.5 / num as f64])) - origin;
        let down = Vector2::new(-across.y, across.x);
        let one_more = 1.0 / num as f64;
        self.pixels()
            .map(|[x, y]| {
                let corner = origin + (x - 0.5) * across + (y - 0.5) * down;
                let (mut sum, mut count) = ([0.0; 3], 0);
                for i in 0..num * num {
                    let [right, below] = [i % num, i / num].map(|k| k as f64 * one_more);
                    if let Some(cell) = PixelCell::at(image, &(corner + right * across + below * down)) {
                        let color = cell.color_f32();
                        count += 1;
                        (0..3).for_each(|c| sum[c] += color[c]);
                    }
                }
                (count > 0).then(|| sum.map(|value| value / (255.0 * count as f32)))
            })
            .collect()
    }
}
