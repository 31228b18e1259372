//! The marks of a person on a photo: the box, the grasp line, the outline.

use sdg_geometry::{BoundingBox, GraspLine, Polygon};

use crate::{Error, Result};

/// One object marked on one image, in pixels of that image: x right, y down, centre of the first pixel (0.5, 0.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// The object's name.
    pub label: String,
    /// The box around the object: as drawn, or the outline's bounding box if no box was drawn.
    pub bbox: BoundingBox,
    /// The two points of the grasp, if marked.
    pub grasp: Option<GraspLine>,
    /// Opening of the jaws where they close on the part, in pixels, if marked; otherwise it is measured from the
    /// outline or the box.
    pub jaw_width: Option<f64>,
    /// The outline, if drawn.
    pub outline: Option<Polygon>,
}

/// The image of an annotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageFacts<'a> {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// The image's path or file name, which selects the image in a COCO file of several images; the folders decide
    /// among images of the same name.
    pub file_name: Option<&'a str>,
}

impl ImageFacts<'_> {
    pub(crate) fn check_declared(&self, width: u32, height: u32) -> Result<()> {
        let (annotated, image) = ([width, height], [self.width, self.height]);
        if annotated == image { Ok(()) } else { Err(Error::OtherImageSize { annotated, image }) }
    }
}

impl Annotation {
    /// The outline, or the box if none was drawn.
    pub fn region(&self) -> Polygon {
        self.outline.clone().unwrap_or_else(|| Polygon::from_box(&self.bbox))
    }

    /// The tight box around all marks.
    pub fn extent(&self) -> BoundingBox {
        let outline = self.outline.iter().flat_map(|outline| outline.vertices.iter().copied());
        let ends = self.grasp.iter().flat_map(|grasp| [grasp.start, grasp.end]);
        let corners = self.bbox.corners().into_iter();
        BoundingBox::around(corners.chain(outline).chain(ends)).unwrap_or(self.bbox)
    }

    /// The grasp line, or an error with the reason why it is needed.
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

    /// Whether box, grasp and outline can belong to one part.
    ///
    /// # Errors
    /// [`Error::Contradictory`]: an outline with another bounding box, or a grasp line that does not touch the box.
    /// If there is no outline: a box that is the line's bounding box. If there is also no jaw width: a line whose
    /// middle is outside the box.
    pub fn check(&self) -> Result<()> {
        /// Minimum overlap (IoU) of the box and the outline's bounding box: a box with a margin of 40 % on each side
        /// has 0.31.
        const MIN_IOU: f64 = 0.3;
        /// Maximum distance in pixels of sides that count as equal, because files round coordinates.
        const ROUNDING_PX: f64 = 1.5;
        let contradictory = |expected, found| Err(Error::Contradictory { label: self.label.clone(), expected, found });
        let in_words = |bounds: &BoundingBox| {
            format!("({:.0}, {:.0}) to ({:.0}, {:.0})", bounds.x1, bounds.y1, bounds.x2, bounds.y2)
        };
        if let Some(outline) = self.outline.as_ref().filter(|outline| outline.bounds().iou(&self.bbox) < MIN_IOU) {
            let found = format!("the box {} and an outline {}", in_words(&self.bbox), in_words(&outline.bounds()));
            return contradictory("a box around the outline (x, y, width, height in COCO)", found);
        }
        let Some(GraspLine { start, end }) = self.grasp else {
            return Ok(());
        };
        let of_line = BoundingBox {
            x1: start.x.min(end.x),
            y1: start.y.min(end.y),
            x2: start.x.max(end.x),
            y2: start.y.max(end.y),
        };
        const STEPS: u32 = 64;
        let touches =
            (0..=STEPS).any(|i| self.bbox.contains(&(start + (end - start) * f64::from(i) / f64::from(STEPS))));
        if !touches {
            let found = format!("the grasp {} and the box {}", in_words(&of_line), in_words(&self.bbox));
            return contradictory("a grasp line that crosses the box", found);
        }
        // Without a jaw width, the opening is measured across the line's midpoint, which must therefore lie in the box.
        if self.outline.is_none() && self.jaw_width.is_none() && !self.bbox.contains(&nalgebra::center(&start, &end)) {
            let found = format!("the grasp {} and the box {}", in_words(&of_line), in_words(&self.bbox));
            return contradictory("a grasp line whose middle lies in the box", found);
        }
        let is_near = |a: f64, b: f64| (a - b).abs() <= ROUNDING_PX;
        let is_the_line_s = is_near(of_line.x1, self.bbox.x1)
            && is_near(of_line.y1, self.bbox.y1)
            && is_near(of_line.x2, self.bbox.x2)
            && is_near(of_line.y2, self.bbox.y2);
        if self.outline.is_none() && is_the_line_s {
            let found = format!("{}, the box of the two grasp points", in_words(&self.bbox));
            return contradictory("a box around the whole part", found);
        }
        Ok(())
    }

    /// The outline, or an error with the reason why it is needed.
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn marked(bbox: [f64; 4], grasp: [f64; 4], outline: Option<[f64; 4]>) -> Annotation {
        let of = |[x1, y1, x2, y2]: [f64; 4]| BoundingBox { x1, y1, x2, y2 };
        Annotation {
            label: "part".to_owned(),
            bbox: of(bbox),
            grasp: Some(GraspLine::new(Point2::new(grasp[0], grasp[1]), Point2::new(grasp[2], grasp[3]))),
            jaw_width: None,
            outline: outline.map(|outline| Polygon::from_box(&of(outline))),
        }
    }

    #[test]
    fn marks_that_cannot_be_of_one_part_are_refused() {
        const BOX: [f64; 4] = [100.0, 80.0, 220.0, 160.0];
        // Across a protrusion the line may begin and end outside.
        for grasp in [[180.0, 150.0, 200.0, 140.0], [90.0, 100.0, 140.0, 100.0], [200.0, 60.0, 200.0, 220.0]] {
            marked(BOX, grasp, None).check().unwrap();
            marked(BOX, grasp, Some([110.0, 90.0, 210.0, 150.0])).check().unwrap();
        }
        let refused = |marks: Annotation, part: &str| {
            let error = marks.check().unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused(marked(BOX, [30.0, 30.0, 60.0, 60.0], None), "a grasp line that crosses the box");
        refused(marked(BOX, [100.5, 160.0, 219.0, 80.0], None), "the box of the two grasp points");
        // The lower right corner was given in place of COCO's width and height.
        refused(marked([100.0, 80.0, 400.0, 280.0], [180.0, 150.0, 220.0, 140.0], Some(BOX)), "x, y, width, height");
    }
}
