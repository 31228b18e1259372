//! Edge directions compared both ways: edges of the demonstration that the image lacks, and the reverse.
//!
//! [`crate::ShapeTemplate`] reads the image only at the demonstration's edges, so that a plate without holes agrees
//! with every plate that also has holes. Here directions are compared at a grid of points over the whole part,
//! whether or not the demonstration has an edge there.
//!
//! ```text
//! outline ─ grid ─ direction at each point, demonstration and image ─ correlation by region ─ those that agree ─ visible
//! ```
//! Legend: a direction is `(cos 2φ, sin 2φ)` times a length from 0 (no edge) to 1 (a clear edge), as [`GradientField`]
//! keeps it; the correlation of two fields is `Σ a·b / √(Σ a² Σ b²)`. Unlike the correlation of colours it does not
//! depend on light or shadow, only on the edges.

use nalgebra::Point2;
use sdg_geometry::{PlanarSimilarity, Polygon};

use crate::config::{AgreementConfig, StructureConfig};
use crate::gradient_field::GradientField;

/// How well the edges of an image agree with the demonstration's, both ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StructureAgreement {
    /// The share of the edges in regions that agree by [`StructureConfig::visible_from`] or more, in `[0, 1]`: these
    /// are neither covered nor of another part.
    pub visible: f64,
    /// The share of the part that lies outside the image, in `[0, 1]`; `visible` ignores it.
    pub outside: f64,
}

/// The edge directions of a demonstration at a grid of points.
#[derive(Debug, Clone)]
pub struct Structure {
    points: Vec<GridPoint>,
    num_regions: usize,
    /// Demonstration pixels per pixel of the level that is compared.
    pixel_size: f64,
    /// All points lie within `reach` of `center`, in demonstration pixels.
    center: Point2<f64>,
    reach: f64,
    config: StructureConfig,
}

#[derive(Debug, Clone, Copy)]
struct GridPoint {
    /// In demonstration pixels.
    at: Point2<f64>,
    direction: [f32; 2],
    region: usize,
}

impl Structure {
    /// Reads the directions from `field`, the gradients of the demonstration; `outline` is in its pixels.
    pub fn new(
        field: &GradientField,
        outline: &Polygon,
        config: &StructureConfig,
        agreement: &AgreementConfig,
    ) -> Self {
        let bounds = outline.bounds();
        let extent = bounds.width().max(bounds.height());
        let level_idx = ((extent / agreement.extent).log2().floor().max(0.0) as usize).min(field.num_levels() - 1);
        let (level, pixel_size) = (field.level(level_idx), f64::from(1u32 << level_idx));
        let step = (outline.area() / config.num_points).sqrt().max(0.5);
        let region_side = (outline.area() / config.num_regions).sqrt().max(1.0);
        // The outline's own edge may be up to a level pixel outside.
        let margin = pixel_size;
        let [width, height] = [bounds.width(), bounds.height()].map(|side| side + 2.0 * margin);
        let (columns, rows) = ((width / step) as usize, (height / step) as usize);
        let regions_across = (width / region_side) as usize + 1;
        let mut points = Vec::new();
        for i in 0..rows * columns {
            let [right, down] = [i % columns, i / columns].map(|k| (k as f64 + 0.5) * step);
            let at = Point2::new(bounds.x1 - margin + right, bounds.y1 - margin + down);
            if !outline.contains(&at) && outline.distance_to_edge(&at) > margin {
                continue;
            }
            let [x, y] = [at.x, at.y].map(|coordinate| (coordinate / pixel_size) as f32);
            if let Some([dx, dy, _]) = level.bilinear(x, y) {
                let region = (down / region_side) as usize * regions_across + (right / region_side) as usize;
                points.push(GridPoint { at, direction: [dx, dy], region });
            }
        }
        let num_regions = points.iter().map(|point| point.region + 1).max().unwrap_or(0);
        let center = bounds.center();
        let reach = 0.5 * width.hypot(height);
        Self { points, num_regions, pixel_size, center, reach, config: *config }
    }

