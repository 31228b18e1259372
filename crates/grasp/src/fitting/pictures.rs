//! The data on which constants are fitted.

use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::{BoundingBox, GraspLine, PlanarSimilarity, RotationalSymmetry};

/// One part, taught from one photo, and pictures to search for it.
#[derive(Debug, Clone)]
pub struct FitPart {
    /// Its demonstration.
    pub demonstration: Demonstration,
    /// The turns of its symmetry.
    pub symmetry: RotationalSymmetry,
    /// Pictures of the photo's size, with the part and without.
    pub pictures: Vec<FitPicture>,
}

/// A picture and the truth about it.
#[derive(Debug, Clone)]
pub struct FitPicture {
    /// The picture.
    pub image: RgbImage,
    /// Every instance of the part in it.
    pub instances: Vec<FitInstance>,
    /// Boxes of parts that differ only in size: detections on them are neither right nor wrong.
    pub undecided: Vec<BoundingBox>,
}

/// The position of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitInstance {
    /// The true marks, in pixels of the picture.
    pub grasp: GraspLine,
    /// Maps the photo's pixels to the picture's.
    pub image_from_demonstration: PlanarSimilarity,
}
