//! Keypoints with their descriptors.

use nalgebra::Point2;
use sdg_geometry::Angle;

use crate::DESCRIPTOR_LENGTH;

/// A blob of the image, with its size and a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiftKeypoint {
    /// Position in pixels; the centre of the first pixel is at (0.5, 0.5).
    pub position: Point2<f64>,
    /// Scale: σ of the Gaussian with the strongest response to the blob, in pixels of the image.
    pub sigma: f64,
    /// Direction of the strongest gradients around the blob; positive is clockwise as seen, because y points
    /// down.
    pub angle: Angle,
    /// Contrast of the blob, as a fraction of the range from black to white, times the number of intervals of
    /// an octave.
    pub contrast: f64,
}

/// A unit vector: 4 × 4 cells, row by row, with 8 directions each.
pub type Descriptor = [f32; DESCRIPTOR_LENGTH];

/// The features of an image: keypoint `i` has descriptor `i`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Features {
    /// Position, size and orientation of each feature.
    pub keypoints: Vec<SiftKeypoint>,
    /// Descriptor of each keypoint.
    pub descriptors: Vec<Descriptor>,
}

impl Features {
    /// The number of features.
    pub fn len(&self) -> usize {
        self.keypoints.len()
    }

    /// Whether there are no features.
    pub fn is_empty(&self) -> bool {
        self.keypoints.is_empty()
    }
}
