//! Measures the height of the surface beside a part from two pictures.
//!
//! ```text
//! outline of the part ─ windows around it, the nearest first, without those that the part hides from a camera
//! window ─ at each height: both pictures resampled there ─ correlation ─ the height of the only clear maximum
//! heights of the windows ─ the highest that enough windows around the part have in common ─ SurfaceHeight
//! ```
//! The part's own edges give no height: they are anywhere between its bottom and its top, and the view determines which
//! of them match in two pictures. The grain, scratches, shadows and edges of the surface beside it are in one plane.
//!
//! Not in this module: parts and their poses.

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector2};
use sdg_geometry::{Polygon, PosedCamera, median};

/// Radius of a window, in metres.
const WINDOW_M: f64 = 0.005;
/// Spacing of the samples in a window, in metres: about a pixel of a VGA camera at 0.3 m.
const SAMPLE_M: f64 = 0.0006;
/// Spacing of the windows, in metres.
const WINDOWS_APART_M: f64 = 0.004;
/// Minimum and maximum distance of a window from the outline, in metres.
const WINDOW_DISTANCE_M: [f64; 2] = [0.002, 0.040];
/// Step between the tested heights, in metres: about half a pixel of disparity.
const STEP_M: f64 = 0.0005;
/// Minimum correlation of both pictures at a window's height.
const MIN_CORRELATION: f64 = 0.8;
/// Minimum decrease of the correlation at heights that differ from the window's height by more than [`LEAD_BEYOND_M`].
const MIN_LEAD: f64 = 0.15;
const LEAD_BEYOND_M: f64 = 0.003;
/// Maximum number of windows that determine the surface; the nearest ones are used.
const MAX_WINDOWS: usize = 60;
/// Minimum number of windows on a surface.
const MIN_WINDOWS: usize = 5;
/// Maximum distance of a window's height from the median of its surface, in metres.
const INLIER_M: f64 = 0.001;
/// Number of times that the height is replaced by the median of the windows near it.
const NUM_SHIFTS: usize = 4;
/// Minimum fraction of all windows that must be on the surface.
const MIN_SHARE: f64 = 0.3;
/// Minimum number of the four quadrants around the part that have windows on the surface. An object beside the part is
/// on one side only.
const MIN_QUADRANTS: usize = 3;
/// Number of windows that count as one, because windows overlap and are not independent.
const WINDOWS_PER_VOTE: f64 = 4.0;
/// Resampling error common to all windows, in metres. Fitted together with [`WINDOWS_PER_VOTE`] by
/// crates/cli/examples/heights.rs, so that the ratio of errors to their sigmas has a standard deviation of 1.
const COMMON_SIGMA_M: f64 = 0.12e-3;

/// A picture and its camera.
#[derive(Debug, Clone)]
pub(crate) struct PosedPicture {
    camera: PosedCamera,
    width: usize,
    height: usize,
    /// Brightness, row by row.
    gray: Vec<f32>,
}

/// The height z of a surface and its standard deviation, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SurfaceHeight {
    pub(crate) height_m: f64,
    pub(crate) sigma_m: f64,
}

/// Knowledge of the part before the measurement.
#[derive(Debug, Clone)]
pub(crate) struct PartOnSurface<'a> {
    /// The part's outline from above, in the base frame, in metres.
    pub(crate) outline_m: &'a Polygon,
    /// Height of the part's top above the surface, in metres; it determines which windows the part hides.
    pub(crate) top_m: f64,
    /// Expected height of the surface, in metres.
    pub(crate) expected_m: f64,
    /// Maximum distance of the searched heights from the expected one, in metres.
    pub(crate) within_m: f64,
}

impl PosedPicture {
    pub(crate) fn new(picture: &RgbImage, camera: PosedCamera) -> Self {
        let gray = picture.pixels().map(|pixel| {
            let [red, green, blue] = pixel.0.map(f32::from);
            0.299 * red + 0.587 * green + 0.114 * blue
        });
        let [width, height] = [picture.width(), picture.height()].map(|side| side as usize);
        Self { camera, width, height, gray: gray.collect() }
    }

