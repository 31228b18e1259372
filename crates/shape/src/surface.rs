//! What lies inside the outline, compared as correlations of brightness and colour.
//!
//! A lever of nearly the same outline as the taught one agrees in its edges (0.71 to 0.75 was measured, where the part
//! itself in bad light gave 0.64), but where the part has a bushing it has a hole. That shows in the surface: brightness and
//! colour inside the outline, as correlations, so that the light's strength and tint do not count.
//!
//! ```text
//! outline ─ grid of points ─┬─ one correlation of them all             1/3 ─┐
//!                           └─ cells ─ a correlation about each          ├─ agreement
//!                              cell's own mean, averaged               2/3 ─┘
//! ```
//! Across the whole part, bright against dark ends count; so does the edge of another thing's shadow that falls over it,
//! and there the correlation over the whole part is low. Within a cell that shadow is in most cells no edge at all. On 480
//! pictures of the eight shipped parts and 480 without them, edges and the whole correlation (6 : 4) left 48 of 950 right
//! poses below the best wrong one of any part; edges, cells and the whole (7 : 2 : 1) left 30, and 4 instead of 13 below the
//! best wrong one of their own part.

use std::collections::BTreeMap;

use image::RgbImage;
use nalgebra::{Point2, Vector3};
use sdg_geometry::{PlanarSimilarity, Polygon};

use crate::config::SurfaceConfig;
use crate::pixel_cell::PixelCell;

/// Points that are compared; a few hundred are enough for correlations, and cost microseconds. Chosen by that reasoning; 700
/// before there were cells.
const POINTS: f64 = 900.0;
/// A cell of fewer points is not compared. Chosen by hand, not measured.
const MIN_IN_CELL: usize = 4;
/// Points this near to the outline show the background when the pose is a pixel off. Chosen by that reasoning, not
/// measured.
const EDGE_MARGIN_PX: f64 = 2.0;
/// Grey values that a colour needs to have a hue. Chosen by hand, not measured.
const DARK: f64 = 3.0;
/// How pale highlights may make a colour, and how strong shadow, as a share of what was taught. Chosen by hand, not measured.
const STRENGTHS: (f64, f64) = (0.6, 1.4);
/// Least share of the points that must lie inside the image. Chosen by hand, not measured.
const MIN_INSIDE: f64 = 0.5;

/// The colours inside an outline, at a grid of points.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Cell by cell.
    cells: Vec<Vec<(Point2<f64>, [f64; 3])>>,
    is_plain: bool,
    config: SurfaceConfig,
}

impl Surface {
    /// Reads the colours of the demonstration, `cutout`; `outline` in its pixels.
    pub fn new(cutout: &RgbImage, outline: &Polygon, config: &SurfaceConfig) -> Self {
        let bounds = outline.bounds();
        let step = (outline.area() / POINTS).sqrt().max(1.0);
        let cell_side = (outline.area() / config.num_cells).sqrt().max(1.0);
        let (columns, rows) = ((bounds.width() / step) as usize, (bounds.height() / step) as usize);
        let mut cells: BTreeMap<[usize; 2], Vec<_>> = BTreeMap::new();
        for i in 0..rows * columns {
            let (row, column) = (i / columns, i % columns);
            let [right, down] = [column, row].map(|k| (k as f64 + 0.5) * step);
            let point = Point2::new(bounds.x1 + right, bounds.y1 + down);
            if outline.contains(&point)
                && outline.distance_to_edge(&point) >= EDGE_MARGIN_PX
                && let Some(color) = color_at(cutout, &point)
            {
                cells.entry([right, down].map(|d| (d / cell_side) as usize)).or_default().push((point, color));
            }
        }
        let cells: Vec<Vec<_>> = cells.into_values().collect();
        let mut whole = Correlation::default();
        cells.iter().flatten().for_each(|(_, color)| whole.add(color, color));
        let is_plain = whole.about_means()[0] < whole.floor(config.noise);
        Self { cells, is_plain, config: *config }
    }

