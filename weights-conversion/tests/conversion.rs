//! Complete conversions: Detectron2's own pickles (reduced), torchvision's class order, input and
//! output files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use sdg_weights_conversion::architecture::{Backbone, Background, Block, Heads, KeypointHead, MaskHead, Norm};
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Precision, Source, sha256_of};
use sha2::{Digest, Sha256};

use crate::forged::{array, cat, text};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// The architecture of the two fixtures, an eighth of the width of those in tests/golden/detectron2.
fn narrow(num_classes: usize) -> Architecture {
    Architecture {
        backbone: Backbone {
            stem_channels: 2,
            res2_channels: 4,
            num_blocks: [3, 4, 6, 3],
            block: Block::Bottleneck { inner_channels: 1 },
            norm: Norm::Stored,
        },
        heads: Some(Heads {
            fpn_channels: 4,
            fpn_norm: Norm::None,
            num_anchors: 3,
            box_pooled_size: 7,
            fc_channels: 8,
            num_classes,
            background: Background::Last,
            class_specific_boxes: true,
            keypoint: None,
            mask: None,
        }),
    }
}

fn narrow_keypoint() -> Architecture {
    let mut architecture = narrow(1);
    let keypoint = KeypointHead { conv_channels: vec![4; 8], num_keypoints: 12 };
    architecture.heads.as_mut().unwrap().keypoint = Some(keypoint);
    architecture
}

fn narrow_mask() -> Architecture {
    let mut architecture = narrow(2);
    architecture.heads.as_mut().unwrap().mask =
        Some(MaskHead { conv_channels: vec![4; 4], deconv_channels: 4, num_masks: 2 });
    architecture
}

fn planned(path: &Path, target: &Architecture, reinitialized: &[&str]) -> (Source, Checkpoint, Conversion) {
    let mut source = Source::open(path).unwrap();
    let checkpoint = Checkpoint::read(&mut source).unwrap();
    let parts: Vec<String> = reinitialized.iter().map(|part| (*part).to_owned()).collect();
    let conversion = Conversion::plan(&checkpoint, target, &parts).unwrap();
    (source, checkpoint, conversion)
}

fn convert(path: &Path, target: &Architecture, out: &Path, precision: Precision) -> Checkpoint {
    let (mut source, checkpoint, conversion) = planned(path, target, &[]);
    let extra = BTreeMap::from([("preset".to_owned(), "narrow".to_owned())]);
    conversion.write(&checkpoint, &mut source, [path, out], precision, &extra).unwrap();
    Checkpoint::read(&mut Source::open(out).unwrap()).unwrap()
}

