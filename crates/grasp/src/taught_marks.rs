//! The marks of a demonstration as stored in a model.

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, GraspLine, Polygon};
use serde::{Deserialize, Serialize};

/// The marks, in pixels of the stored cut-out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaughtMarks {
    /// The object's name.
    pub label: String,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// The grasp.
    pub grasp: GraspLine,
    /// The outline, if it was drawn.
    pub outline: Option<Polygon>,
    /// The part's width between the jaws: as marked, or measured across the outline.
    pub width_px: f64,
    /// Width and height of the photo from which the cut-out comes; `None` for a resized cut-out and in a plan view.
    #[serde(default)]
    pub photo_size: Option<[u32; 2]>,
    /// The centre of that photo, in pixels of the cut-out; `None` in files of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photo_middle: Option<[f64; 2]>,
}

/// The box around a part and its grasp line.
pub(crate) fn extent(bbox: &BoundingBox, grasp: &GraspLine) -> BoundingBox {
    let GraspLine { start, end } = grasp;
    BoundingBox {
        x1: bbox.x1.min(start.x).min(end.x),
        y1: bbox.y1.min(start.y).min(end.y),
        x2: bbox.x2.max(start.x).max(end.x),
        y2: bbox.y2.max(start.y).max(end.y),
    }
}

/// Width and height resized by `factor`, in whole pixels.
pub(crate) fn whole_size(size: [u32; 2], factor: f64) -> [u32; 2] {
    size.map(|side| ((f64::from(side) * factor).round() as u32).max(1))
}

impl TaughtMarks {
    /// The outline; the box if none was drawn.
    pub fn region(&self) -> Polygon {
        self.outline.clone().unwrap_or_else(|| Polygon::from_box(&self.bbox))
    }

    /// The marks on the cut-out of width and height `from` resized to `to`: each axis is scaled like the pixels.
    pub(crate) fn resized(&self, from: [u32; 2], to: [u32; 2]) -> Self {
        let [across, down] = [0, 1].map(|axis| f64::from(to[axis]) / f64::from(from[axis]));
        let resize = |point: &Point2<f64>| Point2::new(across * point.x, down * point.y);
        let BoundingBox { x1, y1, x2, y2 } = self.bbox;
        Self {
            label: self.label.clone(),
            bbox: BoundingBox { x1: across * x1, y1: down * y1, x2: across * x2, y2: down * y2 },
            grasp: GraspLine::new(resize(&self.grasp.start), resize(&self.grasp.end)),
            outline: self.outline.as_ref().map(|outline| outline.scaled(across, down)),
            width_px: (across * down).sqrt() * self.width_px,
            photo_size: None,
            photo_middle: self.photo_middle.map(|[x, y]| [across * x, down * y]),
        }
    }
}
