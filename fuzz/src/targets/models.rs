//! Weights and models.

use sdg_detection::RcnnConfig;
use sdg_grasp::{BaseWeightsFile, Device, GraspModel, summarize};
use sdg_weights_conversion::architecture::Backbone;
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Source};

use super::bytes::file;
use crate::target::Target;

const FIXTURES: &str = "weights-conversion/tests/fixtures";

fn safetensors() -> Vec<u8> {
    let header = br#"{"__metadata__":{"a":"b"},"conv1.weight":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]}}"#;
    [&(header.len() as u64).to_le_bytes(), header.as_slice(), &[1; 16]].concat()
}

/// Prefix of inputs that are the pickle of torch's zip; the zip is built around the pickle with correct checksums.
const IN_ZIP: &[u8] = b"in a zip:";
/// End of the pickle's name in the zip.
const PICKLE: &str = "data.pkl";

/// Names and bytes of the entries of torch's zip; the entries are not compressed.
fn entries_of_zip() -> Vec<(String, Vec<u8>)> {
    let whole = file(&format!("{FIXTURES}/tensors_zip.pth"));
    let number = |at: usize, size: usize| (0..size).fold(0, |sum, k| sum | usize::from(whole[at + k]) << (8 * k));
    let entries = whole.windows(4).enumerate().filter(|(_, bytes)| bytes == b"PK\x01\x02").map(|(at, _)| {
        let name = String::from_utf8_lossy(&whole[at + 46..at + 46 + number(at + 28, 2)]).into_owned();
        let header = number(at + 42, 4);
        let start = header + 30 + number(header + 26, 2) + number(header + 28, 2);
        (name, whole[start..start + number(at + 20, 4)].to_vec())
    });
    entries.collect()
}

