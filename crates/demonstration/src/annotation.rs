//! What a person marked on a photo: the box, the grasp line, the outline.

use sdg_geometry::{BoundingBox, GraspLine, Polygon};

use crate::{Error, Result};

/// One object marked on one image, in pixels of that image: x right, y down, centre of the first pixel (0.5, 0.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// The object's name.
    pub label: String,
    /// The box around it: as drawn, or around the outline where none was drawn.
    pub bbox: BoundingBox,
    /// The two points of the grasp, if marked.
    pub grasp: Option<GraspLine>,
    /// How far apart the jaws are where they close on the part, in pixels, if marked; without it, the outline tells.
    pub jaw_width: Option<f64>,
    /// The outline, if drawn.
    pub outline: Option<Polygon>,
}

/// The image that an annotation is read for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageFacts<'a> {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// The image's file name, by which a COCO file of several images is searched; folders are ignored.
    pub file_name: Option<&'a str>,
}

impl ImageFacts<'_> {
    pub(crate) fn check_declared(&self, width: u32, height: u32) -> Result<()> {
        let (annotated, image) = ([width, height], [self.width, self.height]);
        if annotated == image { Ok(()) } else { Err(Error::OtherImageSize { annotated, image }) }
    }
}

impl Annotation {
    /// The outline, or the box where none was drawn.
    pub fn region(&self) -> Polygon {
        self.outline.clone().unwrap_or_else(|| Polygon::from_box(&self.bbox))
    }

    /// The grasp line, or an error that says who needs it.
    ///
    /// # Errors
    /// [`Error::Lacking`].
    pub fn require_grasp(&self) -> Result<&GraspLine> {
        self.grasp.as_ref().ok_or_else(|| Error::Lacking {
            label: self.label.clone(),
            missing: "the grasp",
            why: "mark two points, `grasp_start` and `grasp_end`; the gripper goes to their middle and closes across \
                  the line"
                .into(),
        })
    }

    /// The outline, or an error that says who needs it.
    ///
    /// # Errors
    /// [`Error::Lacking`].
    pub fn require_outline(&self) -> Result<&Polygon> {
        self.outline.as_ref().ok_or_else(|| Error::Lacking {
            label: self.label.clone(),
            missing: "the outline",
            why: "draw a polygon around the part; masks and the check of detections against the demonstration are \
                  made from it"
                .into(),
        })
    }
}
