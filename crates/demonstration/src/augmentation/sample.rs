//! A sample: a picture and the parts on it.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{Angle, BoundingBox, GraspLine, Keypoint, PlanarSimilarity, Polygon, Visibility};

use super::homography::Homography;
use super::prepared::Prepared;
use crate::Annotation;

/// A picture for training or validation, with its ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The picture.
    pub image: RgbImage,
    /// The parts on it; empty for a scene without the part, and in the paper's style if the part is outside the picture.
    pub objects: Vec<SampleObject>,
}

/// One part on a [`Sample`], in pixels of the sample.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleObject {
    /// The box, clipped at the image's border: tight around the outline; without an outline, or in the paper's style,
    /// tight around the rotated box.
    pub bbox: BoundingBox,
    /// The [`NUM_KEYPOINTS`](crate::NUM_KEYPOINTS) keypoints of the grasp line, start to end; unlabelled outside
    /// the image, occluded where something covers them. Empty if no grasp is marked.
    pub keypoints: Vec<Keypoint>,
    /// The outline, not clipped; `None` if none was drawn.
    pub outline: Option<Polygon>,
    /// The pose of the demonstration in the sample: the similarity nearest to the warp, which also tilts
    /// slightly.
    pub image_from_demonstration: PlanarSimilarity,
    /// Index of its demonstration.
    pub demonstration_idx: usize,
}

impl SampleObject {
    pub(crate) fn new(part: &Prepared, pose: &Homography, size: [u32; 2], demonstration_idx: usize) -> Self {
        let [width, height] = size.map(f64::from);
        let warped = Polygon { vertices: part.region.vertices.iter().map(|vertex| pose.apply(vertex)).collect() };
        let seen = warped.clip(width, height);
        // The clipped polygon's box, because the clipped box would include areas of hidden vertices.
        let bbox = if seen.vertices.is_empty() { warped.bounds().clip(width, height) } else { seen.bounds() };
        let image = BoundingBox { x1: 0.0, y1: 0.0, x2: width, y2: height };
        let keypoints = part
            .keypoints
            .iter()
            .map(|keypoint| {
                let place = pose.apply(&keypoint.point());
                let visibility = if image.contains(&place) { Visibility::Visible } else { Visibility::Unlabelled };
                Keypoint { x: place.x, y: place.y, visibility }
            })
            .collect();
        let moved: Vec<Point2<f64>> = part.area_points.iter().map(|point| pose.apply(point)).collect();
        let image_from_demonstration = PlanarSimilarity::fit(&part.area_points, &moved).unwrap_or_else(|| {
            PlanarSimilarity::about(part.center, pose.apply(&part.center), Angle::ZERO, part.nominal_scale)
        });
        Self {
            bbox,
            keypoints,
            outline: part.has_outline.then_some(warped),
            image_from_demonstration,
            demonstration_idx,
        }
    }

    /// The object as an annotation of the sample, for a file.
    ///
    /// The outline is clipped at the border, like the box; a grasp line that leaves the image is left out.
    pub fn annotation(&self, label: &str, sample: &RgbImage) -> Annotation {
        let (width, height) = (f64::from(sample.width()), f64::from(sample.height()));
        let ends = [self.keypoints.first(), self.keypoints.last()];
        let grasp = match ends {
            [Some(start), Some(end)] if start.is_labelled() && end.is_labelled() => {
                Some(GraspLine::new(start.point(), end.point()))
            }
            _ => None,
        };
        let outline = self.outline.as_ref().map(|outline| outline.clip(width, height));
        Annotation {
            label: label.into(),
            bbox: self.bbox,
            grasp,
            jaw_width: None,
            outline: outline.filter(|outline| outline.vertices.len() >= 3),
        }
    }
}
