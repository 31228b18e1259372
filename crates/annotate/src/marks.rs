//! Marks as exchanged between page and server: box, grasp and outline are each optional.

use nalgebra::{Point2, Vector2};
use sdg_demonstration::{Annotation, CocoFile, ImageFacts};
use sdg_geometry::{BoundingBox, GraspLine, Polygon};
use serde::{Deserialize, Serialize};

use crate::teacher::FoundGrasp;

/// The marks on one picture, in its pixels: x right, y down, centre of the first pixel (0.5, 0.5).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marks {
    /// `[x1, y1, x2, y2]`.
    #[serde(rename = "box", default)]
    pub bbox: Option<[f64; 4]>,
    /// Where the gripper closes.
    #[serde(default)]
    pub grasp: Option<GraspMarks>,
    /// The part's outline.
    #[serde(default)]
    pub outline: Option<Vec<[f64; 2]>>,
}

/// The marked gripper: the line along which its jaws extend, and the distance between the jaws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspMarks {
    /// `grasp_start`.
    pub start: [f64; 2],
    /// `grasp_end`.
    pub end: [f64; 2],
    /// Distance between the jaws, across the line, in pixels.
    pub jaw_width: f64,
}

impl GraspMarks {
    /// The grasp line through both marks.
    pub fn line(&self) -> GraspLine {
        GraspLine::new(Point2::from(self.start), Point2::from(self.end))
    }
}

impl Marks {
    /// The marks of an annotation. A grasp without a jaw width (other tools have none) gets the default of teaching.
    pub fn of(annotation: &Annotation) -> Self {
        let BoundingBox { x1, y1, x2, y2 } = annotation.bbox;
        let grasp = annotation.grasp.map(|line| {
            let fitting = || line.opening_across(&annotation.region());
            GraspMarks {
                start: line.start.into(),
                end: line.end.into(),
                jaw_width: annotation.jaw_width.unwrap_or_else(fitting),
            }
        });
        let outline = annotation.outline.as_ref().map(|o| o.vertices.iter().map(|&v| v.into()).collect());
        Self { bbox: Some([x1, y1, x2, y2]), grasp, outline }
    }

    /// A detected grasp as marks for correction, clipped to a picture of `size`.
    pub fn of_found(found: &FoundGrasp, size: [u32; 2]) -> Self {
        let [width, height] = size.map(f64::from);
        let BoundingBox { x1, y1, x2, y2 } = found.bbox.clip(width, height);
        let (sin, cos) = found.grasp.angle.radians().sin_cos();
        let center = found.grasp.center();
        // At the picture's border the line is shortened on both sides, so that its middle stays.
        let inside = |along: f64| {
            let end = center + Vector2::new(cos, sin) * along;
            (0.0..=width).contains(&end.x) && (0.0..=height).contains(&end.y)
        };
        let mut half = 0.5 * found.line_length;
        while half > 1.0 && !(inside(half) && inside(-half)) {
            half *= 0.9;
        }
        let along = Vector2::new(cos, sin) * half;
        let outline = found.outline.as_ref().map(|outline| outline.clip(width, height).vertices);
        Self {
            bbox: Some([x1, y1, x2, y2]),
            grasp: Some(GraspMarks {
                start: (center - along).into(),
                end: (center + along).into(),
                jaw_width: found.grasp.width,
            }),
            outline: outline.filter(|v| v.len() >= 3).map(|v| v.into_iter().map(Into::into).collect()),
        }
    }

