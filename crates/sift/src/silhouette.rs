//! The turn of a part from its outline alone.
//!
//! ```text
//! mask ─► area around the centre by direction ─► turns at which two such profiles correlate
//!                                                    └─► outlines laid on each other from each of these ─► best overlap
//! ```
//!
//! An outline that looks alike at several turns cannot tell them apart; the overlap at the second best turn says so.

use std::f64::consts::TAU;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, Mask, PlanarSimilarity};

/// Directions of a profile.
const NUM_DIRECTIONS: usize = 180;
/// A mask of fewer pixels has no outline to speak of.
const MIN_AREA: usize = 25;
/// Outline points that are laid on the other outline.
const NUM_QUERIES: usize = 256;
/// Points of the part's area at which an overlap is measured.
const NUM_AREA_POINTS: usize = 4000;
/// Peaks of the correlation from which outlines are laid on each other.
const NUM_STARTS: usize = 4;
const MAX_ITERATIONS: usize = 25;
/// The part of the nearest points that counts; the rest may belong to specks, shadows or what covers the part.
const TRIM: f64 = 0.85;
/// Turns closer than this are one.
const DISTINCT_TURN: f64 = 20.0 * TAU / 360.0;

/// A part's outline, ready to be laid on another.
pub(crate) struct Silhouette {
    mask: Mask,
    area: f64,
    centroid: Point2<f64>,
    /// Centres of the mask's pixels, or some of them, evenly spread.
    area_points: Vec<Point2<f64>>,
    /// Middles of the sides between a pixel inside and one outside.
    outline: Vec<Point2<f64>>,
    tree: ImmutableKdTree<f64, 2>,
    profile: Vec<f64>,
}

/// One outline laid on another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SilhouetteFit {
    pub image_from_template: PlanarSimilarity,
    /// Intersection over union of the two areas.
    pub overlap: f64,
    /// The same at the best turn that is another one.
    pub runner_up_overlap: f64,
}

impl Silhouette {
    /// `None` for a mask that is empty or a speck.
    pub(crate) fn new(mask: &Mask) -> Option<Self> {
        let (width, height) = (mask.width(), mask.height());
        let mut pixels = Vec::new();
        let mut outline = Vec::new();
        for y in 0..height {
            for x in 0..width {
                if !mask.get(x, y) {
                    continue;
                }
                let center = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                pixels.push(center);
                let outside = [
                    (x == 0 || !mask.get(x - 1, y), Vector2::new(-0.5, 0.0)),
                    (x + 1 == width || !mask.get(x + 1, y), Vector2::new(0.5, 0.0)),
                    (y == 0 || !mask.get(x, y - 1), Vector2::new(0.0, -0.5)),
                    (y + 1 == height || !mask.get(x, y + 1), Vector2::new(0.0, 0.5)),
                ];
                outline.extend(outside.iter().filter(|(is, _)| *is).map(|(_, step)| center + step));
            }
        }
        if pixels.len() < MIN_AREA {
            return None;
        }
        let area = pixels.len() as f64;
        let centroid = Point2::from(pixels.iter().map(|p| p.coords).sum::<Vector2<f64>>() / area);
        let coordinates: Vec<[f64; 2]> = outline.iter().map(|p| [p.x, p.y]).collect();
        let profile = profile(&pixels, &centroid);
        let area_points = thinned(&pixels, NUM_AREA_POINTS);
        let tree = ImmutableKdTree::new_from_slice(&coordinates).ok()?;
        Some(Self { mask: mask.clone(), area, centroid, area_points, outline, tree, profile })
    }

    /// Intersection over union of the two areas when the template lies at `image_from_template`.
    pub(crate) fn overlap(&self, image: &Self, image_from_template: &PlanarSimilarity) -> f64 {
        let inside = |p: &&Point2<f64>| {
            let p = image_from_template.apply(p);
            let within = p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(image.mask.width()) && p.y < f64::from(image.mask.height());
            within && image.mask.get(p.x as u32, p.y as u32)
        };
        let part_inside = self.area_points.iter().filter(inside).count() as f64 / self.area_points.len() as f64;
        let template_area = self.area * image_from_template.scale.powi(2);
        let intersection = part_inside * template_area;
        (intersection / (template_area + image.area - intersection)).clamp(0.0, 1.0)
    }

