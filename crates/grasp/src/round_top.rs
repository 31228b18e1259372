//! Where the marks of a part of revolution lie in a picture.
//!
//! The outline of a screw that lies on its side is seen at the height of its axis, its marks on its upper side: higher by the part's
//! own radius there. How far a camera sees them shifted follows from that; what surrounds them looks different in every roll and tells
//! nothing. Where the part lies in the same roll, edges on its upper side agree, too, and hold its pose higher than the outline; the
//! outline alone tells how much.

use nalgebra::{Point2, Vector2};
use sdg_geometry::PlanarSimilarity;
use sdg_shape::{GradientField, Revolution, ShapeSearch};

use crate::taught_marks::TaughtMarks;

/// The marks on the upper side of a part of revolution.
#[derive(Debug, Clone)]
pub(crate) struct RoundTop {
    /// How far above the axis they lie, in pixels of the cut-out.
    rise: f64,
    /// The middle of the photo, in pixels of the cut-out.
    photo_middle: Point2<f64>,
}

impl RoundTop {
    /// `marks` are in pixels of the photo that shows the axis.
    pub(crate) fn new(revolution: &Revolution, marks: &TaughtMarks) -> Self {
        let rise = revolution.radius_beside(&marks.grasp);
        Self { rise, photo_middle: marks.photo_middle.map_or(marks.grasp.center(), Point2::from) }
    }

    /// How far from the outline the camera sees the marks.
    ///
    /// # Units and frames
    /// Pixels of the picture, the focal length too; `below_camera` is the point of the table straight below the camera.
    fn shift(&self, focal_px: f64, below_camera: Point2<f64>, image_from_cutout: &PlanarSimilarity) -> Vector2<f64> {
        let nearer = self.rise * image_from_cutout.scale / focal_px;
        nearer * (image_from_cutout.apply(&self.photo_middle) - below_camera)
    }

    /// `image_from_cutout`, which all edges agree on, shifted to where the camera sees the marks.
    ///
    /// # Units and frames
    /// As for [`RoundTop::shift`]; `field` is of the picture.
    pub(crate) fn placed(
        &self,
        search: &ShapeSearch,
        field: &GradientField,
        (focal_px, below_camera): (f64, Point2<f64>),
        image_from_cutout: &PlanarSimilarity,
    ) -> PlanarSimilarity {
        let shift = self.shift(focal_px, below_camera, image_from_cutout);
        let outline = search.outline_beside(field, image_from_cutout, -shift);
        image_from_cutout.shifted((1.0 - outline) * shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_go_outwards_by_their_height_over_the_distance() {
        // Marks 12 px above the axis; the photo was taken with them below the camera.
        let top = RoundTop { rise: 12.0, photo_middle: Point2::new(40.0, 10.0) };
        let pose = PlanarSimilarity { tx: 460.0, ty: 90.0, scale: 1.25, ..PlanarSimilarity::IDENTITY };
        let at = pose.apply(&Point2::new(40.0, 10.0));
        let shift = top.shift(600.0, Point2::new(320.0, 240.0), &pose);
        // 15 px of 600 px, of the distance from below the camera.
        let expected = 0.025 * (at - Point2::new(320.0, 240.0));
        assert!((shift - expected).norm() < 1e-9, "{shift}");
    }
}
