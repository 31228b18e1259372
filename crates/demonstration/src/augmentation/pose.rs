//! The pose of the part in a sample.

use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity};

use super::config::SceneStyle;
use super::homography::Homography;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, direction, log_uniform, uniform};

/// Fraction of the poses in which the part may extend beyond the border.
const OVERHANG_SHARE: f32 = 0.15;
/// Number of attempts before the part keeps its pose in the photo.
const TRIES: usize = 40;

/// Draws a pose with at least `style.min_inside` of the part inside an image of `width` × `height`; if none is found,
/// the part keeps its pose in the photo.
pub(crate) fn draw_pose(
    part: &Prepared,
    style: &SceneStyle,
    width: f64,
    height: f64,
    rng: &mut SampleRng,
) -> Homography {
    let overhang = chance(rng, OVERHANG_SHARE);
    for _ in 0..TRIES {
        let centered = draw_centered(part, style, width.hypot(height), rng);
        let Some(bounds) = centered.bounds(&part.region.vertices) else { break };
        let (room_x, room_y) =
            (room(bounds.x1, bounds.x2, width, overhang), room(bounds.y1, bounds.y2, height, overhang));
        let (Some([left, right]), Some([top, bottom])) = (room_x, room_y) else { continue };
        let x = f64::from(uniform(rng, left as f32, right as f32));
        let y = f64::from(uniform(rng, top as f32, bottom as f32));
        let pose = Homography::translation(x, y).compose(&centered);
        if share_inside(part, &pose, width, height) >= f64::from(style.min_inside) {
            return pose;
        }
    }
    // A part that fills the photo fits only in its pose in the photo.
    let shift_x = 0.5 * (width - part.photo_size[0] * part.nominal_scale);
    let shift_y = 0.5 * (height - part.photo_size[1] * part.nominal_scale);
    Homography::translation(shift_x, shift_y).compose(&Homography::scaling(part.nominal_scale))
}

/// Turn, scale and tilt about the part's centre, which is mapped to the origin.
fn draw_centered(part: &Prepared, style: &SceneStyle, diagonal: f64, rng: &mut SampleRng) -> Homography {
    let angle = Angle::from_radians(f64::from(uniform(rng, -std::f32::consts::PI, std::f32::consts::PI)));
    let scale = part.nominal_scale * f64::from(log_uniform(rng, style.scale[0], style.scale[1]));
    let turned = Homography::from_similarity(&PlanarSimilarity::about(part.center, Point2::origin(), angle, scale));
    let towards = direction(rng).map(f64::from);
    let squeeze = f64::from(uniform(rng, 0.0, style.max_foreshortening));
    let across_part = f64::from(uniform(rng, 0.0, style.max_perspective));
    // The horizon must not lie inside the image, however far from the part.
    let perspective = (0.5 * across_part / (part.radius * scale)).min(0.4 / diagonal);
    Homography::tilt(Vector2::new(towards[0], towards[1]), squeeze, perspective).compose(&turned)
}

/// The shifts that keep `[low, high]` inside `[0, length]` with a margin of one pixel, or with up to 40 % outside if
/// `overhang`; `None` if there are none.
fn room(low: f64, high: f64, length: f64, overhang: bool) -> Option<[f64; 2]> {
    let allowed = if overhang { 0.4 * (high - low) } else { -1.0 };
    let range = [-low - allowed, length - high + allowed];
    (range[0] <= range[1]).then_some(range)
}

/// The fraction of the part's area inside the image.
pub(crate) fn share_inside(part: &Prepared, pose: &Homography, width: f64, height: f64) -> f64 {
    let image = BoundingBox { x1: 0.0, y1: 0.0, x2: width, y2: height };
    let inside = part.area_points.iter().filter(|point| image.contains(&pose.apply(point))).count();
    inside as f64 / part.area_points.len() as f64
}
