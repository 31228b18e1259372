//! The data of one object collected by a reader, and the checks that make an [`Annotation`] of it.

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, GraspLine, Polygon};

use crate::annotation::{Annotation, ImageFacts};
use crate::{Error, Result};

/// A click that misses the image by at most this distance is moved to its edge; annotation tools allow such clicks.
const EDGE_TOLERANCE_PX: f64 = 1.0;
/// Boxes, grasp lines and outlines smaller than this were clicked by mistake.
const MIN_EXTENT_PX: f64 = 1.0;
/// More vertices than any person draws; limits the time for checking an outline.
const MAX_VERTICES: usize = 10_000;

/// Maximum length of a label in bytes. Each object has its own copy.
const MAX_LABEL_BYTES: usize = 1000;

/// The data of one object, each with its position in the file.
#[derive(Default)]
pub(crate) struct Draft {
    pub label: Option<String>,
    pub place: String,
    /// Corners of the box, two or more.
    pub corners: Option<(Vec<Point2<f64>>, String)>,
    pub grasp_start: Option<(Point2<f64>, String)>,
    pub grasp_end: Option<(Point2<f64>, String)>,
    pub jaw_width: Option<(f64, String)>,
    pub outline: Option<(Vec<Point2<f64>>, String)>,
}

/// Whether the picture's border may clip a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// A demonstration shows the whole part: marks outside the picture are errors.
    MustNotCut,
    /// On a test picture the part may extend beyond the border: its box is clipped, its outline left out.
    MayCut,
}

impl Draft {
    /// For files with positions in pixels: clips marks to the picture if necessary, then calls [`Self::finish`]. A
    /// grasp is never clipped: it must lie inside.
    pub fn finish_at(mut self, image: &ImageFacts, border: Border) -> Result<Annotation> {
        self.check_is_in_pixels(image)?;
        if border == Border::MustNotCut {
            return self.finish(image);
        }
        let (width, height) = (f64::from(image.width), f64::from(image.height));
        let is_inside = |p: &Point2<f64>| (0.0..=width).contains(&p.x) && (0.0..=height).contains(&p.y);
        if let Some((points, place)) = self.outline.take_if(|(points, _)| !points.iter().all(is_inside)) {
            self.corners.get_or_insert((points, place));
        }
        if let Some((corners, _)) = &mut self.corners
            && let Some(bbox) = BoundingBox::around(corners.iter().copied())
        {
            let cut = bbox.clip(width, height);
            // A box beside the picture is not clipped, so that it is refused with its position in the file.
            if cut.width() >= MIN_EXTENT_PX && cut.height() >= MIN_EXTENT_PX {
                *corners = cut.corners().to_vec();
            }
        }
        self.finish(image)
    }

    /// Checks that no mark is given in fractions of the image, which would be read as a position in its first pixel.
    pub fn check_is_in_pixels(&self, image: &ImageFacts) -> Result<()> {
        let line: Vec<Point2<f64>> = self.grasp_start.iter().chain(&self.grasp_end).map(|(point, _)| *point).collect();
        let line_place = self.grasp_start.as_ref().map(|(_, place)| place.clone()).unwrap_or_default();
        let marks = [self.corners.clone(), self.outline.clone(), Some((line, line_place))];
        for (points, place) in marks.into_iter().flatten() {
            let is_share = |value: f64| (0.0..=1.0).contains(&value);
            let has_shares = points.len() > 1 && points.iter().all(|point| is_share(point.x) && is_share(point.y));
            // Equal points are a double click.
            if has_shares && points[0] != points[1] {
                let [first, last] = [points[0], points[points.len() - 1]];
                return Err(Error::Malformed {
                    place,
                    expected: format!("pixels of the image of {}×{}", image.width, image.height),
                    found: format!(
                        "({}, {}) to ({}, {}), which seem to be in shares of its width and height",
                        first.x, first.y, last.x, last.y
                    ),
                });
            }
        }
        Ok(())
    }

