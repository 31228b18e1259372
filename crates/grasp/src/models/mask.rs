//! Model D: position from the mask, orientation from SIFT keypoints or the outline.

use std::fmt;
use std::sync::Arc;

use image::RgbImage;
use nalgebra::Vector2;
use sdg_geometry::{BoundingBox, Mask, PlanarSimilarity, Polygon};
use sdg_sift::{Plane, RotationConfig, RotationEstimator, RotationMethod, RotationTemplate, Sift, SiftConfig};

use super::placing::{PoseReading, nearest_demonstration};
use crate::error::Result;
use crate::facts::TurnSource;
use crate::taught::TaughtDemonstration;

/// Margin in pixels around a mask, so that keypoints near the edge of the mask are described with their surroundings.
/// Chosen by hand, not measured.
const MARGIN_PX: f64 = 24.0;

/// The mask of a pipe, with 28 cells per side, overlaps the pipe's outline by only a third even at the exact pose. The
/// required overlap is therefore low; the later comparison with the demonstration decides whether the mask shows the
/// part. Chosen on fuel lines, a shipped part; the number of pictures is not recorded.
fn rotation() -> RotationConfig {
    let mut config = RotationConfig::default();
    config.min_overlap = 0.3;
    config
}

/// The demonstrations in the form that is compared with a mask's content.
#[derive(Clone)]
pub(crate) struct MaskMatcher {
    estimator: Arc<RotationEstimator>,
    /// One template per demonstration, in the same order.
    templates: Vec<Arc<RotationTemplate>>,
}

impl fmt::Debug for MaskMatcher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let features: Vec<usize> = self.templates.iter().map(|template| template.features().len()).collect();
        f.debug_struct("MaskMatcher").field("features", &features).finish_non_exhaustive()
    }
}

impl MaskMatcher {
    /// Extracts texture and outline of the demonstrations.
    ///
    /// # Errors
    /// A demonstration with neither texture nor outline.
    pub(crate) fn new(demonstrations: &[TaughtDemonstration]) -> Result<Self> {
        let estimator = RotationEstimator::new(Sift::new(SiftConfig::default())?, rotation())?;
        let templates = demonstrations
            .iter()
            .map(|demonstration| {
                let (width, height) = demonstration.cutout.dimensions();
                let outline: Polygon = demonstration.outline(&PlanarSimilarity::IDENTITY);
                let mask = outline.rasterize(width, height);
                Ok(Arc::new(estimator.template(&Plane::from_rgb(&demonstration.cutout), Some(&mask))?))
            })
            .collect::<Result<_>>()?;
        Ok(Self { estimator: Arc::new(estimator), templates })
    }

