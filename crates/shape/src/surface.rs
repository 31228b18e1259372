//! What lies inside the outline: the second witness beside the edges.
//!
//! A lever of nearly the same outline as the taught one agrees in its edges (0.71 to 0.75 was measured, where the part
//! itself in bad light gave 0.64), but where the part has a bushing it has a hole. The surface sees that: brightness and
//! colour inside the outline, as a correlation, so that the light's strength and tint do not count.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{PlanarSimilarity, Polygon};

/// The weight of the surface where it is averaged with the edges' agreement; the edges have the rest.
///
/// Edges alone gave a lever of nearly the pendulum's outline 0.71 to 0.75; with this share it has 0.46 to 0.56.
pub const SURFACE_SHARE: f64 = 0.4;

/// Points looked at; a few hundred are enough for a correlation, and cost microseconds.
const POINTS: f64 = 700.0;
/// Points this near to the outline show the background when the pose is a pixel off.
const EDGE_MARGIN_PX: f64 = 2.0;
/// Contrast below this, in grey values, is noise: a surface without any agrees with nothing.
const NOISE: f64 = 8.0;
/// Least share of the points that must lie inside the image.
const LEAST_INSIDE: f64 = 0.5;

/// The colours inside an outline, at a grid of points.
#[derive(Debug, Clone)]
pub struct Surface {
    points: Vec<(Point2<f64>, [f64; 3])>,
}

impl Surface {
    /// Reads the colours of the demonstration, `cutout`; `outline` in its pixels.
    pub fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        let bounds = outline.bounds();
        let step = (outline.area() / POINTS).sqrt().max(1.0);
        let (columns, rows) = ((bounds.width() / step) as usize, (bounds.height() / step) as usize);
        let points = (0..rows * columns)
            .map(|i| {
                let (row, column) = (i / columns, i % columns);
                Point2::new(bounds.x1 + (column as f64 + 0.5) * step, bounds.y1 + (row as f64 + 0.5) * step)
            })
            .filter(|point| outline.contains(point) && outline.distance_to_edge(point) >= EDGE_MARGIN_PX)
            .filter_map(|point| Some((point, color_at(cutout, &point)?)))
            .collect();
        Self { points }
    }

    /// The share of the points that lie in `outline` after `outline_from_cutout`, in `[0, 1]`.
    pub(crate) fn share_inside(&self, outline: &Polygon, outline_from_cutout: &PlanarSimilarity) -> f64 {
        let inside =
            self.points.iter().filter(|(point, _)| outline.contains(&outline_from_cutout.apply(point))).count();
        inside as f64 / (self.points.len() as f64).max(1.0)
    }

    /// The correlation of colours, each channel about its own mean, between the cut-out and the image at a pose;
    /// 0 for none, 1 for the same surface under any light.
    pub fn agreement(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let pairs: Vec<([f64; 3], [f64; 3])> = self
            .points
            .iter()
            .filter_map(|(point, taught)| Some((*taught, color_at(image, &image_from_cutout.apply(point))?)))
            .collect();
        if pairs.is_empty() || (pairs.len() as f64) < LEAST_INSIDE * self.points.len() as f64 {
            return 0.0;
        }
        let n = pairs.len() as f64;
        let (mut both, mut taught_variance, mut seen_variance) = (0.0, 0.0, 0.0);
        for channel in 0..3 {
            let mean_taught = pairs.iter().map(|(taught, _)| taught[channel]).sum::<f64>() / n;
            let mean_seen = pairs.iter().map(|(_, seen)| seen[channel]).sum::<f64>() / n;
            for (taught, seen) in &pairs {
                let (a, b) = (taught[channel] - mean_taught, seen[channel] - mean_seen);
                both += a * b;
                taught_variance += a * a;
                seen_variance += b * b;
            }
        }
        let floor = NOISE * NOISE * 3.0 * n;
        (both / ((taught_variance + floor) * (seen_variance + floor)).sqrt()).clamp(0.0, 1.0)
    }
}

/// The colour at a point between pixel centres, by bilinear interpolation; `None` outside the image.
fn color_at(image: &RgbImage, point: &Point2<f64>) -> Option<[f64; 3]> {
    let (x, y) = (point.x - 0.5, point.y - 0.5);
    let (left, top) = (x.floor(), y.floor());
    if !(left >= 0.0 && top >= 0.0 && left + 1.0 < f64::from(image.width()) && top + 1.0 < f64::from(image.height())) {
        return None;
    }
    let (along, down) = (x - left, y - top);
    let pixel = |dx: u32, dy: u32| image.get_pixel(left as u32 + dx, top as u32 + dy).0;
    let corners = [
        (pixel(0, 0), (1.0 - along) * (1.0 - down)),
        (pixel(1, 0), along * (1.0 - down)),
        (pixel(0, 1), (1.0 - along) * down),
        (pixel(1, 1), along * down),
    ];
    let mut color = [0.0; 3];
    for (pixel, weight) in corners {
        for channel in 0..3 {
            color[channel] += weight * f64::from(pixel[channel]);
        }
    }
    Some(color)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::{Angle, BoundingBox};

    fn plate(light: f64, hole: bool) -> RgbImage {
        RgbImage::from_fn(120, 80, |x, y| {
            let in_bushing = (f64::from(x) - 40.0).hypot(f64::from(y) - 40.0) < 12.0;
            let value = match (in_bushing, hole) {
                (true, false) => [210.0, 200.0, 90.0],
                (true, true) => [60.0, 60.0, 62.0],
                _ => [150.0, 90.0, 60.0 + f64::from(x) / 4.0],
            };
            Rgb(value.map(|v| (v * light) as u8))
        })
    }

    fn surface() -> Surface {
        Surface::new(&plate(1.0, false), &Polygon::from_box(&BoundingBox { x1: 10.0, y1: 15.0, x2: 110.0, y2: 65.0 }))
    }

    #[test]
    fn the_light_does_not_count_and_a_hole_does() {
        let agreement = |image: &RgbImage| surface().agreement(image, &PlanarSimilarity::IDENTITY);
        assert!(agreement(&plate(1.0, false)) > 0.85);
        assert!(agreement(&plate(0.6, false)) > 0.75);
        assert!(agreement(&plate(1.0, true)) < 0.2);
    }

    #[test]
    fn turned_round_is_another_surface() {
        let center = Point2::new(60.0, 40.0);
        let half_turn = PlanarSimilarity::about(center, center, Angle::from_degrees(180.0), 1.0);
        assert!(surface().agreement(&plate(1.0, false), &half_turn) < 0.4);
    }

    #[test]
    fn outside_the_image_or_flat_is_zero() {
        let away = PlanarSimilarity { tx: 500.0, ..PlanarSimilarity::IDENTITY };
        assert_eq!(surface().agreement(&plate(1.0, false), &away), 0.0);
        let flat = RgbImage::from_pixel(120, 80, Rgb([90, 90, 90]));
        assert!(surface().agreement(&flat, &PlanarSimilarity::IDENTITY) < 1e-9);
    }
}
