//! The surface inside the outline, compared by correlations of brightness and colour.
//!
//! Edges alone do not distinguish a lever whose outline is nearly that of the taught part: their agreement is 0.71 to
//! 0.75, and that of the part itself in poor light is 0.64. The lever has a hole in place of the part's bushing.
//! Brightness and colour inside the outline show this difference. They are compared as correlations, so that the
//! strength and tint of the light do not count.
//!
//! ```text
//! outline ─ grid of points ─┬─ one correlation of them all             1/3 ─┐
//!                           └─ cells ─ a correlation about each          ├─ agreement
//!                              cell's own mean, averaged               2/3 ─┘
//! ```
//! The correlation over the whole part compares its bright and dark ends, but a shadow edge of another object that
//! falls across the part makes it low. Within most cells that shadow has no edge. On 480 pictures of the paper's eight
//! parts and 480 without them, with edges and the whole correlation (6 : 4), 48 of 950 right poses scored below a wrong
//! pose of any part and 13 below one of their own part; with edges, cells and the whole (7 : 2 : 1), 30 and 4.

use std::collections::BTreeMap;

use image::RgbImage;
use nalgebra::{Point2, Vector3};
use pulp::{Simd, WithSimd};
use sdg_geometry::{PlanarSimilarity, Polygon};
use wide::f32x4;

use crate::config::SurfaceConfig;
use crate::lanes::{LANES, in_lanes};
use crate::pixel_cell::PixelReader;

/// Number of compared points; a few hundred are enough for correlations and take microseconds. Derived from that; the
/// value was 700 before cells were introduced.
const POINTS: f64 = 900.0;
/// Minimum number of points of a compared cell. Chosen by hand, not measured.
const MIN_IN_CELL: usize = 4;
/// Points within this distance of the outline show the background when the pose is wrong by a pixel. Derived from this
/// error, not measured.
const EDGE_MARGIN_PX: f64 = 2.0;
/// Added to each channel, in grey values, so that a nearly black colour has hardly any hue. Chosen by hand, not
/// measured.
const DARK: f64 = 3.0;
/// Range of the saturation, as a multiple of the taught saturation, that highlights and shadows may cause. Chosen by
/// hand, not measured.
const STRENGTHS: (f64, f64) = (0.6, 1.4);
/// Minimum share of the points inside the image. Chosen by hand, not measured.
const MIN_INSIDE: f64 = 0.5;

/// The colours inside an outline, at a grid of points.
#[derive(Debug, Clone)]
pub struct Surface {
    cells: Vec<Cell>,
    /// Points of a part that is too thin for points with a distance of [`EDGE_MARGIN_PX`] from the outline; their
    /// colours are not compared. Empty for other parts.
    thin: Vec<Point2<f64>>,
    is_plain: bool,
    config: SurfaceConfig,
}

/// Adjacent points.
#[derive(Debug, Clone)]
struct Cell {
    points: Vec<Point2<f64>>,
    groups: Vec<PointGroup>,
}

/// [`LANES`] points of a cell; unused ones do not count.
#[derive(Debug, Clone, Copy)]
struct PointGroup {
    x: [f32; LANES],
    y: [f32; LANES],
    /// 1, or 0 for an unused point.
    counts: [f32; LANES],
    colors: [f32x4; LANES],
}

impl Cell {
    fn new(points: &[(Point2<f64>, [f32; 3])]) -> Self {
        let group = |points: &[(Point2<f64>, [f32; 3])]| {
            let zeros = [0.0; LANES];
            let mut group = PointGroup { x: zeros, y: zeros, counts: zeros, colors: [f32x4::ZERO; LANES] };
            for (k, (point, [r, g, b])) in points.iter().enumerate() {
                (group.x[k], group.y[k]) = (point.x as f32, point.y as f32);
                group.counts[k] = 1.0;
                group.colors[k] = f32x4::new([*r, *g, *b, 0.0]);
            }
            group
        };
        Self {
            points: points.iter().map(|(point, _)| *point).collect(),
            groups: points.chunks(LANES).map(group).collect(),
        }
    }
}