fn sha256(values: &[f32]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn every_value_of_detectron2_s_files_arrives_under_its_name() {
    let digests: BTreeMap<String, BTreeMap<String, String>> =
        serde_json::from_slice(&fs::read(fixture("detectron2_digests.json")).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (kind, target) in [("keypoint", narrow_keypoint()), ("mask", narrow_mask())] {
        let file = fixture(&format!("detectron2_{kind}.pkl"));
        let (_, _, conversion) = planned(&file, &target, &[]);
        assert_eq!(conversion.report().applied.len(), target.parameters().len());
        assert_eq!(conversion.report().unused, [""; 0]);
        assert_eq!(conversion.report().not_needed, ["proposal_generator.anchor_generator.cell_anchors.0"]);

        let out = folder.path().join(format!("{kind}.safetensors"));
        let converted = convert(&file, &target, &out, Precision::F32);
        let mut source = Source::open(&out).unwrap();
        for applied in &conversion.report().applied {
            let values = converted.tensors[&applied.name].values(&mut source).unwrap();
            assert!(sha256(&values).starts_with(&digests[kind][&applied.from]), "{}", applied.from);
        }
        let report = &converted.metadata;
        assert_eq!(report["source_sha256"], sha256_of(&file).unwrap());
        assert_eq!(report["source_file"], format!("detectron2_{kind}.pkl"));
        assert_eq!(report["source_format"], "pickle of numpy arrays");
        assert!(report["licence_note"].contains("CC BY-SA 3.0"));
        assert_eq!((&*report["source_author"], &*report["preset"]), ("golden", "narrow"));
    }
}

#[test]
fn torchvision_s_backbone_in_detectron2_s_names_has_torchvision_s_licence() {
    let folder = tempfile::tempdir().unwrap();
    let [from, out] = ["torchvision.pkl", "out.safetensors"].map(|name| folder.path().join(name));
    let author = cat(&[&text("__author__"), &text("torchvision")]);
    let stem = cat(&[&text("stem.conv1.weight"), &array(&[2, 3, 7, 7], "f4", "<", &[0; 4 * 2 * 3 * 7 * 7])]);
    fs::write(&from, cat(&[b"\x80\x04}(", &author, &stem, b"u."])).unwrap();
    let target = Architecture { backbone: narrow(1).backbone, heads: None };
    let others = ["stem.conv1.norm", "res2", "res3", "res4", "res5"].map(|part| format!("backbone.bottom_up.{part}"));
    let (mut source, checkpoint, conversion) = planned(&from, &target, &others.each_ref().map(String::as_str));
    conversion.write(&checkpoint, &mut source, [&from, &out], Precision::F32, &BTreeMap::new()).unwrap();
    let written = Checkpoint::read(&mut Source::open(&out).unwrap()).unwrap();
    assert!(written.metadata["licence_note"].contains("torchvision's code"), "{:?}", written.metadata);
}

#[test]
fn half_precision_rounds_kernels_and_leaves_vectors() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("half.safetensors");
    let file = fixture("detectron2_keypoint.pkl");
    let half = convert(&file, &narrow_keypoint(), &out, Precision::F16);
    let mut half_source = Source::open(&out).unwrap();
    let (mut source, checkpoint, conversion) = planned(&file, &narrow_keypoint(), &[]);
    for applied in &conversion.report().applied {
        let exact = checkpoint.tensors[&applied.from].values(&mut source).unwrap();
        let rounded = half.tensors[&applied.name].values(&mut half_source).unwrap();
        // Half precision has 11 binary digits, and 2⁻²⁴ is its smallest positive number.
        let tolerance = |value: f32| if applied.shape.len() < 2 { 0.0 } else { value.abs() / 2048.0 + 3e-8 };
        assert!(exact.iter().zip(&rounded).all(|(e, r)| (e - r).abs() <= tolerance(*e)), "{}", applied.name);
    }
    // A converted file can be converted again: the names are now ours, and the metadata still describe the first file.
    let again = folder.path().join("again.safetensors");
    let twice = convert(&out, &narrow_keypoint(), &again, Precision::F16);
    let source = ["source_names", "source_author"].map(|key| &*twice.metadata[key]);
    assert_eq!(source, ["Detectron2", "golden"]);
    assert_eq!(twice.metadata["licence_note"], half.metadata["licence_note"]);
    assert_eq!(twice.tensors.len(), half.tensors.len());
}

#[test]
fn a_part_that_does_not_fit_must_be_named() {
    // A detector of three classes from one of one class.
    let mut target = narrow_keypoint();
    target.heads.as_mut().unwrap().num_classes = 3;
    let file = fixture("detectron2_keypoint.pkl");
    let (mut source, checkpoint, conversion) = planned(&file, &target, &[]);
    let mismatched: Vec<_> = conversion.report().mismatched.iter().map(ToString::to_string).collect();
    assert_eq!(mismatched.len(), 4);
    assert!(mismatched[0].starts_with("roi_heads.box_predictor.bbox_pred.bias: expected [12], found [4]"));

    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.safetensors");
    let refused = conversion.write(&checkpoint, &mut source, [&file, &out], Precision::F32, &BTreeMap::new());
    assert!(refused.unwrap_err().to_string().contains("--reinit roi_heads.box_predictor"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");

    let (mut source, checkpoint, conversion) = planned(&file, &target, &["roi_heads.box_predictor"]);
    conversion.write(&checkpoint, &mut source, [&file, &out], Precision::F32, &BTreeMap::new()).unwrap();
    let written = Checkpoint::read(&mut Source::open(&out).unwrap()).unwrap();
    assert!(!written.tensors.contains_key("roi_heads.box_predictor.cls_score.weight"));
    assert_eq!(written.metadata["reinitialized"].split(' ').count(), 4);
    assert_eq!(
        conversion.report().summary(),
        "{} applied, 0 missing, 0 mismatched, 0 unused, 4 re-initialised"
            .replace("{}", &conversion.report().applied.len().to_string())
    );
}

#[test]
fn what_the_file_lacks_is_missing() {
    let mut target = narrow_keypoint();
    target.heads.as_mut().unwrap().mask = narrow_mask().heads.unwrap().mask;
    let (_, _, conversion) = planned(&fixture("detectron2_keypoint.pkl"), &target, &[]);
    assert_eq!(conversion.report().missing.len(), 12);
    assert!(conversion.report().to_string().contains("missing     roi_heads.mask_head.deconv.bias\n"));
    // The reverse: an unused head remains, which is not an error.
    let (_, _, conversion) = planned(&fixture("detectron2_keypoint.pkl"), &narrow(1), &[]);
    assert_eq!(conversion.report().unused.len(), 18);
    conversion.complete().unwrap();
}

/// Writes a safetensors file of f32 tensors.
fn write_tensors(path: &Path, tensors: &BTreeMap<String, (Vec<usize>, Vec<f32>)>) {
    let mut entries = serde_json::Map::new();
    let mut data = Vec::new();
    for (name, (shape, values)) in tensors {
        let start = data.len();
        data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        let entry = serde_json::json!({"dtype": "F32", "shape": shape, "data_offsets": [start, data.len()]});
        entries.insert(name.clone(), entry);
    }
    let header = serde_json::Value::Object(entries).to_string();
    fs::write(path, [&(header.len() as u64).to_le_bytes(), header.as_bytes(), &data].concat()).unwrap();
}

#[test]
fn torchvision_s_background_moves_behind_the_classes() {
    let folder = tempfile::tempdir().unwrap();
    let [from, last, first] = ["torchvision", "last", "first"].map(|name| folder.path().join(name));
    // Two classes and the background: each row of the predictors contains the index of its class.
    let classes = |rows_a_class: usize, width: usize| -> (Vec<usize>, Vec<f32>) {
        let rows = 3 * rows_a_class;
        let values = (0..rows * width).map(|i| (i / width / rows_a_class) as f32).collect();
        (vec![rows, width], values)
    };
    let biases = |(shape, values): (Vec<usize>, Vec<f32>)| (vec![shape[0]], values);
    let theirs = BTreeMap::from([
        ("rpn.head.conv.weight".to_owned(), (vec![1], vec![0.0])),
        ("roi_heads.box_predictor.cls_score.weight".to_owned(), classes(1, 8)),
        ("roi_heads.box_predictor.cls_score.bias".to_owned(), biases(classes(1, 1))),
        ("roi_heads.box_predictor.bbox_pred.weight".to_owned(), classes(4, 8)),
        ("roi_heads.box_predictor.bbox_pred.bias".to_owned(), biases(classes(4, 1))),
        ("roi_heads.mask_predictor.mask_fcn_logits.bias".to_owned(), biases(classes(1, 1))),
    ]);
    write_tensors(&from, &theirs);
    let others = ["backbone", "proposal_generator", "roi_heads.box_head", "roi_heads.mask_head.mask_fcn"];
    let parts = [&others[..], &["roi_heads.mask_head.deconv", "roi_heads.mask_head.predictor.weight"]].concat();
    let read = |target: &Architecture, out: &Path| {
        let (mut source, checkpoint, conversion) = planned(&from, target, &parts);
        conversion.write(&checkpoint, &mut source, [&from, out], Precision::F32, &BTreeMap::new()).unwrap();
        let mut source = Source::open(out).unwrap();
        let written = Checkpoint::read(&mut source).unwrap();
        let names = ["box_predictor.cls_score.bias", "box_predictor.bbox_pred.bias", "mask_head.predictor.bias"];
        let weight = written.tensors["roi_heads.box_predictor.cls_score.weight"].values(&mut source).unwrap();
        let biases = names.map(|n| written.tensors[&format!("roi_heads.{n}")].values(&mut source).unwrap());
        (weight, biases)
    };
    let (weight, [scores, deltas, masks]) = read(&narrow_mask(), &last);
    assert_eq!(scores, [1.0, 2.0, 0.0]);
    assert_eq!(weight, [[1.0; 8], [2.0; 8], [0.0; 8]].concat());
    assert_eq!(deltas, [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
    assert_eq!(masks, [1.0, 2.0]);

    let mut background_first = narrow_mask();
    let heads = background_first.heads.as_mut().unwrap();
    heads.background = Background::First;
    heads.mask.as_mut().unwrap().num_masks = 3;
    let (_, [scores, deltas, masks]) = read(&background_first, &first);
    assert_eq!((scores, deltas.len(), masks), (vec![0.0, 1.0, 2.0], 12, vec![0.0, 1.0, 2.0]));
}

#[test]
fn values_that_weights_cannot_have_end_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let [from, out] = ["backbone.safetensors", "out.safetensors"].map(|name| folder.path().join(name));
    let target = Architecture { backbone: narrow(1).backbone, heads: None };
    let mut ours: BTreeMap<_, _> = target
        .parameters()
        .into_iter()
        .map(|(name, shape)| (name, (shape.clone(), vec![0.5; shape.iter().product()])))
        .collect();
    for (value, precision, expected) in [
        (f32::NAN, Precision::F32, "found NaN"),
        (f32::INFINITY, Precision::F32, "found inf"),
        (70_000.0, Precision::F16, "up to 65504"),
    ] {
        ours.get_mut("backbone.bottom_up.res2.0.conv2.weight").unwrap().1[4] = value;
        write_tensors(&from, &ours);
        let (mut source, checkpoint, conversion) = planned(&from, &target, &[]);
        let refused = conversion.write(&checkpoint, &mut source, [&from, &out], precision, &BTreeMap::new());
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains(expected) && refused.contains("res2.0.conv2.weight"), "{refused}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
