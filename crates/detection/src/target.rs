//! The objects in an image, in pixels of the original and of the resized image.

use sdg_geometry::{BoundingBox, Keypoint, Mask, Polygon};

use crate::boxes::Corners;
use crate::config::{MaskTargets, RoiHeadsConfig};
use crate::error::{DetectionError, Result};
use crate::image_transform::TransformedImage;

/// The objects in one image, in pixels of the original image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Target {
    /// Boxes; empty for an image without objects.
    pub boxes: Vec<BoundingBox>,
    /// Class of each box, from 0.
    pub labels: Vec<usize>,
    /// Keypoints of each box; may be empty if the detector has no keypoint head.
    pub keypoints: Vec<Vec<Keypoint>>,
    /// Mask of each box; may be empty if the detector has no mask head.
    pub masks: Vec<ObjectMask>,
}

/// The objects of one image, in pixels of the resized image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResizedTarget {
    /// Boxes, in pixels of the resized image.
    pub boxes: Vec<Corners>,
    /// Class of each box.
    pub labels: Vec<usize>,
    /// Keypoints of each box; may be empty if the detector has no keypoint head.
    pub keypoints: Vec<Vec<Keypoint>>,
    /// Mask of each box; empty if the detector has no mask head.
    pub masks: Vec<ObjectMask>,
}

/// The area of an image that an object covers.
#[derive(Debug, Clone, PartialEq)]
pub enum ObjectMask {
    /// The union of these polygons, in pixels.
    Polygons(Vec<Polygon>),
    /// A bit per pixel, of the image's size.
    Bitmap(Mask),
}

impl From<Polygon> for ObjectMask {
    fn from(polygon: Polygon) -> Self {
        Self::Polygons(vec![polygon])
    }
}

impl From<Mask> for ObjectMask {
    fn from(mask: Mask) -> Self {
        Self::Bitmap(mask)
    }
}

impl ObjectMask {
    /// The mask on the resized image; each pixel of a bitmap takes the value of one pixel of the original.
    fn resized(&self, image: &TransformedImage, kind: MaskTargets) -> Self {
        let [scale_x, scale_y] = image.resized_from_original();
        let mask = match self {
            Self::Polygons(polygons) => {
                return Self::Polygons(polygons.iter().map(|polygon| polygon.scaled(scale_x, scale_y)).collect());
            }
            Self::Bitmap(mask) => mask,
        };
        // Pillow takes the pixel that contains the new pixel's centre, torch the one that contains its upper left
        // corner.
        let offset = match kind {
            MaskTargets::Rasterized => 0.5,
            MaskTargets::Pooled => 0.0,
        };
        let source = |at: u32, scale: f64, extent: u32| (((f64::from(at) + offset) / scale) as u32).min(extent - 1);
        Self::Bitmap(Mask::from_fn(image.width as u32, image.height as u32, |x, y| {
            mask.get(source(x, scale_x, mask.width()), source(y, scale_y, mask.height()))
        }))
    }
}

impl Target {
    /// Checks the target against its image and the detector's heads.
    pub(crate) fn check(&self, image_idx: usize, image: &TransformedImage, heads: &RoiHeadsConfig) -> Result<()> {
        let fail =
            |field, expected: String, found: String| Err(DetectionError::Target { image_idx, field, expected, found });
        let count = self.boxes.len();
        if self.labels.len() != count {
            return fail("labels", format!("{count}, one per box"), self.labels.len().to_string());
        }
        if let Some(label) = self.labels.iter().find(|l| **l >= heads.num_classes) {
            return fail("labels", format!("classes below {}", heads.num_classes), label.to_string());
        }
        for b in &self.boxes {
            let finite = [b.x1, b.y1, b.x2, b.y2].iter().all(|v| v.is_finite());
            if !finite || b.width() <= 0.0 || b.height() <= 0.0 {
                return fail("boxes", "finite, with width and height".to_owned(), format!("{b:?}"));
            }
        }
        if let Some(head) = &heads.keypoint_head {
            if self.keypoints.len() != count {
                return fail("keypoints", format!("{count}, one list per box"), self.keypoints.len().to_string());
            }
            for keypoints in &self.keypoints {
                if keypoints.len() != head.num_keypoints {
                    return fail("keypoints", format!("{} in a list", head.num_keypoints), keypoints.len().to_string());
                }
                let broken = |k: &&Keypoint| k.is_labelled() && !(k.x.is_finite() && k.y.is_finite());
                if let Some(keypoint) = keypoints.iter().find(broken) {
                    return fail("keypoints", "finite coordinates".to_owned(), format!("{keypoint:?}"));
                }
            }
        }
        if heads.mask_head.is_some() {
            if self.masks.len() != count {
                return fail("masks", format!("{count}, one per box"), self.masks.len().to_string());
            }
            for mask in &self.masks {
                match mask {
                    ObjectMask::Polygons(polygons) => {
                        let broken = |p: &&Polygon| {
                            p.vertices.len() < 3 || p.vertices.iter().any(|v| !(v.x.is_finite() && v.y.is_finite()))
                        };
                        if polygons.is_empty() {
                            return fail("masks", "at least one polygon".to_owned(), "none".to_owned());
                        }
                        if let Some(polygon) = polygons.iter().find(broken) {
                            let expected = "three or more vertices with finite coordinates".to_owned();
                            return fail("masks", expected, format!("{polygon:?}"));
                        }
                    }
                    ObjectMask::Bitmap(mask) => {
                        let expected = (image.original_width, image.original_height);
                        let found = (mask.width() as usize, mask.height() as usize);
                        if found != expected {
                            let size = |(width, height): (usize, usize)| format!("{width}x{height}");
                            return fail("masks", format!("a bitmap of {}", size(expected)), size(found));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Converts the target to pixels of the resized image.
    pub(crate) fn resized(&self, image: &TransformedImage, heads: &RoiHeadsConfig) -> ResizedTarget {
        let [sx, sy] = image.resized_from_original();
        let scaled =
            |keypoint: &Keypoint| Keypoint { x: keypoint.x * sx, y: keypoint.y * sy, visibility: keypoint.visibility };
        ResizedTarget {
            boxes: self.boxes.iter().map(|b| image.resized_box(b)).collect(),
            labels: self.labels.clone(),
            keypoints: self.keypoints.iter().map(|list| list.iter().map(scaled).collect()).collect(),
            masks: match &heads.mask_head {
                Some(head) => self.masks.iter().map(|mask| mask.resized(image, head.targets)).collect(),
                None => Vec::new(),
            },
        }
    }
}

/// The pixels whose centres are in any of the polygons.
pub(crate) fn union(polygons: &[Polygon], width: u32, height: u32) -> Mask {
    let parts: Vec<Mask> = polygons.iter().map(|polygon| polygon.rasterize(width, height)).collect();
    Mask::from_fn(width, height, |x, y| parts.iter().any(|part| part.get(x, y)))
}
