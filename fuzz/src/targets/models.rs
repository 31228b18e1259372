//! Weights and models.

use sdg_detection::RcnnConfig;
use sdg_grasp::{BaseWeightsFile, Device, GraspModel, summarize};
use sdg_weights_conversion::architecture::Backbone;
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Source};

use super::file;
use crate::target::Target;

const FIXTURES: &str = "weights-conversion/tests/fixtures";

fn safetensors() -> Vec<u8> {
    let header = br#"{"__metadata__":{"a":"b"},"conv1.weight":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]}}"#;
    [&(header.len() as u64).to_le_bytes(), header.as_slice(), &[1; 16]].concat()
}

/// Checkpoints: pickle, torch's zip and its older form, safetensors.
pub(super) const CHECKPOINT: Target = Target {
    name: "checkpoint",
    max_extra_bytes: 100_000_000,
    quick_executions: 20_000,
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
    ],
    seeds: || {
        let names = [
            "arrays_protocol2.pkl",
            "arrays_protocol4.pkl",
            "arrays_python2.pkl",
            "tensors_zip.pth",
            "tensors_legacy.pth",
        ];
        let mut seeds: Vec<_> = names.iter().map(|name| file(&format!("{FIXTURES}/{name}"))).collect();
        seeds.push(safetensors());
        seeds
    },
    run: |bytes| {
        let mut source = Source::from_bytes(bytes.to_vec());
        let Ok(checkpoint) = Checkpoint::read(&mut source) else { return false };
        for tensor in checkpoint.tensors.values().filter(|tensor| tensor.len() < 1 << 20).take(8) {
            let _ = tensor.values(&mut source);
        }
        if let Ok(backbone) = Backbone::resnet(18) {
            let _ = Conversion::plan(&checkpoint, &Architecture { backbone, heads: None }, &[]);
        }
        true
    },
};

/// The shipped model as its header and its tensors.
fn model_parts() -> [Vec<u8>; 2] {
    let whole = file("fuzz/corpus/model_s.sdg");
    let length = u64::from_le_bytes(whole[..8].try_into().expect("eight bytes")) as usize;
    [whole[8..8 + length].to_vec(), whole[8 + length..].to_vec()]
}

/// A taught model, without a network: its photo, marks and settings. An input that begins with `{` is a header, which gets the length and
/// the tensors that belong to it; another is the whole file.
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

/// A detector's description.
pub(super) const DETECTOR_CONFIG: Target = Target {
    name: "detector_config",
    max_extra_bytes: 16 << 20,
    quick_executions: 20_000,
    dictionary: &[b"null", b"[]", b"{}", b"true"],
    seeds: || vec![serde_json::to_vec(&sdg_detection::presets::edge(12)).unwrap_or_default()],
    run: |bytes| std::str::from_utf8(bytes).is_ok_and(|text| RcnnConfig::from_json(text).is_ok()),
};
