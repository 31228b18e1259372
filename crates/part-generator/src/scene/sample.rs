//! A picture and the truth about it.

use image::RgbImage;
use nalgebra::Point3;
use sdg_geometry::{BoundingBox, GraspLine, Mask, PlanarSimilarity, Polygon, PosedCamera};

use super::photo::Silhouette;
use crate::{LookAlike, PartKind};

/// One of the part in the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// The marks, in pixels of the picture.
    pub grasp: GraspLine,
    /// The marks in the frame of [`Sample::camera`], in metres.
    pub marks_m: [Point3<f64>; 2],
    /// Width of the part between the jaws, in pixels.
    pub jaw_width_px: f64,
    /// Takes the demonstration's pixels to the picture's.
    pub image_from_demonstration: PlanarSimilarity,
    /// Size against the demonstration: the similarity's scale.
    pub scale: f64,
    /// Share of the part's silhouette that is inside the picture and not covered, from 0 to 1.
    pub visible_share: f64,
    /// The box around the whole silhouette, covered or not; may reach outside the picture.
    pub bbox: BoundingBox,
    pub(crate) silhouette: Silhouette,
}

impl Instance {
    /// The outline of the whole silhouette, covered or not; may reach outside the picture. None for a silhouette of
    /// less than three pixels a side.
    pub fn outline(&self) -> Option<Polygon> {
        self.silhouette.outline()
    }

    /// The whole silhouette, covered or not, and the picture's pixel at which its first pixel lies.
    pub fn silhouette(&self) -> (&Mask, [i32; 2]) {
        (&self.silhouette.mask, self.silhouette.origin)
    }
}

/// What else lies in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OtherKind {
    /// Another part.
    Part(PartKind),
    /// A look-alike of the part.
    LookAlike(LookAlike),
    /// Something laid over a part.
    Cover,
}

/// Something in the picture that is not the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherObject {
    /// What it is.
    pub kind: OtherKind,
    /// The box around it, in pixels; may reach outside the picture.
    pub bbox: BoundingBox,
}

/// How the picture was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The camera's distance over the demonstration's.
    pub distance: f64,
    /// The camera's tilt from straight down, in radians.
    pub tilt_rad: f64,
    /// Little light and much noise.
    pub dark: bool,
    /// Out of focus: radius in pixels.
    pub blur_px: f64,
    /// Way of the camera during the exposure, in pixels.
    pub motion_px: f64,
    /// Coloured light.
    pub tinted: bool,
    /// Narrow lamps.
    pub glare: bool,
}

/// A picture and the truth about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The picture.
    pub image: RgbImage,
    /// Which of the parts of [`Scenes`](crate::Scenes) it was drawn for.
    pub part_idx: usize,
    /// Every one of the part in the picture.
    pub instances: Vec<Instance>,
    /// Everything else on the table.
    pub others: Vec<OtherObject>,
    /// How it was taken.
    pub conditions: Conditions,
    /// The camera that took it, in metres over the table; its frame's y is up as in a picture from straight above.
    pub camera: PosedCamera,
    /// For each pixel the object that it shows: instances first, then others, [`Sample::TABLE`] for none.
    pub ids: Vec<u8>,
}

impl Sample {
    /// Stands in [`ids`](Self::ids) for pixels that show the table.
    pub const TABLE: u8 = super::contents::TABLE;
}