impl Surface {
    /// Reads the colours of the demonstration, `cutout`; `outline` is in its pixels.
    pub fn new(cutout: &RgbImage, outline: &Polygon, config: &SurfaceConfig) -> Self {
        let bounds = outline.bounds();
        let step = (outline.area() / POINTS).sqrt().max(1.0);
        let cell_side = (outline.area() / config.num_cells).sqrt().max(1.0);
        let (columns, rows) = ((bounds.width() / step) as usize, (bounds.height() / step) as usize);
        let reader = PixelReader::new(cutout);
        let mut cells: BTreeMap<[usize; 2], Vec<_>> = BTreeMap::new();
        let mut thin = Vec::new();
        for i in 0..rows * columns {
            let (row, column) = (i / columns, i % columns);
            let [right, down] = [column, row].map(|k| (k as f64 + 0.5) * step);
            let point = Point2::new(bounds.x1 + right, bounds.y1 + down);
            if !outline.contains(&point) {
                continue;
            }
            if outline.distance_to_edge(&point) < EDGE_MARGIN_PX {
                thin.push(point);
            } else if let Some(color) = color_at(&reader, &point) {
                cells.entry([right, down].map(|d| (d / cell_side) as usize)).or_default().push((point, color));
            }
        }
        if !cells.is_empty() {
            thin.clear();
        }
        let cells: Vec<Cell> = cells.into_values().map(|points| Cell::new(&points)).collect();
        let mut made = Self { cells, thin, is_plain: false, config: *config };
        let mut whole = Correlation::default();
        made.correlations(cutout, &PlanarSimilarity::IDENTITY).iter().for_each(|cell| whole.merge(cell));
        made.is_plain = made.cells.is_empty() || whole.about_means()[0] < whole.floor(config.noise);
        made
    }

    /// Whether the demonstration's contrast is below noise, as in a black silhouette, or the part is too thin for
    /// points; correlations with it then carry no information.
    pub fn is_plain(&self) -> bool {
        self.is_plain
    }

    fn points(&self) -> impl Iterator<Item = &Point2<f64>> {
        self.cells.iter().flat_map(|cell| &cell.points).chain(&self.thin)
    }