    /// The box, if marked.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        self.bbox.map(|[x1, y1, x2, y2]| BoundingBox { x1, y1, x2, y2 })
    }

    /// The outline, if drawn.
    pub fn polygon(&self) -> Option<Polygon> {
        self.outline.as_ref().map(|vertices| Polygon { vertices: vertices.iter().map(|&v| Point2::from(v)).collect() })
    }

    /// The part's region: its outline, or its box.
    pub fn region(&self) -> Option<Polygon> {
        self.polygon().or_else(|| self.bounding_box().map(|bbox| Polygon::from_box(&bbox)))
    }

    /// The COCO file with these marks and the object's name; without box and outline, the file of a picture without
    /// objects. Reading the file back validates the marks.
    ///
    /// # Errors
    /// Marks outside the picture or of zero size; an outline that crosses itself.
    pub fn to_coco(&self, label: &str, image: &ImageFacts) -> sdg_demonstration::Result<String> {
        let mut file = CocoFile::new();
        let file_name = image.file_name.unwrap_or_default();
        let outline = self.polygon();
        let Some(bbox) = self.bounding_box().or_else(|| outline.as_ref().map(Polygon::bounds)) else {
            file.push_image(file_name, image.width, image.height, &[]);
            return Ok(file.to_json());
        };
        let annotation = Annotation {
            label: label.to_owned(),
            bbox,
            grasp: self.grasp.map(|grasp| grasp.line()),
            jaw_width: self.grasp.map(|grasp| grasp.jaw_width),
            outline,
        };
        file.push_image(file_name, image.width, image.height, &[annotation]);
        let text = file.to_json();
        Annotation::read(text.as_bytes(), image)?;
        Ok(text)
    }

    /// Whether the marks suffice for an object in a file.
    pub fn has_object(&self) -> bool {
        self.bbox.is_some() || self.outline.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::{Angle, PlanarGrasp};

    const IMAGE: ImageFacts = ImageFacts { width: 200, height: 100, file_name: Some("a.png") };

    fn marks() -> Marks {
        Marks {
            bbox: Some([10.0, 20.0, 110.0, 60.0]),
            grasp: Some(GraspMarks { start: [40.0, 40.0], end: [80.0, 40.0], jaw_width: 44.0 }),
            outline: Some(vec![[10.0, 20.0], [110.0, 20.0], [110.0, 60.0], [10.0, 60.0]]),
        }
    }

    #[test]
    fn what_is_written_comes_back() {
        let text = marks().to_coco("bar", &IMAGE).unwrap();
        let read = Annotation::read(text.as_bytes(), &IMAGE).unwrap().remove(0);
        assert_eq!(read.label, "bar");
        assert_eq!(Marks::of(&read), marks());
    }

    #[test]
    fn a_line_of_another_tool_gets_the_jaws_that_are_taught() {
        let text = marks().to_coco("bar", &IMAGE).unwrap();
        let mut read = Annotation::read(text.as_bytes(), &IMAGE).unwrap().remove(0);
        read.jaw_width = None;
        assert!((Marks::of(&read).grasp.unwrap().jaw_width - 40.0).abs() < 1e-9);
        // A lug beside the middle, but under the jaws: the opening is measured at the middle.
        let lugged = [
            [10.0, 20.0],
            [70.0, 20.0],
            [70.0, 0.0],
            [75.0, 0.0],
            [75.0, 20.0],
            [110.0, 20.0],
            [110.0, 60.0],
            [10.0, 60.0],
        ];
        read.outline = Some(Polygon { vertices: lugged.map(Point2::from).to_vec() });
        let opening = Marks::of(&read).grasp.unwrap().jaw_width;
        assert!((opening - 40.0).abs() < 1e-9, "{opening}");
    }

    #[test]
    fn marks_that_cannot_be_taught_are_refused() {
        let crossing = Marks { outline: Some(vec![[10.0, 10.0], [50.0, 50.0], [50.0, 10.0], [10.0, 50.0]]), ..marks() };
        assert!(crossing.to_coco("bar", &IMAGE).unwrap_err().to_string().contains("does not cross itself"));
        let outside = Marks { bbox: Some([10.0, 20.0, 500.0, 60.0]), ..marks() };
        assert!(outside.to_coco("bar", &IMAGE).unwrap_err().to_string().contains("inside the image of 200×100"));
        let closed =
            Marks { grasp: Some(GraspMarks { start: [40.0, 40.0], end: [80.0, 40.0], jaw_width: -1.0 }), ..marks() };
        assert!(closed.to_coco("bar", &IMAGE).unwrap_err().to_string().contains("jaws"));
    }

    #[test]
    fn nothing_marked_is_a_picture_without_objects() {
        let text = Marks::default().to_coco("bar", &IMAGE).unwrap();
        assert!(text.contains("\"annotations\": []"), "{text}");
    }

    #[test]
    fn a_found_grasp_at_the_border_stays_inside_with_its_middle() {
        let found = FoundGrasp {
            score: 0.9,
            is_accepted: true,
            bbox: BoundingBox { x1: -5.0, y1: 20.0, x2: 60.0, y2: 60.0 },
            outline: None,
            grasp: PlanarGrasp { x: 10.0, y: 40.0, angle: Angle::ZERO, width: 30.0 },
            line_length: 40.0,
            pose: None,
            refusal: None,
            touches: Vec::new(),
        };
        let marks = Marks::of_found(&found, [200, 100]);
        let line = marks.grasp.unwrap().line();
        assert!(line.start.x >= 0.0 && (line.center() - Point2::new(10.0, 40.0)).norm() < 1e-9);
        assert_eq!(marks.bbox.unwrap()[0], 0.0);
        assert!(marks.to_coco("bar", &IMAGE).is_ok());
    }
}