    /// Checks everything and makes the annotation.
    pub fn finish(self, image: &ImageFacts) -> Result<Annotation> {
        let outline = self.outline.map(|(points, place)| check_outline(&points, &place, image)).transpose()?;
        let bbox = match self.corners {
            Some((corners, place)) => check_box(&corners, &place, image)?,
            None => outline.as_ref().map(Polygon::bounds).ok_or_else(|| Error::NoObject {
                expected: "a box (LabelMe: a `rectangle`; COCO: `bbox`) or an outline (a polygon)".into(),
                found: format!("neither at {}", self.place),
            })?,
        };
        let grasp = match (self.grasp_start, self.grasp_end) {
            (Some((start, start_place)), Some((end, end_place))) => {
                let line = GraspLine::new(inside(start, &start_place, image)?, inside(end, &end_place, image)?);
                if line.length() < MIN_EXTENT_PX {
                    return Err(Error::ZeroSize {
                        place: end_place,
                        expected: format!("grasp points at least {MIN_EXTENT_PX} pixel apart"),
                        found: format!("{:.3} pixels", line.length()),
                    });
                }
                Some(line)
            }
            (None, None) => None,
            (start, _) => {
                let (has, lacks) =
                    if start.is_some() { ("grasp_start", "grasp_end") } else { ("grasp_end", "grasp_start") };
                return Err(Error::Malformed {
                    place: self.place,
                    expected: "both `grasp_start` and `grasp_end`".into(),
                    found: format!("`{has}` without `{lacks}`"),
                });
            }
        };
        let jaw_width = self.jaw_width.map(|(width, place)| check_jaw_width(width, place, image)).transpose()?;
        let label = self.label.filter(|label| !label.is_empty()).unwrap_or_else(|| "object".into());
        if label.len() > MAX_LABEL_BYTES {
            return Err(Error::Malformed {
                place: self.place,
                expected: format!("a label of at most {MAX_LABEL_BYTES} bytes"),
                found: format!("{} bytes", label.len()),
            });
        }
        Ok(Annotation { label, bbox, grasp, jaw_width, outline })
    }
}

/// The point, moved to the edge if it misses the image by no more than the tolerance.
fn inside(point: Point2<f64>, place: &str, image: &ImageFacts) -> Result<Point2<f64>> {
    if let Some(found) = [point.x, point.y].into_iter().find(|value| !value.is_finite()) {
        return Err(Error::NotFinite { place: place.into(), found: found.to_string() });
    }
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let kept = Point2::new(point.x.clamp(0.0, width), point.y.clamp(0.0, height));
    let missed_by = (kept.x - point.x).abs().max((kept.y - point.y).abs());
    if missed_by <= EDGE_TOLERANCE_PX {
        Ok(kept)
    } else {
        Err(Error::OutsideImage { place: place.into(), x: point.x, y: point.y, image: [image.width, image.height] })
    }
}

fn check_box(corners: &[Point2<f64>], place: &str, image: &ImageFacts) -> Result<BoundingBox> {
    let corners = corners.iter().map(|&corner| inside(corner, place, image)).collect::<Result<Vec<_>>>()?;
    BoundingBox::around(corners)
        .filter(|bbox| bbox.width() >= MIN_EXTENT_PX && bbox.height() >= MIN_EXTENT_PX)
        .ok_or_else(|| Error::ZeroSize {
            place: place.into(),
            expected: "a box of at least 1×1 pixels".into(),
            found: "one without width or height".into(),
        })
}

/// No part is wider than the image's diagonal.
fn check_jaw_width(width: f64, place: String, image: &ImageFacts) -> Result<f64> {
    if !width.is_finite() {
        return Err(Error::NotFinite { place, found: width.to_string() });
    }
    let most = f64::from(image.width).hypot(f64::from(image.height));
    if (MIN_EXTENT_PX..=most).contains(&width) {
        Ok(width)
    } else {
        Err(Error::Malformed {
            place,
            expected: format!("jaws {MIN_EXTENT_PX} to {most:.0} pixels apart"),
            found: width.to_string(),
        })
    }
}