    /// Whether the demonstration has less contrast than noise, as a black silhouette: what correlates with it then tells
    /// nothing.
    pub fn is_plain(&self) -> bool {
        self.is_plain
    }

    fn points(&self) -> impl Iterator<Item = &Point2<f64>> {
        self.cells.iter().flatten().map(|(point, _)| point)
    }

    /// The share of the points that lie in `outline` after `outline_from_cutout`, in `[0, 1]`.
    pub(crate) fn share_inside(&self, outline: &Polygon, outline_from_cutout: &PlanarSimilarity) -> f64 {
        let inside = self.points().filter(|point| outline.contains(&outline_from_cutout.apply(point))).count();
        inside as f64 / (self.points().count() as f64).max(1.0)
    }

    /// Mean brightness of the image at a pose over that of the cut-out; 1 where none of it is in the image.
    pub(crate) fn brightness(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let (mut taught, mut seen) = (0.0, 0.0);
        for (point, color) in self.cells.iter().flatten() {
            if let Some(found) = color_at(image, &image_from_cutout.apply(point)) {
                taught += color.iter().sum::<f64>();
                seen += found.iter().sum::<f64>();
            }
        }
        if taught > 0.0 { seen / taught } else { 1.0 }
    }

    /// How far the hue lies from the demonstration's: the median over cells of the distance between the shares of red, green
    /// and blue; 0 where none of it is in the image. Highlights make a colour paler and shadows make it stronger, which does not
    /// count, nor does what covers less than half; the light's tint does.
    pub(crate) fn hue_shift(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let mut shifts = Vec::with_capacity(self.cells.len());
        for cell in &self.cells {
            let sums = Correlation::of(cell, image, image_from_cutout);
            if sums.count >= MIN_IN_CELL {
                let mean = |sum: [f64; 3]| sum.map(|channel| channel / sums.count as f64);
                shifts.push((hue_distance(&mean(sums.taught), &mean(sums.seen)), sums.count));
            }
        }
        weighted_median(shifts)
    }

