//! Removes unmarked parts from the photos of demonstrations.
//!
//! The photos are the background of the samples: an unmarked part there would be taught as background, raise the
//! resemblance of other objects, and count as a wrong detection.

use sdg_demonstration::Demonstration;
use sdg_geometry::Polygon;

use crate::detection::GraspDetection;
use crate::error::Result;
use crate::model::{GraspModel, Verification};

/// The demonstrations without the unmarked parts that the model detects in their photos, and the number of these parts.
///
/// The returned photos are used only to make samples, because a wrong detection may have removed a part of another
/// object from them.
///
/// # Errors
/// As for [`GraspModel::detect`].
pub fn without_unmarked_parts(
    model: &GraspModel,
    demonstrations: &[Demonstration],
) -> Result<(Vec<Demonstration>, usize)> {
    let mut num_unmarked = 0;
    let mut alone = Vec::with_capacity(demonstrations.len());
    for demonstration in demonstrations {
        let detections = model.detect(&demonstration.image, Verification::ByShape)?;
        let marked = demonstration.annotation.bbox;
        let unmarked = detections.iter().filter(|found| found.is_accepted() && !marked.contains(&found.bbox.center()));
        let region = |found: &GraspDetection| {
            found.outline.clone().unwrap_or_else(|| Polygon { vertices: found.bbox.corners().to_vec() })
        };
        let regions: Vec<Polygon> = unmarked.map(region).collect();
        num_unmarked += regions.len();
        alone.push(demonstration.clone().without(&regions));
    }
    Ok((alone, num_unmarked))
}
