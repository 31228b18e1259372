//! Marks that were read are written in every format and read again.
//!
//! Not compared: marks so small that rounding moves them below a limit of the reader, or into the first pixel, where the
//! reader takes positions for shares of the picture.

use nalgebra::Point2;
use sdg_demonstration::{Annotation, AnnotationFormat, CocoFile, ImageFacts, LabelFile, LabelledInstance};
use sdg_geometry::BoundingBox;

/// Minimum length in pixels of compared marks: a line within one pixel is at most 1.42 pixels long.
const MIN_COMPARED_PX: f64 = 1.5;
/// Largest change of a position by decimal text and by shares of the picture, in pixels.
const ROUNDING_PX: f64 = 1e-6;

/// Writes the marks of a picture, and compares them with the marks that are read from the text.
pub(super) fn check_written(marked: &[Annotation], image: &ImageFacts<'_>) {
    for format in AnnotationFormat::ALL {
        let Ok(written) = format.write(image, marked) else {
            assert_eq!(format, AnnotationFormat::OpenDr, "the only format that is not written");
            continue;
        };
        if !marked.iter().all(is_compared) {
            continue;
        }
        let beside = written.data_yaml.as_deref().map(str::as_bytes);
        let again = Annotation::read_with(written.text.as_bytes(), beside, image)
            .unwrap_or_else(|error| panic!("expected written marks to be read as {}: {error}", format.name()));
        assert_eq!(again.len(), marked.len(), "objects as {}", format.name());
        for (expected, found) in marked.iter().zip(&again) {
            assert_same(format, expected, found);
        }
    }
}

/// Writes the instances of a test picture as COCO, and compares them with the instances that are read from the text.
pub(super) fn check_written_instances(instances: &[LabelledInstance], image: &ImageFacts<'_>) {
    let mut file = CocoFile::new();
    file.push_labelled("a.png", image.width, image.height, instances);
    let text = file.to_json();
    if !instances.iter().all(|instance| is_compared(&instance.annotation)) {
        return;
    }
    let again = LabelFile::parse(text.as_bytes()).and_then(|labels| labels.instances(image));
    let again = again.unwrap_or_else(|error| panic!("expected written instances to be read: {error}"));
    assert_eq!(again.len(), instances.len(), "instances");
    for (expected, found) in instances.iter().zip(&again) {
        assert_eq!(found.optional, expected.optional);
        assert_same(AnnotationFormat::Coco, &expected.annotation, &found.annotation);
    }
}

fn is_compared(marked: &Annotation) -> bool {
    let is_large = |bounds: &BoundingBox| bounds.width().min(bounds.height()) > MIN_COMPARED_PX;
    is_large(&marked.bbox)
        && marked.grasp.is_none_or(|line| line.length() > MIN_COMPARED_PX)
        && marked.outline.as_ref().is_none_or(|outline| is_large(&outline.bounds()) && outline.area() > MIN_COMPARED_PX)
}

fn assert_same(format: AnnotationFormat, expected: &Annotation, found: &Annotation) {
    let has_outlines = format != AnnotationFormat::YoloPose;
    let positions = |marked: &Annotation| -> Vec<Point2<f64>> {
        let line = marked.grasp.iter().flat_map(|line| [line.start, line.end]);
        let outline = marked.outline.iter().filter(|_| has_outlines).flat_map(|outline| outline.vertices.clone());
        marked.bbox.corners().into_iter().chain(line).chain(outline).collect()
    };
    let (label, jaw_width) = match format {
        // LabelMe's labels have no blanks around them, and jaws belong to its point `grasp_start`.
        AnnotationFormat::LabelMe => {
            let label = Some(expected.label.trim()).filter(|label| !label.is_empty()).unwrap_or("object");
            (label.to_owned(), expected.jaw_width.filter(|_| expected.grasp.is_some()))
        }
        // Names in data.yaml have one line.
        AnnotationFormat::YoloPose => (expected.label.replace(['\n', '\r'], " "), None),
        AnnotationFormat::Coco | AnnotationFormat::OpenDr => (expected.label.clone(), expected.jaw_width),
    };
    let [before, after] = [expected, found].map(positions);
    let is_same = found.label == label
        && found.grasp.is_some() == expected.grasp.is_some()
        && before.len() == after.len()
        && before.iter().zip(&after).all(|(one, other)| (one - other).norm() <= ROUNDING_PX)
        && match (found.jaw_width, jaw_width) {
            (Some(found), Some(expected)) => (found - expected).abs() <= ROUNDING_PX,
            (found, expected) => found.is_none() && expected.is_none(),
        };
    assert!(is_same, "{}: expected {expected:?}, found {found:?}", format.name());
}
