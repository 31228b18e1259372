//! The marks of a demonstration as a model keeps them.

use sdg_geometry::{BoundingBox, GraspLine, Polygon};
use serde::{Deserialize, Serialize};

/// The marks, in pixels of the kept cut-out.
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
    /// Width and height of the photo that the cut-out is from; `None` where it was resized since.
    #[serde(default)]
    pub photo_size: Option<[u32; 2]>,
}

impl TaughtMarks {
    /// The outline; the box where none was drawn.
    pub fn region(&self) -> Polygon {
        self.outline.clone().unwrap_or_else(|| Polygon::from_box(&self.bbox))
    }
}