    /// The points, in pixels of the image, of cells with contrast in the demonstration that the image does not show.
    pub(crate) fn differing(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Point2<f64>> {
        /// From this contrast on a cell tells something. Chosen by hand, not measured.
        const MIN_CONTRAST: f64 = 0.5;
        /// Below this correlation it differs. Chosen by hand, not measured.
        const MAX_CORRELATION: f64 = 0.2;
        let noise = self.config.noise_in_cell;
        let differs = |cell: &&Vec<(Point2<f64>, [f64; 3])>| {
            let local = Correlation::of(cell, image, image_from_cutout);
            local.count >= MIN_IN_CELL
                && local.contrast_taught(noise) >= MIN_CONTRAST
                && local.value(noise) < MAX_CORRELATION
        };
        let points = self.cells.iter().filter(differs).flatten();
        points.map(|(point, _)| image_from_cutout.apply(point)).collect()
    }

    /// The correlation of colours between the cut-out and the image at a pose, within cells and over the whole; 0 for
    /// none, 1 for the same surface under any light.
    pub fn agreement(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let SurfaceConfig { cells_share, noise, noise_in_cell, .. } = self.config;
        let mut whole = Correlation::default();
        let (mut cells, mut weights) = (0.0, 0.0);
        for cell in &self.cells {
            let local = Correlation::of(cell, image, image_from_cutout);
            if local.count >= MIN_IN_CELL {
                let weight = local.count as f64 * local.contrast_taught(noise_in_cell);
                cells += weight * local.value(noise_in_cell);
                weights += weight;
            }
            whole.merge(&local);
        }
        if whole.count == 0 || (whole.count as f64) < MIN_INSIDE * self.points().count() as f64 {
            return 0.0;
        }
        let cells = if weights > 0.0 { cells / weights } else { 0.0 };
        cells_share * cells + (1.0 - cells_share) * whole.value(noise)
    }
}

/// Sums over pairs of a taught and a seen colour.
#[derive(Default)]
struct Correlation {
    count: usize,
    taught: [f64; 3],
    seen: [f64; 3],
    taught_squares: f64,
    seen_squares: f64,
    products: f64,
}

impl Correlation {
    /// Of a cell and what an image shows of it at a pose.
    fn of(cell: &[(Point2<f64>, [f64; 3])], image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Self {
        let mut sums = Self::default();
        for (point, taught) in cell {
            if let Some(seen) = color_at(image, &image_from_cutout.apply(point)) {
                sums.add(taught, &seen);
            }
        }
        sums
    }

    fn add(&mut self, taught: &[f64; 3], seen: &[f64; 3]) {
        self.count += 1;
        for channel in 0..3 {
            let (a, b) = (taught[channel], seen[channel]);
            self.taught[channel] += a;
            self.seen[channel] += b;
            self.taught_squares += a * a;
            self.seen_squares += b * b;
            self.products += a * b;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for channel in 0..3 {
            self.taught[channel] += other.taught[channel];
            self.seen[channel] += other.seen[channel];
        }
        self.taught_squares += other.taught_squares;
        self.seen_squares += other.seen_squares;
        self.products += other.products;
    }

    /// Sums of squares about the mean of each channel: taught, seen; and of products.
    fn about_means(&self) -> [f64; 3] {
        let n = self.count as f64;
        let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / n;
        [
            (self.taught_squares - dot(&self.taught, &self.taught)).max(0.0),
            (self.seen_squares - dot(&self.seen, &self.seen)).max(0.0),
            self.products - dot(&self.taught, &self.seen),
        ]
    }

    /// What so many points of noise alone would give.
    fn floor(&self, noise: f64) -> f64 {
        3.0 * self.count as f64 * noise * noise
    }

    /// In `[0, 1]`: opposite is no better than none.
    fn value(&self, noise: f64) -> f64 {
        let ([taught, seen, products], floor) = (self.about_means(), self.floor(noise));
        (products / ((taught + floor) * (seen + floor)).sqrt()).clamp(0.0, 1.0)
    }

    /// How much there is to correlate with, in `[0, 1)`: nothing on a plain surface.
    fn contrast_taught(&self, noise: f64) -> f64 {
        let [taught, _, _] = self.about_means();
        (taught / (taught + self.floor(noise))).sqrt()
    }
}

/// Distance of the shares of red, green and blue between a colour and another, or the same made paler or stronger.
fn hue_distance(taught: &[f64; 3], seen: &[f64; 3]) -> f64 {
    let from_grey = |color: &[f64; 3]| {
        let sum = color.iter().sum::<f64>() + 3.0 * DARK;
        Vector3::from(color.map(|channel| (channel + DARK) / sum - 1.0 / 3.0))
    };
    let (taught, seen) = (from_grey(taught), from_grey(seen));
    let strength = taught.dot(&seen) / taught.norm_squared().max(f64::MIN_POSITIVE);
    (seen - strength.clamp(STRENGTHS.0, STRENGTHS.1) * taught).norm()
}

fn weighted_median(mut values: Vec<(f64, usize)>) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|(_, weight)| weight).sum::<usize>() / 2;
    let mut below = 0;
    let middle = values.iter().find(|(_, weight)| {
        below += weight;
        below > half
    });
    middle.map_or(0.0, |(value, _)| *value)
}

/// The colour at a point, by bilinear interpolation; `None` outside the image.
fn color_at(image: &RgbImage, point: &Point2<f64>) -> Option<[f64; 3]> {
    PixelCell::at(image, point).map(|cell| cell.color_f64())
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
        let outline = Polygon::from_box(&BoundingBox { x1: 10.0, y1: 15.0, x2: 110.0, y2: 65.0 });
        Surface::new(&plate(1.0, false), &outline, &SurfaceConfig::default())
    }

    #[test]
    fn the_light_does_not_count_and_a_hole_does() {
        let agreement = |image: &RgbImage| surface().agreement(image, &PlanarSimilarity::IDENTITY);
        assert!(agreement(&plate(1.0, false)) > 0.85);
        assert!(agreement(&plate(0.6, false)) > 0.75);
        assert!(agreement(&plate(1.0, true)) < 0.2);
    }

