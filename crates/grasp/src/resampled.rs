//! A picture resampled to the plan view.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{PlanView, PosedCamera};
use sdg_shape::parallel;

/// Pixels of the plan view between two places whose position in the picture is computed; between them it is interpolated. At a
/// tilt of 25° and a wide lens the error is below a fiftieth of a pixel (tested).
const CELL: u32 = 8;
/// Most samples of the picture a side for a pixel of the plan view.
const MAX_SAMPLES: usize = 8;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelRect {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Where the picture shows each pixel of a plan view: computed once for all pictures of a camera.
#[derive(Debug, Clone)]
pub(crate) struct PlanMap {
    width: u32,
    height: u32,
    columns: usize,
    /// Row by row, [`CELL`] pixels apart.
    nodes: Vec<Option<Point2<f64>>>,
    /// Samples a side for a pixel, so that no pixel of the picture is skipped.
    samples: usize,
}

impl PlanMap {
    pub(crate) fn new(camera: &PosedCamera, view: &PlanView) -> Self {
        Self::of([view.width, view.height], |at| camera.project(&view.point(&at)))
    }

    /// Of `width` × `height` pixels, each point of which the picture shows where `seen` says.
    pub(crate) fn of([width, height]: [u32; 2], seen: impl Fn(Point2<f64>) -> Option<Point2<f64>>) -> Self {
        let [columns, rows] = [width, height].map(|side| side.div_ceil(CELL) + 1);
        let place = |column: u32, row: u32| Point2::new(f64::from(column * CELL), f64::from(row * CELL));
        let nodes: Vec<Option<Point2<f64>>> = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| seen(place(column, row)))
            .collect();
        let middle = Point2::new(0.5 * f64::from(width), 0.5 * f64::from(height));
        let step = |to: Point2<f64>| -> Option<f64> { Some((seen(to)? - seen(middle)?).norm()) };
        let steps = [Point2::new(middle.x + 1.0, middle.y), Point2::new(middle.x, middle.y + 1.0)].map(step);
        let widest = steps.into_iter().flatten().fold(1.0, f64::max);
        Self { width, height, columns: columns as usize, nodes, samples: (widest.ceil() as usize).min(MAX_SAMPLES) }
    }

    /// The plan view of a picture. Outside the picture it repeats the picture's border, so that no edge is made.
    pub(crate) fn resample(&self, picture: &RgbImage) -> RgbImage {
        self.resample_window(picture, &PixelRect { left: 0, top: 0, width: self.width, height: self.height })
    }

    /// A rectangle of the plan view, which must lie in it: the same pixels as [`Self::resample`] gives there.
    pub(crate) fn resample_window(&self, picture: &RgbImage, window: &PixelRect) -> RgbImage {
        let PixelRect { left, top, width, height } = *window;
        let part = 1.0 / self.samples as f64;
        let weight = 1.0 / (self.samples * self.samples) as f32;
        let rows: Vec<u32> = (top..top + height).collect();
        let rows = parallel::map(&rows, |&y| {
            let mut row = Vec::with_capacity(3 * width as usize);
            for x in left..left + width {
                let mut sum = [0.0f32; 3];
                for k in 0..self.samples * self.samples {
                    let [right, down] = [k % self.samples, k / self.samples].map(|k| (k as f64 + 0.5) * part);
                    let color = self.source(x, y, right, down).map_or([0.0; 3], |at| color_at(picture, &at));
                    (0..3).for_each(|c| sum[c] += color[c]);
                }
                row.extend(sum.map(|value| (value * weight + 0.5) as u8));
            }
            row
        });
        RgbImage::from_raw(width, height, rows.concat()).unwrap_or_default()
    }

    /// Where the picture shows a point of a pixel; `None` where the lens shows nothing.
    fn source(&self, x: u32, y: u32, right: f64, down: f64) -> Option<Point2<f64>> {
        let [column, row] = [x / CELL, y / CELL].map(|k| k as usize);
        let along = (f64::from(x % CELL) + right) / f64::from(CELL);
        let below = (f64::from(y % CELL) + down) / f64::from(CELL);
        let at = row * self.columns + column;
        let node = |i: usize| self.nodes[i].map(|point| point.coords);
        let upper = node(at)? * (1.0 - along) + node(at + 1)? * along;
        let lower = node(at + self.columns)? * (1.0 - along) + node(at + self.columns + 1)? * along;
        Some(Point2::from(upper * (1.0 - below) + lower * below))
    }
}