    /// Lays this outline, the template's, on the image's.
    ///
    /// # Source
    /// Besl and McKay 1992 (iterated closest points), in both directions and trimmed (Chetverikov et al. 2002).
    pub(crate) fn lay_on(&self, image: &Self) -> Option<SilhouetteFit> {
        let scale = (image.area / self.area).sqrt();
        let fits: Vec<(PlanarSimilarity, f64)> = starts(&self.profile, &image.profile)
            .into_iter()
            .map(|turn| {
                let start = PlanarSimilarity::about(self.centroid, image.centroid, turn, scale);
                let pose = self.closest_points(image, start);
                (pose, self.overlap(image, &pose))
            })
            .collect();
        let &(best, overlap) = fits.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let others = fits.iter().filter(|(pose, _)| pose.angle.distance(best.angle) > DISTINCT_TURN);
        let runner_up_overlap = others.map(|&(_, overlap)| overlap).fold(0.0, f64::max);
        Some(SilhouetteFit { image_from_template: best, overlap, runner_up_overlap })
    }

    fn closest_points(&self, image: &Self, start: PlanarSimilarity) -> PlanarSimilarity {
        let (ours, theirs) = (thinned(&self.outline, NUM_QUERIES), thinned(&image.outline, NUM_QUERIES));
        let mut pose = start;
        for _ in 0..MAX_ITERATIONS {
            let back = pose.inverse();
            let forward = ours.iter().map(|p| (*p, image.nearest(&pose.apply(p))));
            let backward = theirs.iter().map(|p| (self.nearest(&back.apply(p)), *p));
            let mut pairs: Vec<(f64, Point2<f64>, Point2<f64>)> =
                forward.chain(backward).map(|(from, to)| ((pose.apply(&from) - to).norm(), from, to)).collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs.truncate((TRIM * pairs.len() as f64).ceil() as usize);
            let (from, to): (Vec<_>, Vec<_>) = pairs.iter().map(|&(_, from, to)| (from, to)).unzip();
            let Some(next) = PlanarSimilarity::fit(&from, &to) else { return pose };
            // What one more step moves at the outline's far end, about one radius from the centre.
            let radius = self.area.sqrt() * next.scale;
            let moved = next.apply(&self.centroid) - pose.apply(&self.centroid);
            let settled = moved.norm() < 0.01 && next.angle.distance(pose.angle) * radius < 0.01;
            pose = next;
            if settled {
                break;
            }
        }
        pose
    }

    fn nearest(&self, to: &Point2<f64>) -> Point2<f64> {
        let found = self.tree.query(&[to.x, to.y]).nearest_one::<SquaredEuclidean<f64>>().execute();
        self.outline[found.item as usize]
    }
}

/// About `count` of the points, evenly spread over their order.
fn thinned(points: &[Point2<f64>], count: usize) -> Vec<Point2<f64>> {
    points.iter().step_by(points.len().div_ceil(count)).copied().collect()
}

/// How far the part reaches in each direction: the sum of the distances of its pixels, less the mean, of unit length.
fn profile(pixels: &[Point2<f64>], centroid: &Point2<f64>) -> Vec<f64> {
    let mut profile = vec![0.0; NUM_DIRECTIONS];
    for pixel in pixels {
        let from_center = pixel - centroid;
        let direction = from_center.y.atan2(from_center.x).rem_euclid(TAU) / TAU * NUM_DIRECTIONS as f64;
        let (bin, share) = (direction as usize, direction.fract());
        profile[bin % NUM_DIRECTIONS] += (1.0 - share) * from_center.norm();
        profile[(bin + 1) % NUM_DIRECTIONS] += share * from_center.norm();
    }
    let mean = profile.iter().sum::<f64>() / NUM_DIRECTIONS as f64;
    profile.iter_mut().for_each(|v| *v -= mean);
    let length = profile.iter().map(|v| v * v).sum::<f64>().sqrt();
    profile.iter_mut().for_each(|v| *v /= length.max(f64::MIN_POSITIVE));
    profile
}

/// The turns at which the profiles correlate best, and the best one turned by a quarter and a half: an outline that
/// fits these as well is to be found out.
fn starts(template: &[f64], image: &[f64]) -> Vec<Angle> {
    let correlation = |shift: usize| -> f64 {
        template.iter().enumerate().map(|(i, v)| v * image[(i + shift) % NUM_DIRECTIONS]).sum()
    };
    let values: Vec<f64> = (0..NUM_DIRECTIONS).map(correlation).collect();
    let at = |i: usize| values[i % NUM_DIRECTIONS];
    let is_peak = |&i: &usize| at(i) >= at(i + NUM_DIRECTIONS - 1) && at(i) > at(i + 1);
    let mut peaks: Vec<usize> = (0..NUM_DIRECTIONS).filter(is_peak).collect();
    peaks.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    peaks.truncate(NUM_STARTS);
    let best = peaks.first().copied().unwrap_or(0);
    peaks.extend([1, 2, 3].map(|quarter| best + quarter * NUM_DIRECTIONS / 4));
    peaks.into_iter().map(|shift| Angle::from_class(shift, NUM_DIRECTIONS)).collect()
}