/// Torch's zip with a different pickle and correct checksums.
fn zip_of(pickle: &[u8]) -> Vec<u8> {
    let mut entries = entries_of_zip();
    for (name, content) in &mut entries {
        if name.ends_with(PICKLE) {
            *content = pickle.to_vec();
        }
    }
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in &entries {
        let header_at = (zip.len() as u32).to_le_bytes();
        let name_length = (name.len() as u16).to_le_bytes();
        let size = (content.len() as u32).to_le_bytes();
        let sums = [crc32fast::hash(content).to_le_bytes(), size, size].concat();
        let header = [b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0", sums.as_slice(), &name_length, &[0; 2], name.as_bytes()];
        zip.extend([header.concat().as_slice(), content].concat());
        let fields = [b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0", sums.as_slice(), &name_length, &[0; 12], &header_at];
        directory.extend([fields.concat().as_slice(), name.as_bytes()].concat());
    }
    let count = (entries.len() as u16).to_le_bytes();
    let place = [(directory.len() as u32).to_le_bytes(), (zip.len() as u32).to_le_bytes()].concat();
    [zip.as_slice(), &directory, b"PK\x05\x06\0\0\0\0", &count, &count, &place, &[0; 2]].concat()
}

/// Pickles of one megabyte that repeat one operation, to find the operation that takes the most memory.
pub fn costliest_pickles() -> Vec<Vec<u8>> {
    let operations: [&[u8]; 9] =
        [b"]", b"}", b"N", b"(", b"\x8c\x00", b"\x8c\x01x\x94", b"K\x01\x85", b"N\x94", b"C\x00\x94"];
    let file =
        |operation: &&[u8]| [b"\x80\x04}", operation.repeat(1_000_000 / operation.len()).as_slice(), b"."].concat();
    operations.iter().map(file).collect()
}

/// Checkpoints: pickle, torch's zip and its older form, safetensors.
pub(super) const CHECKPOINT: Target = Target {
    name: "checkpoint",
    max_extra_bytes: 100_000_000,
    quick_executions: 5_000,
    dictionary: &[
        b"\x80\x02}",
        b"PK\x03\x04",
        b"PK\x01\x02",
        b"PK\x05\x06",
        b"cnumpy\n",
        b"\x8c\x05numpy",
        b"R",
        b"b.",
        b"q\x01",
        b"\"F32\"",
        b"\"shape\":[",
        b"\x85",
        b"\x86",
        b"\x87",
        b"\x8a\x08",
        b"\x93",
        b"\x94",
        b"\x95",
        b"\x96",
        b"(",
        b"]",
        b"}",
        b"N",
        b"K\x01",
    ],
    seeds: || {
        let names = [
            "arrays_protocol2.pkl",
            "arrays_protocol4.pkl",
            "arrays_protocol5.pkl",
            "arrays_python2.pkl",
            "tensors_zip.pth",
            "tensors_legacy.pth",
            "detectron2_keypoint.pkl",
        ];
        let mut seeds: Vec<_> = names.iter().map(|name| file(&format!("{FIXTURES}/{name}"))).collect();
        seeds.push(safetensors());
        seeds.extend(
            entries_of_zip()
                .into_iter()
                .filter(|(name, _)| name.ends_with(PICKLE))
                .map(|(_, pickle)| [IN_ZIP, &pickle].concat()),
        );
        seeds
    },
    run: |bytes| {
        let file = match bytes.strip_prefix(IN_ZIP) {
            Some(pickle) => zip_of(pickle),
            None => bytes.to_vec(),
        };
        let mut source = Source::from_bytes(file);
        let Ok(checkpoint) = Checkpoint::read(&mut source) else { return false };
        for tensor in checkpoint.tensors.values().filter(|tensor| tensor.len() < 1 << 20).take(8) {
            if let Ok(values) = tensor.values(&mut source) {
                assert_eq!(values.len(), tensor.len(), "a tensor's values and its shape");
            }
        }
        if let Ok(backbone) = Backbone::resnet(18) {
            let _ = Conversion::plan(&checkpoint, &Architecture { backbone, heads: None }, &[]);
        }
        true
    },
};

/// The header and the tensors of the model in the corpus.
fn model_parts() -> [Vec<u8>; 2] {
    let whole = file("fuzz/corpus/model_s.sdg");
    let length = u64::from_le_bytes(whole[..8].try_into().expect("eight bytes")) as usize;
    [whole[8..8 + length].to_vec(), whole[8 + length..].to_vec()]
}

/// A taught model without a network: its photo, marks and settings. An input that begins with `{` is a header; its
/// length and the tensors are added. Any other input is the whole file.
pub(super) const MODEL: Target = Target {
    name: "model",
    max_extra_bytes: 256 << 20,
    quick_executions: 500,
    dictionary: &[
        b"\"format\":",
        b"\"demonstrations\"",
        b"\"F32\"",
        b"\"shape\":[",
        b"\"data_offsets\":[",
        b"\\\"",
        b"{}",
        b"[]",
    ],
    seeds: || {
        let [header, _] = model_parts();
        vec![file("fuzz/corpus/model_s.sdg"), header.clone(), header]
    },
    run: |bytes| {
        let whole;
        let bytes = if bytes.first() == Some(&b'{') {
            let [_, tensors] = model_parts();
            whole = [&(bytes.len() as u64).to_le_bytes(), bytes, &tensors].concat();
            &whole
        } else {
            bytes
        };
        let _ = summarize(bytes);
        let _ = BaseWeightsFile::from_bytes(bytes);
        GraspModel::from_bytes(bytes, &Device::flex()).is_ok()
    },
};

/// The description of a detector.
pub(super) const DETECTOR_CONFIG: Target = Target {
    name: "detector_config",
    max_extra_bytes: 16 << 20,
    quick_executions: 20_000,
    dictionary: &[b"null", b"[]", b"{}", b"true", b"\"faster\"", b"\"keypoint\"", b"\"mask\"", b"\"torchvision\""],
    seeds: || {
        let changes = br#"{"kind":"keypoint","numerics":"detectron2","classes":3,"keypoints":5,"min_size_test":320,"max_size_test":640,
"stem_out_channels":16,"res2_out_channels":64,"width_per_group":16,"num_blocks":[1,1,1,1],"fpn_channels":32,"box_head_fc":64,"keypoint_convs":16}"#;
        vec![
            serde_json::to_vec(&sdg_detection::presets::edge(12)).unwrap_or_default(),
            changes.to_vec(),
            br#"{"kind":"mask","numerics":"torchvision","mask_convs":16}"#.to_vec(),
        ]
    },
    run: |bytes| std::str::from_utf8(bytes).is_ok_and(|text| RcnnConfig::from_json(text).is_ok()),
};
