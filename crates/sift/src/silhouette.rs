//! The rotation of a part from its outline alone.
//!
//! ```text
//! mask ─► area around the centre by direction ─► rotations at which two such profiles correlate
//!                                                    └─► outlines aligned from each of these ─► best overlap
//! ```
//!
//! If an outline is similar at several rotations, it does not distinguish them; the overlap at the second best rotation
//! shows this.

use std::f64::consts::TAU;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Matrix4, Point2, Vector2, Vector4};
use sdg_geometry::{Angle, Mask, PlanarSimilarity};

/// Number of directions of a profile.
const NUM_DIRECTIONS: usize = 180;
/// Minimum number of pixels of a mask with a usable outline.
const MIN_AREA: usize = 25;
/// Number of outline points that are compared with the other outline.
const NUM_QUERIES: usize = 256;
/// Number of points of the part's area at which an overlap is measured.
const NUM_AREA_POINTS: usize = 4000;
/// Number of correlation peaks from which outlines are aligned.
const NUM_STARTS: usize = 4;
const MAX_ITERATIONS: usize = 12;
/// Radius in pixels around an outline point within which the mask's pixels determine its normal: large enough to smooth
/// the pixel steps.
const NORMAL_WINDOW: i64 = 4;
/// Fraction of the point pairs that is used, the nearest first; the rest may belong to specks, shadows or objects that
/// cover the part.
const TRIM: f64 = 0.85;
/// Minimum difference between rotations that count as distinct, in radians.
const DISTINCT_TURN: f64 = 20.0 * TAU / 360.0;

/// A part's outline, prepared for alignment with another.
pub(crate) struct Silhouette {
    mask: Mask,
    area: f64,
    centroid: Point2<f64>,
    /// Centres of the mask's pixels, or of an evenly distributed subset.
    area_points: Vec<Point2<f64>>,
    /// Centres of the edges between a pixel inside and one outside.
    outline: Vec<OutlinePoint>,
    tree: ImmutableKdTree<f64, 2>,
    profile: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct OutlinePoint {
    at: Point2<f64>,
    /// Unit vector that points out of the part.
    normal: Vector2<f64>,
}

/// One outline aligned with another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SilhouetteFit {
    pub image_from_template: PlanarSimilarity,
    /// Intersection over union of the two areas.
    pub overlap: f64,
    /// Intersection over union at the best distinct other rotation.
    pub runner_up_overlap: f64,
}

impl Silhouette {
    /// Prepares the outline of a mask; `None` for a mask that is empty or a speck.
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
                if outside.iter().any(|(is, _)| *is) {
                    let normal = normal(mask, x, y);
                    let sides = outside.iter().filter(|(is, _)| *is);
                    outline.extend(sides.map(|(_, step)| OutlinePoint { at: center + step, normal }));
                }
            }
        }
        if pixels.len() < MIN_AREA {
            return None;
        }
        let area = pixels.len() as f64;
        let centroid = Point2::from(pixels.iter().map(|p| p.coords).sum::<Vector2<f64>>() / area);
        let coordinates: Vec<[f64; 2]> = outline.iter().map(|p| [p.at.x, p.at.y]).collect();
        let profile = profile(&pixels, &centroid);
        let area_points = thinned(&pixels, NUM_AREA_POINTS);
        let tree = ImmutableKdTree::new_from_slice(&coordinates).ok()?;
        Some(Self { mask: mask.clone(), area, centroid, area_points, outline, tree, profile })
    }

    /// Intersection over union of the two areas with the template at `image_from_template`.
    pub(crate) fn overlap(&self, image: &Self, image_from_template: &PlanarSimilarity) -> f64 {
        let inside = |p: &&Point2<f64>| {
            let p = image_from_template.apply(p);
            let within =
                p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(image.mask.width()) && p.y < f64::from(image.mask.height());
            within && image.mask.get(p.x as u32, p.y as u32)
        };
        let part_inside = self.area_points.iter().filter(inside).count() as f64 / self.area_points.len() as f64;
        let template_area = self.area * image_from_template.scale.powi(2);
        let intersection = part_inside * template_area;
        (intersection / (template_area + image.area - intersection)).clamp(0.0, 1.0)
    }

    /// Aligns this outline, the template's, with the image's outline.
    ///
    /// # Source
    /// Chen and Medioni 1991 (iterated closest points, distances along the normal), from each outline to the other and
    /// trimmed (Chetverikov et al. 2002).
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
            let forward = ours.iter().map(|p| pose.apply(&p.at)).map(|moved| (moved, image.nearest(&moved)));
            let backward = theirs.iter().map(|p| (pose.apply(&self.nearest(&back.apply(&p.at)).at), *p));
            let mut pairs: Vec<(Point2<f64>, OutlinePoint)> = forward.chain(backward).collect();
            let distance = |pair: &(Point2<f64>, OutlinePoint)| (pair.1.at - pair.0).norm();
            pairs.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            pairs.truncate((TRIM * pairs.len() as f64).ceil() as usize);
            let Some(step) = normal_step(&pairs, &pose.apply(&self.centroid)) else { return pose };
            let next = step.compose(&pose);
            // The iteration has converged if this step hardly moves the centre and the far end, about one radius away.
            let radius = self.area.sqrt() * next.scale;
            let moved = next.apply(&self.centroid) - pose.apply(&self.centroid);
            let converged = moved.norm() < 0.01 && next.angle.distance(pose.angle) * radius < 0.01;
            pose = next;
            if converged {
                break;
            }
        }
        pose
    }

    fn nearest(&self, to: &Point2<f64>) -> OutlinePoint {
        let found = self.tree.query(&[to.x, to.y]).nearest_one::<SquaredEuclidean<f64>>().execute();
        self.outline[found.item as usize]
    }
}

