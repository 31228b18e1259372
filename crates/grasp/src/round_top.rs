//! The position of the marks of a part of revolution in a picture.
//!
//! The outline of a screw that lies on its side is at the height of the axis; the marks are on the upper side, higher
//! by the radius at the marks. This height determines their shift in a camera's picture. The surroundings of the marks
//! differ with the roll about the axis and carry no information. If the part lies in the same roll as in the photo,
//! edges on its upper side also agree and shift the pose from the outline towards the marks; this shift is measured
//! with the outline alone.

use nalgebra::{Point2, Vector2};
use sdg_geometry::PlanarSimilarity;
use sdg_shape::{GradientField, Revolution, ShapeSearch};

use crate::taught_marks::TaughtMarks;

/// The marks on the upper side of a part of revolution.
#[derive(Debug, Clone)]
pub(crate) struct RoundTop {
    /// Height of the marks above the axis, in pixels of the cut-out.
    rise: f64,
    /// The centre of the photo, in pixels of the cut-out.
    photo_middle: Point2<f64>,
}

impl RoundTop {
    /// `marks` are in pixels of the cut-out in which `revolution` was found.
    pub(crate) fn new(revolution: &Revolution, marks: &TaughtMarks) -> Self {
        let rise = revolution.radius_beside(&marks.grasp);
        Self { rise, photo_middle: marks.photo_middle.map_or(marks.grasp.center(), Point2::from) }
    }

    /// The shift of the marks relative to the outline in the camera's picture.
    ///
    /// # Units and frames
    /// Pixels of the picture, also for the camera's height above the table; `below_camera` is the point of the table
    /// vertically below the camera.
    fn shift(
        &self,
        camera_height_px: f64,
        below_camera: Point2<f64>,
        image_from_cutout: &PlanarSimilarity,
    ) -> Vector2<f64> {
        let nearer = self.rise * image_from_cutout.scale / camera_height_px;
        nearer * (image_from_cutout.apply(&self.photo_middle) - below_camera)
    }

    /// `image_from_cutout`, the pose at which all edges together agree best, shifted to the position of the marks in
    /// the picture.
    ///
    /// # Units and frames
    /// As for [`RoundTop::shift`]; `field` belongs to the picture.
    pub(crate) fn placed(
        &self,
        search: &ShapeSearch,
        field: &GradientField,
        (camera_height_px, below_camera): (f64, Point2<f64>),
        image_from_cutout: &PlanarSimilarity,
    ) -> PlanarSimilarity {
        let shift = self.shift(camera_height_px, below_camera, image_from_cutout);
        let outline = search.outline_beside(field, image_from_cutout, -shift);
        image_from_cutout.shifted((1.0 - outline) * shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_go_outwards_by_their_height_over_the_distance() {
        // Marks 12 px above the axis; the camera was vertically above them for the photo.
        let top = RoundTop { rise: 12.0, photo_middle: Point2::new(40.0, 10.0) };
        let pose = PlanarSimilarity { tx: 460.0, ty: 90.0, scale: 1.25, ..PlanarSimilarity::IDENTITY };
        let at = pose.apply(&Point2::new(40.0, 10.0));
        let shift = top.shift(600.0, Point2::new(320.0, 240.0), &pose);
        // At this scale the marks are 15 px above the axis, and the camera is 600 px away: the shift is 15/600 of the
        // distance from the point below the camera.
        let expected = 0.025 * (at - Point2::new(320.0, 240.0));
        assert!((shift - expected).norm() < 1e-9, "{shift}");
    }
}
