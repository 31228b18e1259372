//! Model A: position from the box, orientation from a CNN on the box's crop.

use image::RgbImage;
use sdg_geometry::BoundingBox;
use sdg_orientation::{OrientationCnn, crop_for};

use super::placing::{PoseReading, fill_box, nearest_demonstration};
use crate::error::Result;
use crate::facts::TurnSource;
use crate::taught::TaughtDemonstration;

/// Estimates the orientation from the crop of a detected box, and fits the demonstration at that angle into the box.
///
/// # Source
/// Paper, section IV-A. In the paper the box's centre is the grasp; here the grasp keeps the taught offset from that
/// centre.
///
/// # Errors
/// A box without area.
pub(super) async fn box_and_crop(
    network: &OrientationCnn,
    image: &RgbImage,
    bbox: &BoundingBox,
    demonstrations: &[TaughtDemonstration],
) -> Result<Option<PoseReading>> {
    let crop = crop_for(image, bbox, network.config().input_px)?;
    let angle = network.predict_async(&crop).await?.angle;
    Ok(nearest_demonstration(demonstrations, bbox, |_, demonstration| {
        Some((fill_box(demonstration, bbox, angle), TurnSource::Crop))
    }))
}