/// The colour at a point by bilinear interpolation; beyond the border that of the nearest pixel.
///
/// `sdg-shape`'s sampling has no colour there, and none in a picture of one row or column.
fn color_at(image: &RgbImage, point: &Point2<f64>) -> [f32; 3] {
    let [width, height] = [image.width(), image.height()].map(|side| f64::from(side - 1));
    let (x, y) = ((point.x - 0.5).clamp(0.0, width), (point.y - 0.5).clamp(0.0, height));
    let (left, top) = (x.floor().min((width - 1.0).max(0.0)), y.floor().min((height - 1.0).max(0.0)));
    let (along, below) = ((x - left) as f32, (y - top) as f32);
    let stride = 3 * image.width() as usize;
    let at = top as usize * stride + 3 * left as usize;
    let raw = image.as_raw();
    let right = if width > 0.0 { 3 } else { 0 };
    let down = if height > 0.0 { stride } else { 0 };
    std::array::from_fn(|c| {
        let row = |at: usize| (1.0 - along) * f32::from(raw[at + c]) + along * f32::from(raw[at + right + c]);
        (1.0 - below) * row(at) + below * row(at + down)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use sdg_geometry::{PinholeCamera, PlumbBob};
    use std::f64::consts::PI;

    fn camera(tilt_deg: f64, lens: PlumbBob) -> PosedCamera {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI + tilt_deg.to_radians());
        PosedCamera {
            intrinsics: PinholeCamera { lens, ..PinholeCamera::WRIST },
            world_from_camera: Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.55).into(), turn),
        }
    }

    #[test]
    fn places_between_the_grids_are_exact_to_a_fiftieth_of_a_pixel() {
        let camera = camera(25.0, PlumbBob { k1: -0.3, k2: 0.1, p1: 0.001, p2: 0.001, k3: 0.0 });
        let view = PlanView::of(&camera, 0.02, 1000.0, None, 10_000_000).unwrap();
        let map = PlanMap::new(&camera, &view);
        for (x, y) in (0..view.width).step_by(13).flat_map(|x| (0..view.height).step_by(11).map(move |y| (x, y))) {
            let middle = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (Some(exact), Some(made)) = (view.in_picture(&camera, &middle), map.source(x, y, 0.5, 0.5)) else {
                continue;
            };
            assert!((exact - made).norm() < 0.02, "{exact} {made}");
        }
    }

    #[test]
    fn straight_down_nothing_changes_and_outside_the_border_goes_on() {
        let camera = camera(0.0, PlumbBob::NONE);
        let picture = RgbImage::from_fn(640, 480, |x, y| Rgb([(x % 256) as u8, (y % 256) as u8, 77]));
        let view = PlanView::of(&camera, 0.0, 1000.0, None, 1_000_000).unwrap();
        assert_eq!(PlanMap::new(&camera, &view).resample(&picture), picture);
        let wider = PlanView { left_m: view.left_m - 0.01, width: view.width + 10, ..view };
        let made = PlanMap::new(&camera, &wider).resample(&picture);
        assert_eq!(made.get_pixel(3, 100), picture.get_pixel(0, 100));
        assert_eq!(made.get_pixel(10, 100), picture.get_pixel(0, 100));
    }

    #[test]
    fn a_coarse_view_averages() {
        let camera = camera(0.0, PlumbBob::NONE);
        let board = RgbImage::from_fn(640, 480, |x, y| Rgb([if (x + y) % 2 == 0 { 0 } else { 200 }; 3]));
        let view = PlanView::of(&camera, 0.0, 250.0, None, 1_000_000).unwrap();
        let made = PlanMap::new(&camera, &view).resample(&board);
        assert_eq!(made.dimensions(), (160, 120));
        assert!(made.pixels().all(|pixel| pixel[0].abs_diff(100) <= 1), "{:?}", made.get_pixel(5, 5));
    }
}