fn check_outline(points: &[Point2<f64>], place: &str, image: &ImageFacts) -> Result<Polygon> {
    let mut vertices = points.iter().map(|&point| inside(point, place, image)).collect::<Result<Vec<_>>>()?;
    // Tools repeat the first vertex at the end, and double clicks repeat other vertices.
    vertices.dedup();
    if vertices.len() > 1 && vertices.first() == vertices.last() {
        vertices.pop();
    }
    if vertices.len() < 3 || vertices.len() > MAX_VERTICES {
        return Err(Error::Malformed {
            place: place.into(),
            expected: format!("a polygon of 3 to {MAX_VERTICES} distinct points"),
            found: vertices.len().to_string(),
        });
    }
    let polygon = Polygon { vertices };
    if polygon.crosses_itself() {
        return Err(Error::SelfCrossing { place: place.into() });
    }
    if polygon.area() < MIN_EXTENT_PX * MIN_EXTENT_PX {
        return Err(Error::ZeroSize {
            place: place.into(),
            expected: "an outline of at least 1 square pixel".into(),
            found: format!("{:.3} square pixels", polygon.area()),
        });
    }
    Ok(polygon)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    fn draft(outline: &[(f64, f64)]) -> Draft {
        let points = outline.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        Draft { outline: Some((points, "here".into())), ..Draft::default() }
    }

    #[test]
    fn a_missing_box_is_taken_from_the_outline() {
        let made = draft(&[(10.0, 20.0), (50.0, 25.0), (30.0, 70.0)]).finish(&IMAGE).unwrap();
        assert_eq!(made.bbox, BoundingBox { x1: 10.0, y1: 20.0, x2: 50.0, y2: 70.0 });
    }

    #[test]
    fn an_outline_of_too_many_points_is_refused() {
        let circle = |count: usize| {
            let turn = std::f64::consts::TAU / count as f64;
            let points: Vec<_> = (0..count).map(|idx| (turn * idx as f64).sin_cos()).collect();
            draft(&points.iter().map(|(sin, cos)| (320.0 + 200.0 * cos, 240.0 + 200.0 * sin)).collect::<Vec<_>>())
        };
        assert!(circle(1000).finish(&IMAGE).is_ok());
        let refused = circle(MAX_VERTICES + 1).finish(&IMAGE).unwrap_err().to_string();
        assert!(refused.contains("a polygon of 3 to 10000 distinct points") && refused.contains("10001"), "{refused}");
    }

    #[test]
    fn a_label_of_too_many_bytes_is_refused() {
        let of_label = |count: usize| {
            let part = draft(&[(10.0, 20.0), (50.0, 25.0), (30.0, 70.0)]);
            Draft { label: Some("é".repeat(count)), place: "there".into(), ..part }.finish(&IMAGE)
        };
        assert!(of_label(MAX_LABEL_BYTES / 2).is_ok());
        let refused = of_label(MAX_LABEL_BYTES / 2 + 1).unwrap_err().to_string();
        assert!(refused.contains("there") && refused.contains("1002 bytes"), "{refused}");
    }

    #[test]
    fn shares_of_the_image_are_told() {
        let outline = draft(&[(0.1, 0.2), (0.5, 0.25), (0.3, 0.7)]);
        let grasp = Draft {
            grasp_start: Some((Point2::new(0.2, 0.3), "there".into())),
            grasp_end: Some((Point2::new(0.4, 0.3), "there".into())),
            ..draft(&[(10.0, 20.0), (50.0, 25.0), (30.0, 70.0)])
        };
        for (shares, place) in [(outline, "here"), (grasp, "there")] {
            let told = shares.check_is_in_pixels(&IMAGE).unwrap_err().to_string();
            assert!(told.contains(place) && told.contains("shares of its width and height"), "{told}");
        }
        draft(&[(0.0, 0.0), (1.0, 3.0), (3.0, 1.0)]).check_is_in_pixels(&IMAGE).unwrap();
    }

    #[test]
    fn clicks_just_outside_are_moved_to_the_edge() {
        let made = draft(&[(-0.8, 20.0), (50.0, 480.9), (640.5, 70.0)]).finish(&IMAGE).unwrap();
        assert_eq!(made.bbox, BoundingBox { x1: 0.0, y1: 20.0, x2: 640.0, y2: 480.0 });
        let found = draft(&[(-1.2, 20.0), (50.0, 25.0), (30.0, 70.0)]).finish(&IMAGE).unwrap_err();
        assert_eq!(found, Error::OutsideImage { place: "here".into(), x: -1.2, y: 20.0, image: [640, 480] });
    }

    #[test]
    fn closing_vertex_is_dropped() {
        let made = draft(&[(1.0, 1.0), (9.0, 1.0), (9.0, 1.0), (5.0, 9.0), (1.0, 1.0)]).finish(&IMAGE).unwrap();
        assert_eq!(made.outline.unwrap().vertices.len(), 3);
    }

    #[test]
    fn lacking_parts_are_named() {
        let made = draft(&[(10.0, 20.0), (50.0, 25.0), (30.0, 70.0)]).finish(&IMAGE).unwrap();
        let message = made.require_grasp().unwrap_err().to_string();
        assert!(message.contains("grasp_start") && message.contains("`object`"), "{message}");
        assert!(made.require_outline().is_ok());
        let no_outline = Annotation { outline: None, ..made };
        assert!(no_outline.require_outline().unwrap_err().to_string().contains("polygon"));
    }
}
