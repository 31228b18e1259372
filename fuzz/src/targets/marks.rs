//! Files with marks on photos.

use std::sync::LazyLock;

use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts, LabelFile};

use super::bytes::file;
use super::written_marks::{check_written, check_written_instances};
use crate::target::Target;

const FORMATS: &str = "crates/demonstration/tests/formats";
/// Memory limit of a file of marks; the file and its content are small.
const MAX_EXTRA_BYTES: usize = 16 << 20;

/// The picture of the seeds.
const PICTURE: ImageFacts<'static> = ImageFacts { width: 640, height: 480, file_name: None };

/// Reads marks as those of a demonstration, and uses them as teaching and conversions do.
fn read(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts<'_>) -> bool {
    let Ok(annotations) = Annotation::read_with(bytes, beside, image) else { return false };
    for annotation in &annotations {
        let _ = (annotation.check(), annotation.require_grasp(), annotation.require_outline());
        if let Some(outline) = &annotation.outline {
            let _ = outline.rasterize(image.width, image.height);
        }
    }
    check_written(&annotations, image);
    true
}

/// Reads LabelMe or COCO as the marks of a demonstration, and as those of test pictures with the names in the file,
/// without a name, and with another name.
fn read_json(bytes: &[u8]) -> bool {
    let _ = (Annotation::passed_over(bytes, &PICTURE), AnnotationFormat::named_picture(bytes));
    let mut is_read = read(bytes, None, &PICTURE);
    let Ok(labels) = LabelFile::parse(bytes) else { return is_read };
    let _ = labels.picture_names();
    let declared = AnnotationFormat::declared_images(bytes).unwrap_or_default();
    let names = declared.iter().take(4).map(|image| image.file_name.as_deref());
    for file_name in names.chain([None, Some("folder/another.png")]) {
        let picture = ImageFacts { file_name, ..PICTURE };
        if let Ok(instances) = labels.instances(&picture) {
            check_written_instances(&instances, &picture);
            is_read = true;
        }
    }
    is_read
}

/// Three pictures, two of them with the same name; a part across the border, one that is optional, a crowd, and
/// keypoints of something else.
const PICTURES: &[u8] = br#"{"images":[{"id":1,"file_name":"cam_a/image.png","width":640,"height":480},
{"id":2,"file_name":"cam_b/image.png","width":640,"height":480},
{"id":"3","file_name":"another%20one.jpg","width":640,"height":480}],
"categories":[{"id":1,"name":"rod","keypoints":["grasp_start","grasp_end"]},{"id":2,"name":"face","keypoints":["nose"]}],
"annotations":[{"image_id":1,"category_id":1,"bbox":[100,80,200,120],"keypoints":[150,120,2,250,160,2],"iscrowd":0,
"attributes":{"jaw_width":42.5,"optional":true},"segmentation":[[110,90,290,95,200,190]]},
{"image_id":1,"category_id":1,"bbox":[-20,300,100,100]},
{"image_id":2,"category_id":1,"bbox":[],"segmentation":[[10,10,60,12,30,60]],"keypoints":[0,0,0,0,0,0]},
{"image_id":3,"category_id":2,"bbox":[5,5,50,50],"keypoints":[9,9,2]},
{"image_id":3.0,"category_id":1,"bbox":[100,5,50,50],"keypoints":[110,20,2,140,30,1]},
{"image_id":2,"iscrowd":1,"segmentation":{"counts":[1,2],"size":[2,2]}}]}"#;

/// An area that is no number, as Python writes it.
const AREA_OF_PYTHON: &[u8] = b"{\"images\": [{\"id\": 1, \"file_name\": \"a.png\"}], \"annotations\": \
    [{\"image_id\": 1, \"bbox\": [10, 20, 30.5, 40], \"area\": NaN}]}";

/// COCO, in the form that supervision writes.
pub(super) const COCO: Target = Target {
    name: "coco",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 5_000,
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
        vec![
            file("datasets/demonstrations/rod_end/annotation.json"),
            file(&format!("{FORMATS}/coco-supervision.json")),
            PICTURES.to_vec(),
            AREA_OF_PYTHON.to_vec(),
        ]
    },
    run: read_json,
};