    /// Samples the brightness of a window at a height; false if the window is not completely in the picture.
    fn sample(&self, middle: &Point2<f64>, height_m: f64, offsets: &[Vector2<f64>], into: &mut Vec<f32>) -> bool {
        into.clear();
        let project = |p: Point2<f64>| self.camera.project(&Point3::new(p.x, p.y, height_m));
        let ends = [Vector2::new(WINDOW_M, 0.0), Vector2::new(0.0, WINDOW_M)].map(|end| project(middle + end));
        let (Some(at), [Some(right), Some(up)]) = (project(*middle), ends) else { return false };
        // In such a small window, a linear map is accurate enough.
        let (by_x, by_y) = ((right - at) / WINDOW_M, (up - at) / WINDOW_M);
        for offset in offsets {
            let p = at + by_x * offset.x + by_y * offset.y - Vector2::new(0.5, 0.5);
            let (left, top) = (p.x.floor(), p.y.floor());
            let is_inside =
                left >= 0.0 && top >= 0.0 && left + 1.0 < self.width as f64 && top + 1.0 < self.height as f64;
            if !is_inside {
                return false;
            }
            let (x, y) = ((p.x - left) as f32, (p.y - top) as f32);
            let at = top as usize * self.width + left as usize;
            let [here, next] = [at, at + self.width].map(|at| (1.0 - x) * self.gray[at] + x * self.gray[at + 1]);
            into.push((1.0 - y) * here + y * next);
        }
        true
    }
}

/// The height of the surface beside a part; `None` if no height has enough textured windows around the part.
pub(crate) fn surface_height(pictures: [&PosedPicture; 2], part: &PartOnSurface<'_>) -> Option<SurfaceHeight> {
    let offsets = window();
    let mut windows: Vec<(Point2<f64>, f64)> = Vec::new();
    for middle in middles(pictures, part) {
        if let Some(height_m) = height_of_window(pictures, &middle, &offsets, part) {
            windows.push((middle, height_m));
            if windows.len() == MAX_WINDOWS {
                break;
            }
        }
    }
    let center = part.outline_m.centroid();
    let min_windows = MIN_WINDOWS.max((MIN_SHARE * windows.len() as f64).ceil() as usize);
    // The highest surface comes first: the surface that carries the part is higher than its surroundings.
    windows.sort_by(|one, other| other.1.total_cmp(&one.1));
    windows.iter().find_map(|(_, height_m)| one_surface(&windows, *height_m, &center, min_windows))
}

/// The surface of the windows near a height, if there are enough of them around the part.
fn one_surface(
    windows: &[(Point2<f64>, f64)],
    about_m: f64,
    center: &Point2<f64>,
    min_windows: usize,
) -> Option<SurfaceHeight> {
    let near = |about_m: f64| windows.iter().filter(move |(_, height_m)| (height_m - about_m).abs() <= INLIER_M);
    let mut middle_m = about_m;
    for _ in 0..NUM_SHIFTS {
        middle_m = median(near(middle_m).map(|(_, height_m)| *height_m))?;
    }
    let inliers: Vec<(Point2<f64>, f64)> = near(middle_m).copied().collect();
    let is_in = |quadrant: (bool, bool)| inliers.iter().any(|(p, _)| (p.x > center.x, p.y > center.y) == quadrant);
    let quadrants = [(false, false), (false, true), (true, false), (true, true)];
    if inliers.len() < min_windows || quadrants.into_iter().filter(|quadrant| is_in(*quadrant)).count() < MIN_QUADRANTS
    {
        return None;
    }
    let count = inliers.len() as f64;
    let height_m = inliers.iter().map(|(_, height_m)| height_m).sum::<f64>() / count;
    let variance = inliers.iter().map(|(_, inlier_m)| (inlier_m - height_m).powi(2)).sum::<f64>() / count;
    let sigma_m = (variance / (count / WINDOWS_PER_VOTE).max(1.0)).sqrt().hypot(COMMON_SIGMA_M);
    Some(SurfaceHeight { height_m, sigma_m })
}

/// The samples of a window, relative to its centre.
fn window() -> Vec<Vector2<f64>> {
    let reach = (WINDOW_M / SAMPLE_M).floor() as i32;
    let side = -reach..=reach;
    side.clone()
        .flat_map(|y| side.clone().map(move |x| Vector2::new(f64::from(x), f64::from(y)) * SAMPLE_M))
        .filter(|offset| offset.norm() <= WINDOW_M)
        .collect()
}

