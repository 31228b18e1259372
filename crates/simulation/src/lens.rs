//! Pictures of cameras that MuJoCo cannot render: with distortion, or with the optical axis off the centre.
//!
//! ```text
//! PinholeCamera with its lens ─ Frustum: a larger, finer and symmetric pinhole picture ─ rendered ─ resampled
//! ```

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use sdg_geometry::PinholeCamera;

use crate::camera::vertical_field_of_view_rad;
use crate::error::{Result, SimulationError};
use crate::render::{MAX_SIDE_PX, RenderConfig};

/// Resolution of the rendered picture relative to the result; above 1 so that resampling keeps the sharpness. It is
/// lower for cameras whose rendered picture would be larger than [`MAX_SIDE_PX`].
const FINENESS: f64 = 1.5;
/// Number of samples per pixel along each axis.
const SAMPLES: u32 = 2;

/// A picture that MuJoCo can render: the optical axis is in the centre, and there is no distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frustum {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Focal length for x and y, in pixels.
    pub focal_px: f64,
}

impl Frustum {
    /// The frustum that contains the camera's whole view.
    ///
    /// # Errors
    /// [`SimulationError::Configuration`] for a lens whose model does not cover the corners of its own picture.
    pub(crate) fn around(camera: &PinholeCamera) -> Result<Self> {
        Self::holding(camera).ok_or_else(|| SimulationError::Configuration {
            field: "camera.lens",
            expected: "a lens that reaches the picture's corners".into(),
            found: format!("{:?}", camera.lens),
        })
    }

    fn holding(camera: &PinholeCamera) -> Option<Self> {
        let [width, height] = [camera.width, camera.height].map(f64::from);
        let mut half = Vector2::zeros();
        for step in 0..=16 {
            let share = f64::from(step) / 16.0;
            for (x, y) in
                [(share * width, 0.0), (share * width, height), (0.0, share * height), (width, share * height)]
            {
                half = half.sup(&camera.unproject(&Point2::new(x, y))?.xy().coords.abs());
            }
        }
        // The interpolation needs one more pixel on each side; half a pixel is for rounding errors.
        let max_half_px = 0.5 * f64::from(MAX_SIDE_PX) - 1.5;
        let focal_px = (FINENESS * camera.fx.max(camera.fy)).min(max_half_px / half.max());
        let side = |half: f64| (2.0 * (half * focal_px).ceil() + 2.0) as u32;
        Some(Self { width: side(half.x), height: side(half.y), focal_px })
    }

    /// The vertical field of view of MuJoCo's camera for this picture.
    pub(crate) fn vertical_field_of_view_rad(&self) -> f64 {
        vertical_field_of_view_rad(self.focal_px, self.height)
    }

    /// The settings for rendering this picture, otherwise as in `like`.
    pub(crate) fn render_config(&self, like: &RenderConfig) -> RenderConfig {
        RenderConfig { width: self.width, height: self.height, ..*like }
    }

    /// Converts the rendered picture to the camera's picture.
    pub(crate) fn resample(&self, drawn: &RgbImage, camera: &PinholeCamera) -> RgbImage {
        let middle = Vector2::new(f64::from(self.width), f64::from(self.height)) * 0.5;
        let color = |at: Point2<f64>| -> [f32; 3] {
            let Some(seen) = camera.unproject(&at) else { return [0.0; 3] };
            let source = seen.xy().coords * self.focal_px + middle - Vector2::repeat(0.5);
            let [x, y] = [source.x as f32, source.y as f32];
            image::imageops::interpolate_bilinear(drawn, x, y).map_or([0.0; 3], |Rgb(color)| color.map(f32::from))
        };
        RgbImage::from_fn(camera.width, camera.height, |x, y| {
            let mut sum = [0.0; 3];
            for k in 0..SAMPLES * SAMPLES {
                let [right, down] = [k % SAMPLES, k / SAMPLES].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES));
                let color = color(Point2::new(f64::from(x) + right, f64::from(y) + down));
                (0..3).for_each(|c| sum[c] += color[c]);
            }
            Rgb(sum.map(|sum| (sum / (SAMPLES * SAMPLES) as f32).round() as u8))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::PlumbBob;

    #[test]
    fn the_rendered_picture_of_a_large_camera_can_be_rendered() {
        let [width, height] = [5472_u32, 3648];
        let [cx, cy] = [width, height].map(|side| 0.5 * f64::from(side));
        let large = PinholeCamera { width, height, fx: 5000.0, fy: 5000.0, cx, cy, lens: PlumbBob::NONE };
        let frustum = Frustum::around(&large).unwrap();
        assert!((8000..=MAX_SIDE_PX).contains(&frustum.width) && frustum.height <= MAX_SIDE_PX, "{frustum:?}");
        // The limit changes no other camera.
        let usual = PinholeCamera::WRIST;
        assert_eq!(Frustum::around(&usual).unwrap().focal_px, FINENESS * usual.fx.max(usual.fy));
    }

    /// A rendered bright disc is at the position that the camera's own projection gives.
    #[test]
    fn a_disc_appears_where_the_camera_projects_it() {
        let lens = PlumbBob { k1: -0.25, k2: 0.07, p1: 0.002, p2: -0.001, k3: 0.0 };
        let camera = PinholeCamera { width: 320, height: 240, fx: 260.0, fy: 255.0, cx: 170.0, cy: 110.0, lens };
        let frustum = Frustum::around(&camera).unwrap();
        let (disc, radius) = (Point2::new(0.4, -0.3), 0.012);
        let drawn = RgbImage::from_fn(frustum.width, frustum.height, |x, y| {
            let [x, y] = [(x, frustum.width), (y, frustum.height)]
                .map(|(at, side)| (f64::from(at) + 0.5 - 0.5 * f64::from(side)) / frustum.focal_px);
            Rgb([if (Point2::new(x, y) - disc).norm() < radius { 255 } else { 0 }; 3])
        });
        let picture = frustum.resample(&drawn, &camera);
        let mut sum = (0.0, Vector2::zeros());
        for (x, y, color) in picture.enumerate_pixels() {
            let weight = f64::from(color[0]);
            sum = (sum.0 + weight, sum.1 + weight * Vector2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        }
        let expected = camera.project(&nalgebra::Point3::new(disc.x, disc.y, 1.0)).unwrap();
        assert!((Point2::from(sum.1 / sum.0) - expected).norm() < 0.05, "{} {expected}", sum.1 / sum.0);
    }
}