    /// For each cell, sums over its points of the demonstration's and the image's colours at a pose.
    fn correlations(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Correlation> {
        let reader = PixelReader::new(image);
        in_lanes(Correlate { cells: &self.cells, reader, image_from_cutout: *image_from_cutout })
    }

    /// Whether more than `share` of the points lie in `outline` after `outline_from_cutout`.
    pub(crate) fn has_inside(&self, outline: &Polygon, outline_from_cutout: &PlanarSimilarity, share: f64) -> bool {
        let is_inside = inside(outline, outline_from_cutout);
        let num_points = self.points().count();
        let (mut num_inside, mut left) = (0, num_points);
        let is_more = |count: usize| count as f64 / (num_points as f64).max(1.0) > share;
        for point in self.points() {
            // Most answers are known before the last point.
            if is_more(num_inside) || !is_more(num_inside + left) {
                break;
            }
            num_inside += usize::from(is_inside(point));
            left -= 1;
        }
        is_more(num_inside)
    }

    /// The share of the points that lie in `outline` after `outline_from_cutout`.
    #[cfg(test)]
    pub(crate) fn share_inside(&self, outline: &Polygon, outline_from_cutout: &PlanarSimilarity) -> f64 {
        let is_inside = inside(outline, outline_from_cutout);
        self.points().filter(|point| is_inside(point)).count() as f64 / self.points().count() as f64
    }

    /// The share of the points in `outline`, estimated from a sixteenth of the points.
    pub(crate) fn share_inside_roughly(&self, outline: &Polygon, outline_from_cutout: &PlanarSimilarity) -> f64 {
        let is_inside = inside(outline, outline_from_cutout);
        let points = || self.points().step_by(16);
        points().filter(|point| is_inside(point)).count() as f64 / (points().count() as f64).max(1.0)
    }

    /// Mean brightness of the image at a pose divided by that of the cut-out; 1 where none of it is in the image.
    pub(crate) fn brightness(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let (mut taught, mut seen) = (0.0, 0.0);
        for cell in self.correlations(image, image_from_cutout) {
            taught += cell.taught.iter().sum::<f64>();
            seen += cell.seen.iter().sum::<f64>();
        }
        if taught > 0.0 { seen / taught } else { 1.0 }
    }

    /// Distance of the hue from the demonstration's: the median over cells of the distance between the shares of red,
    /// green and blue; 0 where none of it is in the image. Desaturation by highlights and saturation by shadows do not
    /// count, nor does anything that covers less than half of the part; the light's tint counts.
    pub(crate) fn hue_shift(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let mut shifts = Vec::with_capacity(self.cells.len());
        for sums in self.correlations(image, image_from_cutout) {
            if sums.count >= MIN_IN_CELL {
                let mean = |sum: [f64; 3]| sum.map(|channel| channel / sums.count as f64);
                shifts.push((hue_distance(&mean(sums.taught), &mean(sums.seen)), sums.count));
            }
        }
        weighted_median(shifts)
    }

    /// The points, in pixels of the image, of cells whose contrast in the demonstration is missing in the image.
    pub(crate) fn differing(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<Point2<f64>> {
        /// Minimum contrast of an informative cell. Chosen by hand, not measured.
        const MIN_CONTRAST: f64 = 0.5;
        /// Cells of lower correlation differ. Chosen by hand, not measured.
        const MAX_CORRELATION: f64 = 0.2;
        let noise = self.config.noise_in_cell;
        let differs = |local: &Correlation| {
            local.count >= MIN_IN_CELL
                && local.contrast_taught(noise) >= MIN_CONTRAST
                && local.value(noise) < MAX_CORRELATION
        };
        let correlations = self.correlations(image, image_from_cutout);
        let cells = self.cells.iter().zip(&correlations).filter(|(_, local)| differs(local));
        cells.flat_map(|(cell, _)| &cell.points).map(|point| image_from_cutout.apply(point)).collect()
    }

    /// The correlation of colours between the cut-out and the image at a pose, within cells and over the whole; 0 for
    /// no correlation, 1 for the same surface under any light.
    pub fn agreement(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        let SurfaceConfig { cells_share, noise, noise_in_cell, .. } = self.config;
        let mut whole = Correlation::default();
        let (mut cells, mut weights) = (0.0, 0.0);
        for local in self.correlations(image, image_from_cutout) {
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

/// Whether a point lies in `outline` after `outline_from_cutout`.
fn inside(outline: &Polygon, outline_from_cutout: &PlanarSimilarity) -> impl Fn(&Point2<f64>) -> bool {
    let bounds = outline.bounds();
    move |point| {
        let point = outline_from_cutout.apply(point);
        let near = (bounds.x1..=bounds.x2).contains(&point.x) && (bounds.y1..=bounds.y2).contains(&point.y);
        near && outline.contains(&point)
    }
}

/// Sums over pairs of a taught and an observed colour.
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
    /// Converts sums (of `taught`, `seen`, their squares and their products) of colours relative to one colour of the
    /// photo and one of the image to sums of the colours themselves.
    fn about(
        [of_photo, of_image]: [[f64; 3]; 2],
        count: f64,
        [taught, seen, taught_squares, seen_squares, products]: [[f64; 3]; 5],
    ) -> Self {
        let mut sums = Self { count: count as usize, ..Self::default() };
        for c in 0..3 {
            let (photo, image) = (of_photo[c], of_image[c]);
            sums.taught[c] = taught[c] + count * photo;
            sums.seen[c] = seen[c] + count * image;
            sums.taught_squares += taught_squares[c] + 2.0 * photo * taught[c] + count * photo * photo;
            sums.seen_squares += seen_squares[c] + 2.0 * image * seen[c] + count * image * image;
            sums.products += products[c] + image * taught[c] + photo * seen[c] + count * photo * image;
        }
        sums
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

    /// Sums about the mean of each channel: of the taught squares, of the seen squares, and of the products.
    fn about_means(&self) -> [f64; 3] {
        let n = self.count as f64;
        let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / n;
        [
            (self.taught_squares - dot(&self.taught, &self.taught)).max(0.0),
            (self.seen_squares - dot(&self.seen, &self.seen)).max(0.0),
            self.products - dot(&self.taught, &self.seen),
        ]
    }

    /// The value that this many points of noise alone would give.
    fn floor(&self, noise: f64) -> f64 {
        3.0 * self.count as f64 * noise * noise
    }

    /// In `[0, 1]`: negative correlation counts as none.
    fn value(&self, noise: f64) -> f64 {
        let ([taught, seen, products], floor) = (self.about_means(), self.floor(noise));
        (products / ((taught + floor) * (seen + floor)).sqrt()).clamp(0.0, 1.0)
    }

    /// The amount of contrast available for correlation, in `[0, 1)`: nothing on a plain surface.
    fn contrast_taught(&self, noise: f64) -> f64 {
        let [taught, _, _] = self.about_means();
        (taught / (taught + self.floor(noise))).sqrt()
    }
}

/// Distance between the shares of red, green and blue of a colour and of another, where the other may be desaturated or
/// saturated.
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

struct Correlate<'a> {
    cells: &'a [Cell],
    reader: PixelReader<'a>,
    image_from_cutout: PlanarSimilarity,
}

impl WithSimd for Correlate<'_> {
    type Output = Vec<Correlation>;

    /// Plain loops; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Correlation> {
        let Self { cells, reader, image_from_cutout: PlanarSimilarity { scale, angle, tx, ty } } = self;
        let (sin, cos) = angle.radians().sin_cos();
        let [a, b, tx, ty] = [scale * cos, scale * sin, tx, ty].map(|value| value as f32);
        let of_cell = |cell: &Cell| {
            // The sums are of colours relative to one of them, because sums of squares of large numbers would lose
            // small differences.
            let (mut base, mut count) = (None, 0.0f32);
            let [mut taught, mut seen, mut taught_squares, mut seen_squares, mut products] = [f32x4::ZERO; 5];
            for group in &cell.groups {
                let x: [f32; LANES] = std::array::from_fn(|k| a * group.x[k] - b * group.y[k] + tx);
                let y: [f32; LANES] = std::array::from_fn(|k| b * group.x[k] + a * group.y[k] + ty);
                let mut colors = [f32x4::ZERO; LANES];
                let mut counts = reader.colors(&x, &y, &mut colors);
                for (counts, of_group) in counts.iter_mut().zip(&group.counts) {
                    *counts *= of_group;
                }
                let first = counts.iter().position(|counts| *counts > 0.0);
                let Some([of_photo, of_image]) = base.or(first.map(|k| [group.colors[k], colors[k]])) else { continue };
                base = Some([of_photo, of_image]);
                for k in 0..LANES {
                    let counts_k = f32x4::splat(counts[k]);
                    let [of_photo, of_image] =
                        [(group.colors[k] - of_photo) * counts_k, (colors[k] - of_image) * counts_k];
                    count += counts[k];
                    taught += of_photo;
                    seen += of_image;
                    taught_squares += of_photo * of_photo;
                    seen_squares += of_image * of_image;
                    products += of_photo * of_image;
                }
            }
            let channels = |sums: f32x4| std::array::from_fn(|c| f64::from(sums.to_array()[c]));
            let base = base.unwrap_or([f32x4::ZERO; 2]).map(channels);
            let sums = [taught, seen, taught_squares, seen_squares, products].map(channels);
            Correlation::about(base, f64::from(count), sums)
        };
        cells.iter().map(of_cell).collect()
    }
}

/// The colour at a point, by bilinear interpolation; `None` outside the image.
fn color_at(reader: &PixelReader<'_>, point: &Point2<f64>) -> Option<[f32; 3]> {
    let mut color = [f32x4::ZERO];
    let [inside] = reader.colors(&[point.x as f32], &[point.y as f32], &mut color);
    let [r, g, b, _] = color[0].to_array();
    (inside > 0.0).then_some([r, g, b])
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
        // Only cells that the bushing reaches into differ. Their farthest point is 34 pixels from the bushing's centre,
        // that of the plate about 70.
        assert!(hole.len() > 20 && hole.iter().all(|p| (p - bushing).norm() < 40.0), "{hole:?}");
        assert!(!surface().differing(&plate(1.0, false), &away).is_empty());
    }

    #[test]
    fn the_hue_shifts_with_another_paint_and_not_with_the_light() {
        let shift = |image: &RgbImage| surface().hue_shift(image, &PlanarSimilarity::IDENTITY);
        assert!(shift(&plate(1.0, false)) < 1e-9 && shift(&plate(0.6, false)) < 0.06);
        // An object that covers a third does not count.
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
    fn a_strip_too_thin_for_points_is_plain_and_overlaps_itself() {
        let outline = Polygon::from_box(&BoundingBox { x1: 30.0, y1: 40.0, x2: 90.0, y2: 43.0 });
        let strip = Surface::new(&plate(1.0, false), &outline, &SurfaceConfig::default());
        assert!(strip.is_plain() && strip.cells.is_empty());
        let has_inside = |right: f64| strip.has_inside(&outline, &PlanarSimilarity::translation(right, 0.0), 0.3);
        assert!(has_inside(0.0) && has_inside(40.0) && !has_inside(45.0));
        assert_eq!(strip.share_inside_roughly(&outline, &PlanarSimilarity::IDENTITY), 1.0);
        // Other parts have no points near their outline.
        assert!(surface().thin.is_empty());
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