    /// Compares an image, whose gradients are `field`, with the demonstration at a pose.
    ///
    /// # Units and frames
    /// The pose maps demonstration pixels to pixels of the image.
    pub fn agreement(&self, field: &GradientField, image_from_demonstration: &PlanarSimilarity) -> StructureAgreement {
        let mut regions = vec![Correlation::default(); self.num_regions];
        let mut num_outside = self.points.len();
        self.compare(field, image_from_demonstration, |point, _, taught, seen| {
            regions[point.region].add(taught, seen);
            num_outside -= 1;
        });
        StructureAgreement {
            visible: self.visible(&regions),
            outside: num_outside as f64 / (self.points.len() as f64).max(1.0),
        }
    }

    /// The points with an edge in demonstration or image, in regions that disagree; in pixels of the image.
    pub(crate) fn differing(
        &self,
        field: &GradientField,
        image_from_demonstration: &PlanarSimilarity,
    ) -> Vec<Point2<f64>> {
        /// Minimum squared length of a direction that a person sees as an edge. Chosen by hand, not measured.
        const CLEAR: f32 = 0.25;
        let mut regions = vec![Correlation::default(); self.num_regions];
        let mut edges = Vec::new();
        self.compare(field, image_from_demonstration, |point, at, taught, seen| {
            regions[point.region].add(taught, seen);
            if squared(taught).max(squared(seen)) >= CLEAR {
                edges.push((point.region, at));
            }
        });
        let differs = |region: usize| regions[region].value(self.config.noise) < self.config.visible_from;
        edges.into_iter().filter(|(region, _)| differs(*region)).map(|(_, at)| at).collect()
    }

    /// Calls `visit` for every point inside the image, with its position there, the demonstration's direction rotated
    /// by the pose, and the image's direction.
    fn compare(
        &self,
        field: &GradientField,
        image_from_demonstration: &PlanarSimilarity,
        mut visit: impl FnMut(&GridPoint, Point2<f64>, [f32; 2], [f32; 2]),
    ) {
        let level_idx = field.level_idx_for(self.pixel_size * image_from_demonstration.scale);
        let pixel_size = f64::from(1u32 << level_idx);
        let reach = self.reach * image_from_demonstration.scale + pixel_size;
        let level = field.level_about(level_idx, &image_from_demonstration.apply(&self.center), reach);
        let (sin, cos) = (2.0 * image_from_demonstration.angle.radians()).sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        for point in &self.points {
            let at = image_from_demonstration.apply(&point.at);
            let [x, y] = [at.x, at.y].map(|coordinate| (coordinate / pixel_size) as f32);
            if let Some([seen_x, seen_y, _]) = level.bilinear(x, y) {
                let [dx, dy] = point.direction;
                visit(point, at, [cos * dx - sin * dy, sin * dx + cos * dy], [seen_x, seen_y]);
            }
        }
    }

    /// The share of the edges in regions that agree. A region's weight is the larger amount of edges of demonstration
    /// and image, so that edges in only one of them count.
    fn visible(&self, regions: &[Correlation]) -> f64 {
        let (mut all, mut visible) = (0.0, 0.0);
        for region in regions.iter().filter(|region| region.count > 0) {
            let weight = f64::from(region.taught.max(region.seen));
            all += weight;
            visible += if region.value(self.config.noise) >= self.config.visible_from { weight } else { 0.0 };
        }
        if all > 0.0 { visible / all } else { 0.0 }
    }
}

/// The energy of a direction.
fn squared([x, y]: [f32; 2]) -> f32 {
    x * x + y * y
}

/// Sums over pairs of a taught and an observed direction.
#[derive(Debug, Clone, Copy, Default)]
struct Correlation {
    count: usize,
    taught: f32,
    seen: f32,
    products: f32,
}

impl Correlation {
    fn add(&mut self, taught: [f32; 2], seen: [f32; 2]) {
        self.count += 1;
        self.taught += squared(taught);
        self.seen += squared(seen);
        self.products += taught[0] * seen[0] + taught[1] * seen[1];
    }

