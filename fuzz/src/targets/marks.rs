//! Files with marks on photos.

use sdg_demonstration::{Annotation, ImageFacts, LabelFile};

use super::bytes::file;
use crate::target::Target;

const FORMATS: &str = "crates/demonstration/tests/formats";
/// Memory limit of a file of marks; the file and its content are small.
const MAX_EXTRA_BYTES: usize = 16 << 20;

/// The picture of the seeds.
const PICTURE: ImageFacts<'static> = ImageFacts { width: 640, height: 480, file_name: None };

fn read(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts<'_>) -> bool {
    let Ok(annotations) = Annotation::read_with(bytes, beside, image) else { return false };
    for annotation in &annotations {
        // Teaching uses the outline in this way.
        if let Some(outline) = &annotation.outline {
            let _ = outline.rasterize(image.width, image.height);
        }
    }
    true
}

/// COCO, in the form that supervision writes.
pub(super) const COCO: Target = Target {
    name: "coco",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"\"segmentation\"",
        b"\"counts\"",
        b"\"size\"",
        b"\"keypoints\"",
        b"\"bbox\"",
        b"\"iscrowd\":1",
        b"{}",
        b"[]",
        b"\\u0000",
    ],
    seeds: || {
        vec![file("datasets/demonstrations/rod_end/annotation.json"), file(&format!("{FORMATS}/coco-supervision.json"))]
    },
    run: |bytes| {
        let labels = LabelFile::parse(bytes);
        let names = labels.as_ref().ok().and_then(|labels| labels.picture_names().ok());
        for name in names.iter().flatten().take(8) {
            let picture = ImageFacts { file_name: Some(name), ..PICTURE };
            let _ = labels.as_ref().map(|labels| labels.instances(&picture));
        }
        let _ = Annotation::passed_over(bytes, &PICTURE);
        read(bytes, None, &PICTURE)
    },
};

/// LabelMe.
pub(super) const LABELME: Target = Target {
    name: "labelme",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"\"rectangle\"",
        b"\"polygon\"",
        b"\"point\"",
        b"\"circle\"",
        b"\"group_id\"",
        b"\"grasp_start\"",
        b"\"imageData\"",
        b"[]",
    ],
    seeds: || vec![file("datasets/demonstrations/pendulum/annotation.json"), file(&format!("{FORMATS}/labelme.json"))],
    run: |bytes| {
        let _ = LabelFile::parse(bytes).map(|labels| labels.picture_names());
        read(bytes, None, &PICTURE)
    },
};

const DATA: &[u8] = b"path: .\ntrain: images\nkpt_shape: [2, 3]\nnames:\n  0: part\n";

/// A line of YOLO-pose.
pub(super) const YOLO: Target = Target {
    name: "yolo",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b" 0.5", b"\n", b"\r\n", b" 2", b"-0.1 "],
    seeds: || {
        let line = b"0 0.5 0.5 0.25 0.125 0.4 0.5 2 0.6 0.5 2\n";
        vec![line.to_vec(), file(&format!("{FORMATS}/yolo-pose.txt"))]
    },
    run: |bytes| read(bytes, Some(DATA), &PICTURE) | read(bytes, None, &PICTURE),
};

/// The data.yaml of a YOLO dataset.
pub(super) const DATA_YAML: Target = Target {
    name: "data_yaml",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b"kpt_shape:", b"names:", b"&a ", b"*a", b"- ", b"!!str ", b"|\n", b"{", b"}", b": ", b"\n  "],
    seeds: || vec![DATA.to_vec(), b"names: [part, other]\nkpt_shape:\n  - 2\n  - 3\n".to_vec()],
    run: |bytes| read(b"0 0.5 0.5 0.25 0.125 0.4 0.5 2 0.6 0.5 2\n", Some(bytes), &PICTURE),
};

/// One of OpenDR's two arrays; the other one is unchanged.
pub(super) const OPENDR: Target = Target {
    name: "opendr",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b"\x93NUMPY", b"'<f8'", b"'<f4'", b"'>i8'", b"'|O'", b"'shape': (", b"True", b"\x01\x00v\x00"],
    seeds: || vec![file(&format!("{FORMATS}/boxes_train.npy")), file(&format!("{FORMATS}/kps_train.npy"))],
    run: |bytes| {
        let [boxes, keypoints] = ["boxes_train.npy", "kps_train.npy"].map(|name| file(&format!("{FORMATS}/{name}")));
        // A row belongs to the picture with its number.
        let picture = ImageFacts { file_name: Some("3.jpg"), ..PICTURE };
        read(bytes, Some(&keypoints), &picture) | read(&boxes, Some(bytes), &picture)
    },
};