/// The centres of windows beside the part that both cameras see, the nearest first.
fn middles(pictures: [&PosedPicture; 2], part: &PartOnSurface<'_>) -> Vec<Point2<f64>> {
    let outline = part.outline_m;
    let bounds = outline.bounds();
    let reach_m = WINDOW_DISTANCE_M[1];
    let steps = |from: f64, to: f64| {
        let count = ((to - from + 2.0 * reach_m) / WINDOWS_APART_M).ceil() as usize;
        (0..=count).map(move |k| from - reach_m + k as f64 * WINDOWS_APART_M)
    };
    let is_clear = |p: &Point2<f64>| {
        pictures.iter().all(|picture| {
            let camera_m = picture.camera.world_from_camera.translation.vector;
            // The line of sight, at half the part's height and at its top.
            let slope = (camera_m.xy() - p.coords) / (camera_m.z - part.expected_m);
            [0.5, 1.0].into_iter().all(|share| {
                let above = p + slope * (share * part.top_m);
                !outline.contains(&above) && outline.distance_to_edge(&above) > WINDOW_M
            })
        })
    };
    let mut beside: Vec<(f64, Point2<f64>)> = steps(bounds.y1, bounds.y2)
        .flat_map(|y| steps(bounds.x1, bounds.x2).map(move |x| Point2::new(x, y)))
        .filter(|p| !outline.contains(p))
        .map(|p| (outline.distance_to_edge(&p) - WINDOW_M, p))
        .filter(|(distance_m, p)| (WINDOW_DISTANCE_M[0]..=reach_m).contains(distance_m) && is_clear(p))
        .collect();
    beside.sort_by(|one, other| one.0.total_cmp(&other.0));
    beside.into_iter().map(|(_, p)| p).collect()
}

/// The height at which both pictures agree in a window, if it is unambiguous.
fn height_of_window(
    pictures: [&PosedPicture; 2],
    middle: &Point2<f64>,
    offsets: &[Vector2<f64>],
    part: &PartOnSurface<'_>,
) -> Option<f64> {
    let num_steps = (2.0 * part.within_m / STEP_M).ceil() as usize;
    let lowest_m = part.expected_m - part.within_m;
    let [mut one, mut other] = [(), ()].map(|()| Vec::with_capacity(offsets.len()));
    let mut correlations = Vec::with_capacity(num_steps + 1);
    for step in 0..=num_steps {
        let height_m = lowest_m + step as f64 * STEP_M;
        let is_shown = pictures[0].sample(middle, height_m, offsets, &mut one)
            && pictures[1].sample(middle, height_m, offsets, &mut other);
        if !is_shown {
            return None;
        }
        correlations.push(correlation(&one, &other)?);
    }
    let (best_idx, best) = correlations.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    if best_idx == 0 || best_idx == num_steps || best < MIN_CORRELATION {
        return None;
    }
    let is_beyond = |idx: usize| best_idx.abs_diff(idx) as f64 * STEP_M > LEAD_BEYOND_M;
    let second = correlations.iter().enumerate().filter(|(idx, _)| is_beyond(*idx)).map(|(_, value)| *value);
    if best - second.fold(f64::NEG_INFINITY, f64::max) < MIN_LEAD {
        return None;
    }
    // Vertex of the parabola through the maximum and its neighbours.
    let [before, after] = [correlations[best_idx - 1], correlations[best_idx + 1]];
    let bend = before - 2.0 * best + after;
    let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    Some(lowest_m + (best_idx as f64 + shift) * STEP_M)
}