    #[test]
    fn the_surface_differs_where_a_hole_is_and_nowhere_else() {
        // Farther than the bushing is wide.
        let away = PlanarSimilarity { tx: 26.0, ..PlanarSimilarity::IDENTITY };
        assert_eq!(surface().differing(&plate(0.6, false), &PlanarSimilarity::IDENTITY), []);
        let hole = surface().differing(&plate(1.0, true), &PlanarSimilarity::IDENTITY);
        let bushing = Point2::new(40.0, 40.0);
        // Cells that the bushing reaches into, the farthest corner of one 34 pixels from its middle; the plate goes on to 70.
        assert!(hole.len() > 20 && hole.iter().all(|p| (p - bushing).norm() < 40.0), "{hole:?}");
        assert!(!surface().differing(&plate(1.0, false), &away).is_empty());
    }

    #[test]
    fn the_hue_shifts_with_another_paint_and_not_with_the_light() {
        let shift = |image: &RgbImage| surface().hue_shift(image, &PlanarSimilarity::IDENTITY);
        assert!(shift(&plate(1.0, false)) < 1e-9 && shift(&plate(0.6, false)) < 0.06);
        // What covers a third does not count.
        let hand = Rgb([20, 40, 200]);
        let covered = |x: u32, y: u32| if x < 40 { hand } else { *plate(1.0, false).get_pixel(x, y) };
        let covered = RgbImage::from_fn(120, 80, covered);
        assert!(shift(&covered) < 0.02);
        let swapped = RgbImage::from_fn(120, 80, |x, y| {
            let Rgb([red, green, blue]) = *plate(1.0, false).get_pixel(x, y);
            Rgb([blue, green, red])
        });
        assert!(shift(&swapped) > 0.25, "{}", shift(&swapped));
    }

    #[test]
    fn a_silhouette_is_plain_and_a_printed_part_is_not() {
        let outline = Polygon::from_box(&BoundingBox { x1: 10.0, y1: 15.0, x2: 110.0, y2: 65.0 });
        let silhouette = RgbImage::from_pixel(120, 80, Rgb([12; 3]));
        assert!(Surface::new(&silhouette, &outline, &SurfaceConfig::default()).is_plain());
        assert!(!surface().is_plain());
    }

    #[test]
    fn a_shadow_across_the_part_costs_little() {
        let shadowed = RgbImage::from_fn(120, 80, |x, y| {
            let Rgb(color) = *plate(1.0, false).get_pixel(x, y);
            Rgb(if x > 70 { color.map(|value| value / 2) } else { color })
        });
        let agreement = surface().agreement(&shadowed, &PlanarSimilarity::IDENTITY);
        let unshadowed = surface().agreement(&plate(1.0, false), &PlanarSimilarity::IDENTITY);
        assert!(agreement > 0.6 * unshadowed, "{agreement} of {unshadowed}");
    }

    #[test]
    fn turned_round_is_another_surface() {
        let center = Point2::new(60.0, 40.0);
        let half_turn = PlanarSimilarity::about(center, center, Angle::from_degrees(180.0), 1.0);
        assert!(surface().agreement(&plate(1.0, false), &half_turn) < 0.4);
    }

    #[test]
    fn half_the_light_is_half_as_bright() {
        let brightness = |image: &RgbImage| surface().brightness(image, &PlanarSimilarity::IDENTITY);
        assert!((brightness(&plate(0.5, false)) - 0.5).abs() < 0.01);
        let away = PlanarSimilarity { tx: 500.0, ..PlanarSimilarity::IDENTITY };
        assert_eq!(surface().brightness(&plate(1.0, false), &away), 1.0);
    }

    #[test]
    fn outside_the_image_or_flat_is_zero() {
        let away = PlanarSimilarity { tx: 500.0, ..PlanarSimilarity::IDENTITY };
        assert_eq!(surface().agreement(&plate(1.0, false), &away), 0.0);
        let flat = RgbImage::from_pixel(120, 80, Rgb([90, 90, 90]));
        assert!(surface().agreement(&flat, &PlanarSimilarity::IDENTITY) < 1e-9);
    }
}