/// The small similarity about `center` that brings the points closest to the lines through their partners, by least
/// squares. `None` if it would be very large.
fn normal_step(pairs: &[(Point2<f64>, OutlinePoint)], center: &Point2<f64>) -> Option<PlanarSimilarity> {
    let (mut normal_matrix, mut right) = (Matrix4::zeros(), Vector4::zeros());
    let radius = pairs.iter().map(|(from, _)| (from - center).norm()).fold(1.0, f64::max);
    for (from, to) in pairs {
        // Rotation and scale in units of their effect at the far end, so that all four unknowns are in pixels.
        let arm = (from - center) / radius;
        let n = to.normal;
        let row = Vector4::new(arm.perp(&n), arm.dot(&n), n.x, n.y);
        normal_matrix += row * row.transpose();
        right += row * n.dot(&(to.at - from));
    }
    // A slight damping: an outline that is similar at any rotation stays at its start.
    normal_matrix += Matrix4::identity() * (1e-4 * pairs.len() as f64);
    let found = normal_matrix.cholesky()?.solve(&right);
    let (turn, growth) = (found.x / radius, found.y / radius);
    // A very large step means that the outlines do not match.
    if !(turn.abs() < 0.5 && growth.abs() < 0.5) {
        return None;
    }
    let target = center + Vector2::new(found.z, found.w);
    Some(PlanarSimilarity::about(*center, target, Angle::from_radians(turn), 1.0 + growth))
}

/// Direction away from the part's pixels around pixel (x, y).
fn normal(mask: &Mask, x: u32, y: u32) -> Vector2<f64> {
    let mut balance = Vector2::zeros();
    for dy in -NORMAL_WINDOW..=NORMAL_WINDOW {
        for dx in -NORMAL_WINDOW..=NORMAL_WINDOW {
            let (col, row) = (i64::from(x) + dx, i64::from(y) + dy);
            let within = (0..i64::from(mask.width())).contains(&col) && (0..i64::from(mask.height())).contains(&row);
            // A round window; a square one would favour its diagonals.
            if within && dx * dx + dy * dy <= NORMAL_WINDOW * NORMAL_WINDOW && mask.get(col as u32, row as u32) {
                balance -= Vector2::new(dx as f64, dy as f64);
            }
        }
    }
    // A thin line has the same pixels on both sides, so its normals carry no information.
    balance.try_normalize(1e-9).unwrap_or_else(Vector2::zeros)
}

/// About `count` of the points, at regular steps.
fn thinned<T: Copy>(points: &[T], count: usize) -> Vec<T> {
    points.iter().step_by(points.len().div_ceil(count)).copied().collect()
}

/// The extent of the part in each direction: the sum of the distances of its pixels from the centre. The mean of these
/// sums is subtracted, and the result is scaled to unit length.
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

/// The rotations of the highest profile correlations, and the best one rotated by 90°, 180° and 270°, to detect an
/// outline that fits equally well at these rotations.
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

    /// An L, 60 px long and 40 px wide, about the origin.
    const HOOK: [(f64, f64); 6] =
        [(-20.0, -30.0), (0.0, -30.0), (0.0, 15.0), (20.0, 15.0), (20.0, 30.0), (-20.0, 30.0)];

    fn at(degrees: f64, scale: f64) -> PlanarSimilarity {
        PlanarSimilarity { scale, angle: Angle::from_degrees(degrees), tx: 150.0, ty: 120.0 }
    }

    #[test]
    fn a_hook_tells_its_turn_all_around() {
        let template = Silhouette::new(&mask(&HOOK, &at(0.0, 1.0))).unwrap();
        let mut worst_px = 0.0f64;
        for degrees in (-180..180).step_by(17) {
            for scale in [0.7, 1.0, 1.4] {
                let truth = at(f64::from(degrees), scale);
                let fit = template.lay_on(&Silhouette::new(&mask(&HOOK, &truth)).unwrap()).unwrap();
                let expected = truth.compose(&at(0.0, 1.0).inverse());
                // The far ends are 36 px from the centre.
                let error = fit.image_from_template.angle.distance(expected.angle);
                worst_px = worst_px.max(error * 36.0 * scale);
                assert!((fit.image_from_template.scale / scale - 1.0).abs() < 0.03, "{fit:?}");
                assert!(fit.overlap > 0.9 && fit.runner_up_overlap < 0.8, "{fit:?}");
            }
        }
        // Outlines of whole pixels have an accuracy of about half a pixel.
        assert!(worst_px < 0.6, "{worst_px} pixels off at the far ends");
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
        // The whole image is a rectangle with many outline points that have the same coordinate.
        assert!(Silhouette::new(&Mask::from_fn(500, 300, |_, _| true)).is_some());
    }
}