#[cfg(test)]
mod tests {
    use sdg_geometry::Polygon;

    use super::*;

    fn mask(corners: &[(f64, f64)], pose: &PlanarSimilarity) -> Mask {
        let vertices = corners.iter().map(|&(x, y)| pose.apply(&Point2::new(x, y))).collect();
        Polygon { vertices }.rasterize(320, 240)
    }

    /// An L, 60 long and 40 wide, about the origin.
    const HOOK: [(f64, f64); 6] =
        [(-20.0, -30.0), (0.0, -30.0), (0.0, 15.0), (20.0, 15.0), (20.0, 30.0), (-20.0, 30.0)];

    fn at(degrees: f64, scale: f64) -> PlanarSimilarity {
        PlanarSimilarity { scale, angle: Angle::from_degrees(degrees), tx: 150.0, ty: 120.0 }
    }

    #[test]
    fn a_hook_tells_its_turn_all_around() {
        let template = Silhouette::new(&mask(&HOOK, &at(0.0, 1.0))).unwrap();
        for degrees in (-180..180).step_by(17) {
            for scale in [0.7, 1.0, 1.4] {
                let truth = at(f64::from(degrees), scale);
                let fit = template.lay_on(&Silhouette::new(&mask(&HOOK, &truth)).unwrap()).unwrap();
                let expected = truth.compose(&at(0.0, 1.0).inverse());
                let error = fit.image_from_template.angle.distance(expected.angle).to_degrees();
                assert!(error < 0.7, "{error} degrees off at {degrees}, scale {scale}");
                assert!((fit.image_from_template.scale / scale - 1.0).abs() < 0.02);
                assert!(fit.overlap > 0.93 && fit.runner_up_overlap < 0.8, "{fit:?}");
            }
        }
    }

    #[test]
    fn a_square_says_that_it_looks_alike_at_other_turns() {
        let square = [(-25.0, -25.0), (25.0, -25.0), (25.0, 25.0), (-25.0, 25.0)];
        let template = Silhouette::new(&mask(&square, &at(0.0, 1.0))).unwrap();
        let fit = template.lay_on(&Silhouette::new(&mask(&square, &at(30.0, 1.0))).unwrap()).unwrap();
        assert!(fit.overlap > 0.95 && fit.overlap - fit.runner_up_overlap < 0.02, "{fit:?}");
        let disk = Mask::from_fn(100, 100, |x, y| (f64::from(x) - 50.0).hypot(f64::from(y) - 50.0) < 30.0);
        let disk = Silhouette::new(&disk).unwrap();
        let fit = disk.lay_on(&disk).unwrap();
        assert!(fit.overlap - fit.runner_up_overlap < 0.02, "{fit:?}");
    }

    #[test]
    fn a_bite_and_specks_move_the_turn_little() {
        let template = Silhouette::new(&mask(&HOOK, &at(0.0, 1.0))).unwrap();
        let mut seen = mask(&HOOK, &at(70.0, 1.0));
        for y in 0..240u32 {
            for x in 0..320u32 {
                if (160..175).contains(&x) && (90..130).contains(&y) {
                    seen.set(x, y, false);
                } else if (200..206).contains(&x) && (150..156).contains(&y) {
                    seen.set(x, y, true);
                }
            }
        }
        let fit = template.lay_on(&Silhouette::new(&seen).unwrap()).unwrap();
        assert!((fit.image_from_template.angle.degrees() - 70.0).abs() < 5.0, "{fit:?}");
    }

    #[test]
    fn empty_masks_and_specks_have_no_outline() {
        assert!(Silhouette::new(&Mask::empty(0, 0)).is_none());
        assert!(Silhouette::new(&Mask::empty(40, 40)).is_none());
        assert!(Silhouette::new(&Mask::from_fn(40, 40, |x, y| x < 2 && y < 2)).is_none());
        // The whole image is a rectangle like any other, however many outline points share a coordinate.
        assert!(Silhouette::new(&Mask::from_fn(500, 300, |_, _| true)).is_some());
    }
}