/// Normalised cross-correlation; `None` if one of the windows has no texture.
fn correlation(one: &[f32], other: &[f32]) -> Option<f64> {
    /// Standard deviation, in grey levels, below which a window has no texture: half a level is rounding.
    const MIN_CONTRAST: f64 = 0.5;
    let count = one.len() as f64;
    let mean = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>() / count;
    let [mean_one, mean_other] = [mean(one), mean(other)];
    let (mut both, mut of_one, mut of_other) = (0.0, 0.0, 0.0);
    for (one, other) in one.iter().zip(other) {
        let (one, other) = (f64::from(*one) - mean_one, f64::from(*other) - mean_other);
        both += one * other;
        of_one += one * one;
        of_other += other * other;
    }
    let is_plain = of_one.min(of_other) < count * MIN_CONTRAST * MIN_CONTRAST;
    (!is_plain).then(|| both / (of_one * of_other).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use sdg_geometry::PinholeCamera;
    use std::f64::consts::PI;

    /// A grain of about 2 mm that depends only on the position.
    fn grain(x_m: f64, y_m: f64) -> f64 {
        let noise = |x: i64, y: i64| {
            let mixed = (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0x27d4_eb2f);
            f64::from(((mixed >> 15) & 0xff) as u8)
        };
        let (x, y) = (x_m / 0.002, y_m / 0.002);
        let (left, low) = (x.floor() as i64, y.floor() as i64);
        let (right, up) = (x - left as f64, y - low as f64);
        let row = |y: i64| noise(left, y) * (1.0 - right) + noise(left + 1, y) * right;
        row(low) * (1.0 - up) + row(low + 1) * up
    }

    /// A picture of a surface whose height depends on the position. The camera is at (`x_m`, 0, 0.3 m) and points
    /// straight down.
    fn view(x_m: f64, surface_m: fn(&Point2<f64>) -> f64, brightness: fn(f64, f64) -> f64) -> PosedPicture {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        let world_from_camera = Isometry3::from_parts(Vector3::new(x_m, 0.0, 0.3).into(), down);
        let camera = PosedCamera { intrinsics: PinholeCamera::WRIST, world_from_camera };
        let picture = RgbImage::from_fn(640, 480, |column, row| {
            let ray = camera.ray(&Point2::new(f64::from(column) + 0.5, f64::from(row) + 0.5)).unwrap();
            let mut height_m = 0.0;
            for _ in 0..3 {
                height_m = surface_m(&ray.at_height(height_m).unwrap().xy());
            }
            let p = ray.at_height(height_m).unwrap();
            Rgb([brightness(p.x, p.y) as u8; 3])
        });
        PosedPicture::new(&picture, camera)
    }

    fn square() -> Polygon {
        Polygon { vertices: [[-0.02, -0.02], [0.02, -0.02], [0.02, 0.02], [-0.02, 0.02]].map(Point2::from).to_vec() }
    }

    fn measured(surface_m: fn(&Point2<f64>) -> f64, brightness: fn(f64, f64) -> f64) -> Option<SurfaceHeight> {
        let [left, right] = [-0.06, 0.06].map(|x_m| view(x_m, surface_m, brightness));
        let part = PartOnSurface { outline_m: &square(), top_m: 0.02, expected_m: 0.013, within_m: 0.008 };
        surface_height([&left, &right], &part)
    }

    #[test]
    fn grain_tells_the_height_of_a_surface() {
        let found = measured(|_| 0.011, grain).unwrap();
        assert!((found.height_m - 0.011).abs() < 0.15e-3 && found.sigma_m < 0.2e-3, "{found:?}");
    }

    #[test]
    fn a_plate_under_the_part_counts_and_not_the_table_around_it() {
        let plate = |p: &Point2<f64>| if p.x.abs().max(p.y.abs()) < 0.045 { 0.014 } else { -0.01 };
        let found = measured(plate, grain).unwrap();
        assert!((found.height_m - 0.014).abs() < 0.3e-3, "{found:?}");
    }

    #[test]
    fn nothing_to_see_is_no_height() {
        assert_eq!(measured(|_| 0.011, |_, _| 128.0), None);
        // Stripes along the baseline look the same at every height.
        assert_eq!(measured(|_| 0.011, |_, y_m| grain(0.0, y_m)), None);
        // Heights outside the range are not searched.
        assert_eq!(measured(|_| 0.060, grain), None);
    }

    #[test]
    fn what_the_part_hides_is_left_out() {
        let [left, right] = [-0.06, 0.06].map(|x_m| view(x_m, |_| 0.0, grain));
        let part = PartOnSurface { outline_m: &square(), top_m: 0.03, expected_m: 0.0, within_m: 0.008 };
        let nearest = |direction: Vector2<f64>| {
            let all = middles([&left, &right], &part).into_iter();
            let ahead = all.filter(|p| p.coords.dot(&direction) > 0.8 * p.coords.norm());
            ahead.map(|p| p.coords.dot(&direction)).fold(f64::INFINITY, f64::min)
        };
        // Across the baseline, the nearest window (radius 5 mm) begins 2 mm from the outline. Along the baseline, the
        // part's top hides 30 mm · 0.085 m / 0.3 m more.
        let (along, beside) = (nearest(Vector2::x()), nearest(Vector2::y()));
        assert!((0.0265..0.033).contains(&beside) && along > beside + 0.004, "{along} {beside}");
    }
}
