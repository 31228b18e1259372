//! Grasp models, base weights, and descriptions of detectors.

use std::borrow::Cow;
use std::sync::LazyLock;

use sdg_detection::RcnnConfig;
use sdg_grasp::{BaseWeightsFile, DetectionRecord, Device, GraspModel, ModelKind, Verification, summarize};

use super::model_files::{ModelFile, joined, searched_photo, small_detector};
use crate::target::Target;

/// Files in the order of the numbers before the headers among the inputs. Those with networks come last.
static FILES: LazyLock<Vec<ModelFile>> = LazyLock::new(|| {
    let networks = [ModelKind::A, ModelKind::C, ModelKind::D].map(ModelFile::with_network);
    let others = [ModelFile::plain(), ModelFile::full(), ModelFile::base_weights()];
    others.into_iter().chain(networks).collect()
});

/// The bytes of a file. An input of a number and `{` is the header of that file of [`FILES`]; its length and the tensors
/// are added. Any other input is a whole file.
fn file_of(input: &[u8]) -> Cow<'_, [u8]> {
    if let [number, header @ ..] = input
        && header.starts_with(b"{")
        && let Some(file) = FILES.get(usize::from(number.wrapping_sub(b'0')))
    {
        return joined(header, &file.tensors).into();
    }
    input.into()
}

/// A taught model, with or without a network, and base weights.
pub(super) const MODEL: Target = Target {
    name: "model",
    max_extra_bytes: 256 << 20,
    quick_executions: 1_000,
    dictionary: &[
        b"\"format\":",
        b"\"demonstrations\"",
        b"\"F16\"",
        b"\"F32\"",
        b"\"shape\":[",
        b"\"data_offsets\":[",
        b"\"model\":\"B\"",
        b"\\\"",
        b"{}",
        b"[]",
    ],
    seeds: || {
        // Most mistakes in a header with networks are in the names of tensors, which are read after the photos have been
        // prepared for a search: milliseconds. The other files are therefore more frequent.
        let numbers: [usize; 11] = [0, 0, 0, 0, 1, 1, 2, 2, 3, 4, 5];
        let headers = numbers.map(|number| [number.to_string().as_bytes(), &FILES[number].header].concat());
        headers.into_iter().chain([FILES[0].whole(), FILES[2].whole()]).collect()
    },
    run: |input| {
        let file = file_of(input);
        let bytes = &*file;
        let _ = summarize(bytes);
        let base_weights = BaseWeightsFile::from_bytes(bytes);
        if let Ok(base_weights) = &base_weights {
            use_base_weights(base_weights);
        }
        let model = GraspModel::from_bytes(bytes, &Device::flex());
        if let Ok(model) = &model {
            use_model(model, crc32fast::hash(input));
        }
        base_weights.is_ok() || model.is_ok()
    },
};

/// Writes base weights, and takes those of a network.
fn use_base_weights(weights: &BaseWeightsFile) {
    // Half precision was rounded once, and values that are not finite are refused.
    let again = BaseWeightsFile::from_bytes(&weights.to_bytes());
    assert!(again.is_ok_and(|again| again == *weights), "expected written base weights to be read unchanged");
    let _ = BaseWeightsFile::is_described_by(&weights.origin);
    let _ = weights.for_network("edge", &small_detector(), String::new());
}

/// Writes a model. Of four models one is read again, and of 32 without a network one searches a picture, because both
/// take milliseconds; `choice` decides.
fn use_model(model: &GraspModel, choice: u32) {
    let written = model.to_bytes().expect("a model that was read can be written");
    if choice.is_multiple_of(4) {
        // Long decimals may change by a unit in the last place, so that the two models need not be equal.
        let again = GraspModel::from_bytes(&written, &Device::flex()).expect("a model that was written can be read");
        let facts = |model: &GraspModel| (model.kind(), model.object().to_owned(), model.demonstrations().len());
        assert_eq!(facts(&again), facts(model));
    }
    // A network may be described with maps of gigabytes.
    if choice % 32 == 1 && model.kind() == ModelKind::S {
        for found in model.detect(&searched_photo(), Verification::ByShape).into_iter().flatten() {
            let _ = (found.turn_source.name(), serde_json::to_string(&DetectionRecord::new(&found, ModelKind::S)));
        }
    }
}

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