/// Two parts on a test picture, one of them optional and one across the border, beside marks of other things.
const TEST_PICTURE: &[u8] = br#"{"imagePath":"..\\photos\\a%20b.png","imageWidth":640,"imageHeight":480,"shapes":[
{"label":"hole","shape_type":"circle","points":[[1,1],[2,2]],"group_id":9},
{"label":"hole","shape_type":"point","points":[[1,1]]},
{"label":"rod","shape_type":"rectangle","points":[[300,260],[100,80]],"group_id":1,"flags":{"optional":true}},
{"label":"grasp_start","shape_type":"point","points":[[150.5,120]],"group_id":1,"jaw_width":30},
{"label":"grasp_end","shape_type":"point","points":[[250,220]],"group_id":1},
{"label":"rod","points":[[110,90],[290,95],[200,250]],"group_id":1},
{"label":"rod","shape_type":"rectangle","points":[[600,10],[700,50]],"group_id":2}]}"#;

/// A box with a label that is nearly as long as a label may be.
fn long_label() -> Vec<u8> {
    let label = "x".repeat(990);
    format!("{{\"shapes\":[{{\"label\":\"{label}\",\"shape_type\":\"rectangle\",\"points\":[[10,10],[90,60]]}}]}}")
        .into()
}

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
    seeds: || {
        vec![
            file("datasets/demonstrations/pendulum/annotation.json"),
            file(&format!("{FORMATS}/labelme.json")),
            TEST_PICTURE.to_vec(),
            long_label(),
        ]
    },
    run: read_json,
};

const DATA: &[u8] = b"path: .\ntrain: images\nkpt_shape: [2, 3]\nnames:\n  0: part\n";
/// Keypoints without visibilities.
const DATA_OF_PAIRS: &[u8] = b"kpt_shape: [2, 2]\n";
const LINE: &[u8] = b"0 0.5 0.5 0.25 0.125 0.4 0.5 2 0.6 0.5 2\n";

/// Lines of YOLO-pose.
pub(super) const YOLO: Target = Target {
    name: "yolo",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b" 0.5", b"\n", b"\r\n", b" 2", b"-0.1 "],
    seeds: || {
        vec![
            LINE.to_vec(),
            file(&format!("{FORMATS}/yolo-pose.txt")),
            b"\xef\xbb\xbf# class x y w h\n0 0.5 0.5 0.25 0.5\r\n\n1 0.2 0.3 0.1 0.1 0 0 0 0 0 0\n".to_vec(),
            b"0 0.5 0.5 0.9 0.9 0.25 0.5 2 0.5 0.5 2 0.75 0.5 2\n".to_vec(),
            b"0 0.5 0.5 0.25 0.5 0.4 0.5 0.6 0.5\n".to_vec(),
        ]
    },
    run: |bytes| {
        read(bytes, Some(DATA), &PICTURE) | read(bytes, Some(DATA_OF_PAIRS), &PICTURE) | read(bytes, None, &PICTURE)
    },
};

/// The data.yaml of a YOLO dataset.
pub(super) const DATA_YAML: Target = Target {
    name: "data_yaml",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b"kpt_shape:", b"names:", b"&a ", b"*a", b"- ", b"!!str ", b"|\n", b"{", b"}", b": ", b"\n  "],
    seeds: || {
        vec![
            DATA.to_vec(),
            b"names: [part, other]\nkpt_shape:\n  - 2\n  - 3\n".to_vec(),
            b"\xef\xbb\xbfkpt_shape: [2, 3] # x y v\nkpt_names:\n  0:\n    - grasp_end\n    - grasp_start\nnc: 1\n"
                .to_vec(),
            b"kpt_names: ['grasp_start', \"grasp_end\"]\nnames: {0: 'it''s, a part',\n  1: \"a \\\"b\\\"\"} # two\n"
                .to_vec(),
            b"names:\n- rod end   # first\n- 'it''s # one'\nkpt_names: {0: [tail, head]}\n".to_vec(),
        ]
    },
    run: |bytes| read(LINE, Some(bytes), &PICTURE),
};

static OPENDR_FILES: LazyLock<[Vec<u8>; 2]> =
    LazyLock::new(|| ["boxes_train.npy", "kps_train.npy"].map(|name| file(&format!("{FORMATS}/{name}"))));

/// One of OpenDR's two arrays; the other one is unchanged.
pub(super) const OPENDR: Target = Target {
    name: "opendr",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b"\x93NUMPY", b"'<f8'", b"'<f4'", b"'>i8'", b"'|O'", b"'shape': (", b"True", b"\x01\x00v\x00"],
    seeds: || OPENDR_FILES.to_vec(),
    run: |bytes| {
        let [boxes, keypoints] = &*OPENDR_FILES;
        // A row belongs to the picture with its number.
        let picture = ImageFacts { file_name: Some("3.jpg"), ..PICTURE };
        read(bytes, Some(keypoints), &picture) | read(boxes, Some(bytes), &picture)
    },
};
