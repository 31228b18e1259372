//! The marks of a demonstration as stored in a model.

use sdg_geometry::{BoundingBox, GraspLine, Polygon};
use serde::{Deserialize, Serialize};

use crate::sizes::scaling;

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

impl TaughtMarks {
    /// The outline; the box if none was drawn.
    pub fn region(&self) -> Polygon {
        self.outline.clone().unwrap_or_else(|| Polygon::from_box(&self.bbox))
    }

    /// The marks on the cut-out resized by `factor`.
    pub(crate) fn resized(&self, factor: f64) -> Self {
        let resize = scaling(factor);
        let BoundingBox { x1, y1, x2, y2 } = self.bbox;
        Self {
            label: self.label.clone(),
            bbox: BoundingBox { x1: factor * x1, y1: factor * y1, x2: factor * x2, y2: factor * y2 },
            grasp: self.grasp.transformed(&resize),
            outline: self.outline.as_ref().map(|outline| outline.transformed(&resize)),
            width_px: factor * self.width_px,
            photo_size: None,
            photo_middle: self.photo_middle.map(|middle| middle.map(|at| factor * at)),
        }
    }
}
