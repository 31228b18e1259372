//! Photos of parts with a shadow that a proposed outline may include, made from photos with a known outline.
//!
//! The shadow is the area that the outline sweeps when it moves away from the lamp, blurred. It can be bluer than the
//! light, because other lamps and the sky light it.

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use sdg_geometry::{BoundingBox, Mask, Polygon};

/// A photo with a shadow.
pub struct Shaded {
    pub image: RgbImage,
    /// Around part and shadow, as drawn by a person who mistakes the shadow for the part.
    pub bbox: BoundingBox,
    pub part: Mask,
    /// Area with a strong shadow and without the part.
    pub shadow: Mask,
}

impl Shaded {
    /// Fractions of the shadow and of the part inside an outline.
    pub fn shares(&self, outline: &Polygon) -> [f64; 2] {
        let held = outline.rasterize(self.part.width(), self.part.height());
        [&self.shadow, &self.part].map(|of| {
            let (width, height) = (of.width(), of.height());
            let both = Mask::from_fn(width, height, |x, y| of.get(x, y) && held.get(x, y));
            both.area() as f64 / of.area() as f64
        })
    }
}

/// Remaining light in a shadow, and its colour.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    /// Direction of the shadow, in radians.
    pub direction: f64,
    /// Length of the shadow as a fraction of the part's diagonal.
    pub length: f64,
    /// Remaining light, for red, green and blue.
    pub left: [f64; 3],
    /// Width of the shadow's border as a fraction of its length: a small lamp casts a sharp one.
    pub blur: f64,
}

/// Casts a shadow of the part at `truth`.
pub fn cast(photo: &RgbImage, truth: &Polygon, lamp: &Lamp) -> Shaded {
    let (width, height) = photo.dimensions();
    let bounds = truth.bounds();
    let length = lamp.length * bounds.width().hypot(bounds.height());
    let shift = Vector2::new(lamp.direction.cos(), lamp.direction.sin()) * length;
    let part = truth.rasterize(width, height);
    // Everything that the part sweeps on its path: a shadow starts at the part.
    let steps = length.ceil().max(1.0) as usize;
    let mut swept = Mask::empty(width, height);
    for step in 0..=steps {
        let by = shift * (step as f64 / steps as f64);
        let moved = Polygon { vertices: truth.vertices.iter().map(|v| v + by).collect() }.rasterize(width, height);
        for y in 0..height {
            for x in 0..width {
                if moved.get(x, y) {
                    swept.set(x, y, true);
                }
            }
        }
    }
    let depth = blurred(&swept, (lamp.blur * length).max(1.0) as usize);
    let at = |x: u32, y: u32| depth[(y * width + x) as usize];
    let image = RgbImage::from_fn(width, height, |x, y| {
        let pixel = photo.get_pixel(x, y).0;
        if part.get(x, y) {
            return Rgb(pixel);
        }
        let light = lamp.left.map(|left| 1.0 - at(x, y) * (1.0 - left));
        let shaded =
            |channel: usize| 255.0 * ((f64::from(pixel[channel]) / 255.0).powf(2.2) * light[channel]).powf(1.0 / 2.2);
        Rgb([0, 1, 2].map(|channel| shaded(channel).round() as u8))
    });
    let shadow = Mask::from_fn(width, height, |x, y| !part.get(x, y) && at(x, y) > 0.5);
    let room = 3.0;
    let (low, high) = (Point2::new(bounds.x1, bounds.y1), Point2::new(bounds.x2, bounds.y2));
    let bbox = BoundingBox {
        x1: low.x + shift.x.min(0.0) - room,
        y1: low.y + shift.y.min(0.0) - room,
        x2: high.x + shift.x.max(0.0) + room,
        y2: high.y + shift.y.max(0.0) + room,
    };
    Shaded { image, bbox: bbox.clip(f64::from(width), f64::from(height)), part, shadow }
}

/// A mask as fractions, averaged twice over squares of this radius.
fn blurred(mask: &Mask, radius: usize) -> Vec<f64> {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    let mut values: Vec<f64> = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| f64::from(u8::from(mask.get(x as u32, y as u32))))
        .collect();
    for _ in 0..2 {
        for (count, stride, lines, line_stride) in [(width, 1, height, width), (height, width, width, 1)] {
            let before = values.clone();
            for line in 0..lines {
                for i in 0..count {
                    let (from, to) = (i.saturating_sub(radius), (i + radius).min(count - 1));
                    let sum: f64 = (from..=to).map(|at| before[line * line_stride + at * stride]).sum();
                    values[line * line_stride + i * stride] = sum / (to - from + 1) as f64;
                }
            }
        }
    }
    values
}
