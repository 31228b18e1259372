//! Reads files written by other tools. `formats/make.py` documents how they were made, and with which versions.

use nalgebra::Point2;
use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts};

const LABELME: &[u8] = include_bytes!("formats/labelme.json");
const YOLO_POSE: &[u8] = include_bytes!("formats/yolo-pose.txt");
const COCO: &[u8] = include_bytes!("formats/coco-supervision.json");
const OPENDR_BOXES: &[u8] = include_bytes!("formats/boxes_train.npy");
const OPENDR_KEYPOINTS: &[u8] = include_bytes!("formats/kps_train.npy");
/// The annotation from which all these files were made.
const ORIGINAL: &[u8] = include_bytes!("../../../datasets/demonstrations/fuel_line/annotation.json");

/// Ultralytics writes fractions of the image with six digits: an error of up to 640 · 5e-7 pixels in a position, and of
/// half of that from the box's width.
const YOLO_ROUNDING_PX: f64 = 7e-4;

fn facts(file_name: &str) -> ImageFacts<'_> {
    ImageFacts { width: 640, height: 480, file_name: Some(file_name) }
}

fn original() -> Annotation {
    Annotation::read(ORIGINAL, &facts("image.png")).unwrap().remove(0)
}

#[test]
fn labelme_s_own_file_says_the_same_as_ours() {
    assert_eq!(AnnotationFormat::of(LABELME), Ok(AnnotationFormat::LabelMe));
    assert_eq!(Annotation::read(LABELME, &facts("image.png")).unwrap(), [original()]);
}

#[test]
fn ultralytics_labels_say_the_same_but_for_their_digits() {
    assert_eq!(AnnotationFormat::of(YOLO_POSE), Ok(AnnotationFormat::YoloPose));
    let [found] = <[Annotation; 1]>::try_from(Annotation::read(YOLO_POSE, &facts("image.png")).unwrap()).unwrap();
    let expected = original();
    for (a, b) in found.bbox.corners().iter().zip(expected.bbox.corners()) {
        assert!((a - b).norm() < YOLO_ROUNDING_PX, "{a} for {b}");
    }
    let (found, expected) = (found.grasp.unwrap(), expected.grasp.unwrap());
    assert!((found.start - expected.start).norm() < YOLO_ROUNDING_PX, "{}", found.start);
    assert!((found.end - expected.end).norm() < YOLO_ROUNDING_PX, "{}", found.end);
}

#[test]
fn a_coco_file_of_another_tool_has_box_and_outline() {
    assert_eq!(AnnotationFormat::of(COCO), Ok(AnnotationFormat::Coco));
    let found = Annotation::read(COCO, &facts("image.png")).unwrap().remove(0);
    let expected = original();
    assert_eq!((found.label.as_str(), found.bbox), ("fuel_line", expected.bbox));
    assert_eq!(found.grasp, None);
    let mask = |annotation: &Annotation| annotation.outline.as_ref().unwrap().rasterize(640, 480);
    // The file stores the outline of whole pixels without their lower right edges; the part is ten pixels wide.
    let overlap = mask(&found).iou(&mask(&expected));
    assert!(overlap > 0.75, "{overlap}");
}

#[test]
fn opendr_s_rows_are_turned_copies_of_the_part() {
    assert_eq!(AnnotationFormat::of(OPENDR_BOXES), Ok(AnnotationFormat::OpenDr));
    let expected = original().grasp.unwrap();
    for (row, turn) in (0..360).step_by(60).enumerate() {
        let name = format!("{row}.jpg");
        let found = Annotation::read_with(OPENDR_BOXES, Some(OPENDR_KEYPOINTS), &facts(&name)).unwrap().remove(0);
        // As make.py rotates, enlarges and moves the part.
        let (sin, cos) = f64::from(turn).to_radians().sin_cos();
        let placed = |p: Point2<f64>| {
            let (x, y) = (p.x - 320.0, p.y - 240.0);
            Point2::new(1.3 * (cos * x - sin * y) + 340.0, 1.3 * (sin * x + cos * y) + 230.0)
        };
        let grasp = found.grasp.unwrap();
        // The arrays hold 32-bit numbers.
        assert!((grasp.start - placed(expected.start)).norm() < 1e-3, "{row}: {}", grasp.start);
        assert!((grasp.end - placed(expected.end)).norm() < 1e-3, "{row}: {}", grasp.end);
        assert!(found.bbox.contains(&grasp.center()), "{row}");
    }
}

#[test]
fn what_one_format_holds_comes_back_from_every_other() {
    let image = facts("image.png");
    let marked = vec![original()];
    for format in [AnnotationFormat::Coco, AnnotationFormat::LabelMe] {
        let written = format.write(&image, &marked).unwrap();
        assert_eq!(written.left_out, Vec::<String>::new());
        assert_eq!(Annotation::read(written.text.as_bytes(), &image).unwrap(), marked, "{}", format.name());
    }
    let yolo = AnnotationFormat::YoloPose.write(&image, &marked).unwrap();
    assert_eq!(yolo.left_out.len(), 1, "the outline: {:?}", yolo.left_out);
    let read =
        Annotation::read_with(yolo.text.as_bytes(), yolo.data_yaml.as_deref().map(str::as_bytes), &image).unwrap();
    assert_eq!((read[0].label.as_str(), read[0].outline.is_some()), ("fuel_line", false));
    let again = AnnotationFormat::YoloPose.write(&image, &read).unwrap();
    assert_eq!(again.left_out, Vec::<String>::new());
    assert!(
        AnnotationFormat::OpenDr.write(&image, &marked).unwrap_err().to_string().contains("coco, labelme or yolo-pose")
    );
}

#[test]
fn damaged_files_end_in_an_error_or_in_what_can_be_marked() {
    // Four files, truncated at each byte, and with each byte replaced by others: no panic, and never a box outside the
    // image.
    let files: [(&[u8], Option<&[u8]>); 4] = [
        (YOLO_POSE, None),
        (OPENDR_BOXES, Some(OPENDR_KEYPOINTS)),
        (OPENDR_KEYPOINTS, Some(OPENDR_BOXES)),
        (LABELME, None),
    ];
    for (file, beside) in files {
        for at in 0..file.len() {
            let _ = Annotation::read_with(&file[..at], beside, &facts("3.jpg"));
            for byte in [0u8, b'9', b'-', b'n', 0xff] {
                let mut damaged = file.to_vec();
                damaged[at] = byte;
                for found in Annotation::read_with(&damaged, beside, &facts("3.jpg")).into_iter().flatten() {
                    let b = found.bbox;
                    assert!(b.x1 >= 0.0 && b.y1 >= 0.0 && b.x2 <= 640.0 && b.y2 <= 480.0 && b.area() > 0.0, "{b:?}");
                }
            }
        }
    }
}