    /// Two empty areas agree: `noise` is an energy that is added to every point.
    fn value(&self, noise: f64) -> f64 {
        let shared = noise * self.count as f64;
        let [taught, seen, products] = [self.taught, self.seen, self.products].map(|sum| f64::from(sum) + shared);
        if self.count == 0 { 0.0 } else { products / (taught * seen).sqrt().max(f64::MIN_POSITIVE) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};
    use sdg_geometry::{Angle, BoundingBox};

    /// A dark plate with a hole of radius 8 at `hole`, on a light ground, everything moved right by `shift`.
    fn plate(hole: Option<[f64; 2]>, shift: f64) -> RgbImage {
        RgbImage::from_fn(200, 140, |x, y| {
            let (x, y) = (f64::from(x) - shift, f64::from(y));
            let on_plate = (30.0..150.0).contains(&x) && (30.0..110.0).contains(&y);
            let in_hole = hole.is_some_and(|[u, v]| (x - u).hypot(y - v) < 8.0);
            Rgb([if on_plate && !in_hole { 60 } else { 200 }; 3])
        })
    }

    const HOLE: [f64; 2] = [60.0, 70.0];

    fn structure() -> Structure {
        let outline = Polygon::from_box(&BoundingBox { x1: 30.0, y1: 30.0, x2: 150.0, y2: 110.0 });
        let field = GradientField::new(&plate(Some(HOLE), 0.0));
        Structure::new(&field, &outline, &StructureConfig::DEFAULT, &AgreementConfig::DEFAULT)
    }

    fn agreement(image: &RgbImage, pose: &PlanarSimilarity) -> StructureAgreement {
        structure().agreement(&GradientField::new(image), pose)
    }

    #[test]
    fn the_part_itself_agrees_everywhere() {
        let same = agreement(&plate(Some(HOLE), 0.0), &PlanarSimilarity::IDENTITY);
        assert!(same.visible > 0.999 && same.outside == 0.0, "{same:?}");
        let moved = PlanarSimilarity { tx: 20.0, ..PlanarSimilarity::IDENTITY };
        let moved = agreement(&plate(Some(HOLE), 20.0), &moved);
        assert!(moved.visible > 0.98, "{moved:?}");
    }

    #[test]
    fn edges_differ_where_a_hole_is_missing_and_nowhere_else() {
        let differing =
            |hole| structure().differing(&GradientField::new(&plate(hole, 0.0)), &PlanarSimilarity::IDENTITY);
        assert_eq!(differing(Some(HOLE)), []);
        let missing = differing(None);
        let away = |p: &Point2<f64>| (p - Point2::from(HOLE)).norm();
        // As far as a region reaches, and no farther.
        assert!(missing.len() > 5 && missing.iter().all(|p| away(p) < 45.0), "{missing:?}");
        assert!(missing.iter().any(|p| away(p) < 12.0));
    }

    #[test]
    fn what_covers_a_part_of_it_is_not_visible() {
        // A bright sheet with dark stripes lies over the right half.
        let covered = RgbImage::from_fn(200, 140, |x, y| match (x, y) {
            (90.., _) if (x + 2 * y) % 40 < 20 => Rgb([230; 3]),
            (90.., _) => Rgb([30; 3]),
            _ => *plate(Some(HOLE), 0.0).get_pixel(x, y),
        });
        let seen = agreement(&covered, &PlanarSimilarity::IDENTITY);
        assert!((0.05..0.75).contains(&seen.visible) && seen.outside == 0.0, "{seen:?}");
    }

    #[test]
    fn what_lies_outside_is_counted_and_nothing_else_changes() {
        // The plate's right half is beyond the border: 140 of the picture's 200 columns are kept.
        let cropped = image::imageops::crop_imm(&plate(Some(HOLE), 50.0), 0, 0, 140, 140).to_image();
        let pose = PlanarSimilarity { tx: 50.0, ..PlanarSimilarity::IDENTITY };
        let seen = agreement(&cropped, &pose);
        assert!((seen.outside - 0.5).abs() < 0.05 && seen.visible > 0.95, "{seen:?}");
        let away = agreement(&cropped, &PlanarSimilarity { tx: 900.0, ..PlanarSimilarity::IDENTITY });
        assert_eq!(away, StructureAgreement { visible: 0.0, outside: 1.0 });
    }

    #[test]
    fn directions_turn_with_the_pose() {
        let turned = image::imageops::rotate90(&plate(Some(HOLE), 0.0));
        let center = Point2::new(100.0, 70.0);
        let pose = PlanarSimilarity::about(center, Point2::new(70.0, 100.0), Angle::from_degrees(90.0), 1.0);
        let seen = agreement(&turned, &pose);
        assert!(seen.visible > 0.95, "{seen:?}");
    }
}
