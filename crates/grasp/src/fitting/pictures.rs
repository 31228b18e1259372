//! What constants are fitted on.

use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::{BoundingBox, GraspLine, PlanarSimilarity, RotationalSymmetry};

/// One part, taught from one photo, and pictures to find it in.
#[derive(Debug, Clone)]
pub struct FitPart {
    /// What it is taught from.
    pub demonstration: Demonstration,
    /// Turns that look the same.
    pub symmetry: RotationalSymmetry,
    /// Pictures of the photo's size, with the part and without.
    pub pictures: Vec<FitPicture>,
}

/// A picture and the truth about it.
#[derive(Debug, Clone)]
pub struct FitPicture {
    /// The picture.
    pub image: RgbImage,
    /// Every one of the part in it.
    pub instances: Vec<FitInstance>,
    /// Boxes of parts that differ in size alone: what is found on them is neither right nor wrong.
    pub undecided: Vec<BoundingBox>,
}

/// Where a part lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitInstance {
    /// The true marks, in pixels of the picture.
    pub grasp: GraspLine,
    /// Takes the photo's pixels to the picture's.
    pub image_from_demonstration: PlanarSimilarity,
}