    /// The pose of the demonstration: by matched keypoints if enough of them agree, otherwise by the outline, which may
    /// be wrong by 180° if both ends of the part look alike. `None` if neither gives an orientation, or for an empty
    /// mask.
    ///
    /// # Source
    /// Paper, section IV-D. In the paper the mask's centroid is the grasp; here the whole pose is estimated.
    ///
    /// # Errors
    /// Only a mask whose size differs from the image's.
    pub(super) fn place(
        &self,
        image: &RgbImage,
        mask: &Mask,
        bbox: &BoundingBox,
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Option<PoseReading>> {
        let Some(bounds) = mask.bounds() else { return Ok(None) };
        let window = Window::around(&bounds, image);
        let (plane, mask) = (Plane::from_rgb(&window.cut(image)), window.cut_mask(mask));
        let poses = self
            .templates
            .iter()
            .map(|template| {
                let estimate = self.estimator.estimate(template, &plane, Some(&mask))?;
                Ok(estimate.map(|estimate| {
                    let source = match estimate.method {
                        RotationMethod::Features { .. } => TurnSource::Texture,
                        _ => TurnSource::Outline,
                    };
                    (window.in_image(&estimate.image_from_template), source)
                }))
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(nearest_demonstration(demonstrations, bbox, |i, _| poses[i]))
    }
}

/// The window of an image around the mask, in whole pixels: SIFT on the rest would waste time.
struct Window {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

impl Window {
    fn around(bounds: &BoundingBox, image: &RgbImage) -> Self {
        let (image_width, image_height) = image.dimensions();
        let span = |low: f64, high: f64, extent: u32| {
            let first = (low - MARGIN_PX).floor().max(0.0) as u32;
            (first, ((high + MARGIN_PX).ceil() as u32).min(extent) - first)
        };
        let (left, width) = span(bounds.x1, bounds.x2, image_width);
        let (top, height) = span(bounds.y1, bounds.y2, image_height);
        Self { left, top, width, height }
    }

    fn cut(&self, image: &RgbImage) -> RgbImage {
        image::imageops::crop_imm(image, self.left, self.top, self.width, self.height).to_image()
    }

    fn cut_mask(&self, mask: &Mask) -> Mask {
        Mask::from_fn(self.width, self.height, |x, y| mask.get(self.left + x, self.top + y))
    }

    /// A pose in the window as a pose in the image.
    fn in_image(&self, window_from_cutout: &PlanarSimilarity) -> PlanarSimilarity {
        window_from_cutout.shifted(Vector2::new(f64::from(self.left), f64::from(self.top)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taught_marks::TaughtMarks;
    use image::Rgb;
    use nalgebra::Point2;
    use sdg_geometry::{Angle, GraspLine};

    /// An L of one colour: only its outline shows its pose.
    fn l_shape() -> Polygon {
        let corners = [(20.0, 20.0), (120.0, 20.0), (120.0, 45.0), (45.0, 45.0), (45.0, 100.0), (20.0, 100.0)];
        Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() }
    }

    fn painted(outline: &Polygon, width: u32, height: u32) -> RgbImage {
        let mask = outline.rasterize(width, height);
        RgbImage::from_fn(width, height, |x, y| Rgb(if mask.get(x, y) { [200; 3] } else { [50; 3] }))
    }

    #[test]
    fn a_plain_part_is_placed_by_its_outline() {
        let outline = l_shape();
        let marks = TaughtMarks {
            label: "L".into(),
            bbox: outline.bounds(),
            grasp: GraspLine::new(Point2::new(70.0, 32.0), Point2::new(110.0, 32.0)),
            outline: Some(outline.clone()),
            width_px: 25.0,
            photo_size: None,
            photo_middle: None,
        };
        let demonstrations = [TaughtDemonstration::from_parts(painted(&outline, 140, 120), marks).unwrap()];
        let matcher = MaskMatcher::new(&demonstrations).unwrap();
        for degrees in [0.0, 75.0, -160.0] {
            let truth = PlanarSimilarity::about(
                Point2::new(70.0, 60.0),
                Point2::new(190.0, 130.0),
                Angle::from_degrees(degrees),
                1.1,
            );
            let moved = outline.transformed(&truth);
            let (image, mask) = (painted(&moved, 400, 300), moved.rasterize(400, 300));
            let placed = matcher.place(&image, &mask, &moved.bounds(), &demonstrations).unwrap().unwrap();
            let (found, expected) =
                (demonstrations[0].grasp(&placed.image_from_cutout), demonstrations[0].grasp(&truth));
            assert!((found.center() - expected.center()).norm() < 1.5, "{degrees}: {found:?} {expected:?}");
            assert!(found.angle.distance(expected.angle).to_degrees() < 2.0, "{degrees}: {found:?} {expected:?}");
        }
    }

    #[test]
    fn an_empty_mask_is_nowhere() {
        let outline = l_shape();
        let image = painted(&outline, 140, 120);
        let matcher = MaskMatcher { estimator: Arc::default(), templates: Vec::new() };
        let placed = matcher.place(&image, &Mask::empty(140, 120), &outline.bounds(), &[]).unwrap();
        assert!(placed.is_none());
    }
}
