//! A picture and its ground truth.

use image::RgbImage;
use nalgebra::Point3;
use sdg_geometry::{BoundingBox, GraspLine, Mask, PlanarSimilarity, Polygon, PosedCamera};

use super::photo::Silhouette;
use crate::{LookAlike, PartKind};

/// An instance of the part in the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// The marks, in pixels of the picture.
    pub grasp: GraspLine,
    /// The marks in the frame on the table in which [`Sample::camera`] is posed, in metres.
    pub marks_m: [Point3<f64>; 2],
    /// Width of the part between the jaws, in pixels.
    pub jaw_width_px: f64,
    /// Maps the demonstration's pixels to the picture's.
    pub image_from_demonstration: PlanarSimilarity,
    /// Size relative to the demonstration: the similarity's scale.
    pub scale: f64,
    /// Fraction of the part's silhouette that is inside the picture and not covered, from 0 to 1.
    pub visible_share: f64,
    /// Bounding box of the complete silhouette, covered or not; may extend outside the picture.
    pub bbox: BoundingBox,
    pub(crate) silhouette: Silhouette,
}

impl Instance {
    /// Outline of the complete silhouette, covered or not; may extend outside the picture. `None` for a silhouette
    /// with fewer than 12 pixel edges, such as a square of 2 × 2 pixels.
    pub fn outline(&self) -> Option<Polygon> {
        self.silhouette.outline()
    }

    /// The complete silhouette, covered or not, and the position of its first pixel in the picture.
    pub fn silhouette(&self) -> (&Mask, [i32; 2]) {
        (&self.silhouette.mask, self.silhouette.origin)
    }
}

/// Kind of an object that is not the part.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OtherKind {
    /// A different part.
    Part(PartKind),
    /// A look-alike of the part.
    LookAlike(LookAlike),
    /// An object that covers a part.
    Cover,
}

/// An object in the picture other than the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherObject {
    /// Kind of the object.
    pub kind: OtherKind,
    /// A box, in pixels, that contains the object, not always tightly; may extend outside the picture.
    pub bbox: BoundingBox,
}

/// Conditions under which the picture was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The camera's distance divided by the demonstration's.
    pub distance: f64,
    /// The camera's tilt from straight down, in radians.
    pub tilt_rad: f64,
    /// Little light and much noise.
    pub dark: bool,
    /// Defocus: standard deviation of the blur, in pixels of a picture 320 pixels wide; 0 without.
    pub blur_px: f64,
    /// Camera motion during the exposure, in pixels of a picture 320 pixels wide.
    pub motion_px: f64,
    /// Coloured light.
    pub tinted: bool,
    /// Narrow lamps.
    pub glare: bool,
}

/// A picture and its ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The picture.
    pub image: RgbImage,
    /// Index of the picture's part among the parts of [`Scenes`](crate::Scenes).
    pub part_idx: usize,
    /// Every instance of the part in the picture.
    pub instances: Vec<Instance>,
    /// All other objects on the table.
    pub others: Vec<OtherObject>,
    /// Conditions under which the picture was taken.
    pub conditions: Conditions,
    /// The camera's pose, in metres, in a frame on the table with y up as in a vertical picture.
    pub camera: PosedCamera,
    /// The object at each pixel: instances first, then others, [`Sample::TABLE`] for none.
    pub ids: Vec<u8>,
}

impl Sample {
    /// Value in [`ids`](Self::ids) of pixels that show the table.
    pub const TABLE: u8 = super::contents::TABLE;
}
