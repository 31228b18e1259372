//! The data on which constants are fitted.

use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::{BoundingBox, GraspLine, PlanarSimilarity, RotationalSymmetry};

/// One part, taught from one photo, and pictures to search for it.
#[derive(Debug, Clone)]
pub struct FitPart {
    /// The demonstration.
    pub demonstration: Demonstration,
    /// The part's symmetry.
    pub symmetry: RotationalSymmetry,
    /// Pictures of the photo's size, with the part and without.
    pub pictures: Vec<FitPicture>,
}

/// A picture and its ground truth.
#[derive(Debug, Clone)]
pub struct FitPicture {
    /// The picture.
    pub image: RgbImage,
    /// Every instance of the part in it.
    pub instances: Vec<FitInstance>,
    /// Boxes of parts that differ only in size: detections on them are neither correct nor wrong.
    pub undecided: Vec<BoundingBox>,
}

/// An instance of the part in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitInstance {
    /// The true marks, in pixels of the picture.
    pub grasp: GraspLine,
    /// Maps the photo's pixels to the picture's.
    pub image_from_demonstration: PlanarSimilarity,
}
