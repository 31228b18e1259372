//! A crop with a known angle, for training and measuring the orientation CNN.

use image::RgbImage;
use nalgebra::{Point2, Rotation2};
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::SampleObject;
use sdg_geometry::{Angle, BoundingBox};
use sdg_picture::CropWindow;

use super::jitter::BoxJitter;

/// A crop and the angle of the part on it.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledCrop {
    /// The crop, square.
    pub crop: RgbImage,
    /// Direction of the grasp line on the crop.
    pub angle: Angle,
}

impl LabelledCrop {
    /// The crop of an object by a window rotated by `turn`, around a box with a small error; `None` if the object is
    /// not visible. For an object without an outline `turn` must be zero.
    pub fn of(
        object: &SampleObject,
        image: &RgbImage,
        turn: Angle,
        jitter: &BoxJitter,
        size_px: u32,
        rng: &mut Pcg64Mcg,
    ) -> Option<Self> {
        let seen = jitter.apply(&box_in_turned_frame(object, turn, image)?, rng);
        let straight = CropWindow::around(&seen)?;
        let window = CropWindow { center: image_from_turned(turn) * straight.center, turn, ..straight };
        let (start, end) = (object.keypoints.first()?.point(), object.keypoints.last()?.point());
        let direction = Angle::from_direction(end.x - start.x, end.y - start.y);
        Some(Self { crop: window.read(image, size_px), angle: window.crop_angle(direction) })
    }
}

/// Rotation from the frame of a window rotated by `turn`, with the image's origin, to the image.
fn image_from_turned(turn: Angle) -> Rotation2<f64> {
    Rotation2::new(turn.radians())
}

/// The part's tight box in the image rotated back by `turn`; `None` if the image does not show its outline.
fn box_in_turned_frame(object: &SampleObject, turn: Angle, image: &RgbImage) -> Option<BoundingBox> {
    let Some(outline) = object.outline.as_ref().filter(|_| turn != Angle::ZERO) else {
        return Some(object.bbox);
    };
    // Nothing is visible beyond the image's border.
    let seen = outline.clip(f64::from(image.width()), f64::from(image.height()));
    let turned_from_image = image_from_turned(turn).inverse();
    BoundingBox::around(seen.vertices.iter().map(|vertex: &Point2<f64>| turned_from_image * vertex))
}
