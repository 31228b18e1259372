//! Model files for seeds: a small photo, and networks of two channels, so that reading takes little time.

use std::collections::BTreeMap;
use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use sdg_comparison::ComparisonConfig;
use sdg_detection::RcnnConfig;
use sdg_detection::config::{NormKind, ResizeRule};
use sdg_detection::presets::{RcnnKind, edge_of};
use sdg_grasp::{Device, FORMAT_VERSION, ModelKind, NUM_KEYPOINTS};
use sdg_layers::state_dict::{self, StateDict, WeightTensor};
use sdg_orientation::{AngleClasses, OrientationConfig, Readout};
use serde_json::{Map, Value, json};

/// Metadata of a safetensors file.
type Metadata = BTreeMap<&'static str, String>;

/// A safetensors file in two pieces.
pub(super) struct ModelFile {
    /// JSON.
    pub(super) header: Vec<u8>,
    pub(super) tensors: Vec<u8>,
}

/// The file of a header and tensors.
pub(super) fn joined(header: &[u8], tensors: &[u8]) -> Vec<u8> {
    let length = header.len().next_multiple_of(8);
    let mut file = [&(length as u64).to_le_bytes(), header].concat();
    file.resize(8 + length, b' ');
    file.extend_from_slice(tensors);
    file
}

impl ModelFile {
    /// A file with these weights by name, as zeros, and photos.
    fn new(metadata: &Metadata, weights: &StateDict, photos: &[RgbImage]) -> Self {
        let mut header = Map::from_iter([("__metadata__".to_owned(), json!(metadata))]);
        let mut tensors = Vec::new();
        let mut put = |name: String, dtype: &str, shape: &[usize], bytes: &[u8]| {
            let start = tensors.len();
            tensors.extend_from_slice(bytes);
            let offsets = [start, tensors.len()];
            header.insert(name, json!({"dtype": dtype, "shape": shape, "data_offsets": offsets}));
        };
        for (name, WeightTensor { shape, values }) in weights {
            put(name.clone(), "F16", shape, &vec![0; 2 * values.len()]);
        }
        for (number, photo) in photos.iter().enumerate() {
            let mut png = Cursor::new(Vec::new());
            photo.write_to(&mut png, ImageFormat::Png).expect("a picture is encoded");
            let png = png.into_inner();
            put(format!("demonstrations.{number}.cutout"), "U8", &[png.len()], &png);
        }
        Self { header: Value::Object(header).to_string().into_bytes(), tensors }
    }

    /// The file.
    pub(super) fn whole(&self) -> Vec<u8> {
        joined(&self.header, &self.tensors)
    }

    /// A model without a network, taught from one photo.
    pub(super) fn plain() -> Self {
        // The narrow range of sizes saves time.
        let teaching = json!({"seed": 1, "size_tolerance": [0.95, 1.05], "samples": 0, "steps": 0, "seconds": 0.5,
            "base_weights_sha256": null});
        Self::new(&metadata(ModelKind::S, &[marks("bar", true)], &teaching), &StateDict::new(), &[photo(Light::Even)])
    }

    /// A model without a network and with everything else that a header may hold.
    pub(super) fn full() -> Self {
        let teaching = json!({
            "seed": 7,
            "symmetry": {"fold": 2},
            "size_tolerance": [0.9, 1.1],
            "lengths": {
                "pixels_per_m": 1000.0,
                "mark_height_m": 0.02,
                "grasp_height_m": 0.01,
                "slant": [0.1, -0.05],
                "further_slants": [[0.0, 0.2]],
                "edges": {"height_m": -0.003, "sigma_m": 0.002},
            },
            "region": {"x": 10, "y": 20, "width": 500, "height": 400, "picture": [640, 480]},
            "samples": 20,
            "steps": 10,
            "seconds": 0.5,
            "validation_hit_rate": 0.9,
            "validation_error_px": 0.8,
            "validation_error_degrees": 0.7,
            "orientation": {"crops": 30, "steps": 5, "hit_rate": 0.8, "error_degrees": 1.5},
            "negatives": {"pictures": 3, "refused": 2, "log_odds": -0.25},
            "base_weights_sha256": "0".repeat(64),
        });
        let marks = [marks("a \"round\" bar\n", true), marks("", false)];
        let photos = [photo(Light::AsOnARoundBody), photo(Light::Even)];
        Self::new(&metadata(ModelKind::S, &marks, &teaching), &StateDict::new(), &photos)
    }

    /// A model with the network of its kind; model C also has a comparison network and a region.
    pub(super) fn with_network(kind: ModelKind) -> Self {
        let mut teaching = json!({"seed": 1, "size_tolerance": [0.95, 1.05], "samples": 20, "steps": 10, "seconds": 0.5,
            "validation_hit_rate": 0.9, "validation_error_px": 0.8, "validation_error_degrees": 0.7,
            "base_weights_sha256": null});
        let detector = detector(kind);
        let mut weights = prefixed("network", weights_of(&detector));
        let mut further = vec![("input_size", json!(detector.input.resize)), ("network", json!(detector))];
        if kind == ModelKind::A {
            let config = orientation();
            let network = config.init_blank(&Device::flex()).expect("a small orientation CNN");
            weights.extend(prefixed("orientation", network.state_dict()));
            further.push(("orientation", json!(config)));
        }
        if kind == ModelKind::C {
            let config = comparison();
            let network = config.init_blank(&Device::flex()).expect("a small comparison network");
            weights.extend(prefixed("comparison", state_dict::export(&network)));
            further.push(("comparison", json!(config)));
            teaching["region"] = json!({"x": 0, "y": 0, "width": 600, "height": 400, "picture": [640, 480]});
        }
        let mut metadata = metadata(kind, &[marks("bar", true)], &teaching);
        metadata.extend(further.into_iter().map(|(key, value)| (key, value.to_string())));
        Self::new(&metadata, &weights, &[photo(Light::AsOnARoundBody)])
    }

    /// Base weights for the networks of [`small_detector`].
    pub(super) fn base_weights() -> Self {
        let metadata = BTreeMap::from([
            ("format", "sdg base weights 1".to_owned()),
            ("preset", "edge".to_owned()),
            ("reinitialized", json!(["roi_heads.box_predictor.cls_score.weight", "of nothing"]).to_string()),
            ("seed", "3".to_owned()),
        ]);
        let mut weights: StateDict = weights_of(&small_detector()).into_iter().take(5).collect();
        for name in ["imprint.a", "comparison.b", "orientation.c", "orientation_imprint.d"] {
            weights.insert(name.to_owned(), WeightTensor { shape: vec![1, 2], values: vec![0.0; 2] });
        }
        Self::new(&metadata, &weights, &[])
    }
}

/// How the bar of a photo is lit.
#[derive(Clone, Copy)]
enum Light {
    Even,
    /// Darker towards both long sides: a part of revolution, which needs the least preparation for a search.
    AsOnARoundBody,
}

/// The photo of the even bar, for a search.
pub(super) fn searched_photo() -> RgbImage {
    photo(Light::Even)
}

/// A bar of 48 × 18 pixels.
fn photo(light: Light) -> RgbImage {
    RgbImage::from_fn(72, 42, |x, y| {
        if !(12..60).contains(&x) || !(12..30).contains(&y) {
            return Rgb([200, 190, 180]);
        }
        match light {
            Light::Even => Rgb([40, 60, 90]),
            Light::AsOnARoundBody => {
                let from_axis = (f64::from(y) + 0.5 - 21.0) / 9.0;
                Rgb([(60.0 + 80.0 * (1.0 - from_axis * from_axis)) as u8; 3])
            }
        }
    })
}

/// The marks of the bar; without an outline, the box has a margin.
fn marks(label: &str, has_outline: bool) -> Value {
    let margin = if has_outline { 0.0 } else { 2.0 };
    let outline = json!({"vertices": [[12.0, 12.0], [60.0, 12.0], [60.0, 30.0], [12.0, 30.0]]});
    json!({
        "label": label,
        "bbox": {"x1": 12.0 - margin, "y1": 12.0 - margin, "x2": 60.0 + margin, "y2": 30.0 + margin},
        "grasp": {"start": [24.0, 21.0], "end": [48.0, 21.0]},
        "outline": if has_outline { outline } else { Value::Null },
        "width_px": 18.0,
        "photo_size": [640, 480],
        "photo_middle": [36.0, 21.0],
    })
}

fn metadata(kind: ModelKind, demonstrations: &[Value], teaching: &Value) -> Metadata {
    let calibration = json!({
        "network": {"threshold": 0.5, "slope": 1.0},
        "evidence": {"on_part": [1, 2, 30], "elsewhere": [40, 5, 6], "margin": 2.0},
        "resemblance": 0.37,
    });
    BTreeMap::from([
        ("format_version", FORMAT_VERSION.to_string()),
        ("model", kind.to_string()),
        ("preset", "edge".to_owned()),
        ("object", "bar".to_owned()),
        ("keypoint_count", "0".to_owned()),
        ("teaching", teaching.to_string()),
        ("calibration", calibration.to_string()),
        ("demonstrations", json!(demonstrations).to_string()),
    ])
}

/// The detector of model C.
pub(super) fn small_detector() -> RcnnConfig {
    detector(ModelKind::C)
}

/// The detector of a model, with two channels where preset `edge` has up to 256.
fn detector(kind: ModelKind) -> RcnnConfig {
    let mut config = edge_of(match kind {
        ModelKind::A => RcnnKind::Faster { num_classes: 1 },
        ModelKind::D => RcnnKind::Mask { num_classes: 1 },
        _ => RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS },
    });
    config.input.resize = ResizeRule::FitWithin { width_px: 64, height_px: 48 };
    config.backbone.stem_channels = 2;
    config.backbone.res2_channels = 2;
    config.backbone.num_blocks = [1; 4];
    config.backbone.norm = NormKind::Identity;
    config.fpn.channels = 2;
    let heads = &mut config.roi_heads;
    heads.box_head.fc_channels = 2;
    heads.box_head.pooler.output_size = 2;
    if let Some(head) = &mut heads.keypoint_head {
        head.conv_channels = vec![2];
    }
    if let Some(head) = &mut heads.mask_head {
        head.conv_channels = vec![2];
        head.deconv_channels = 2;
    }
    config
}

fn orientation() -> OrientationConfig {
    OrientationConfig {
        input_px: 16,
        classes: AngleClasses { num_classes: 4, symmetry: 1 },
        stem_kernel: 3,
        stage_channels: vec![2],
        stage_convs: vec![1],
        norm_groups: 1,
        hidden: 2,
        readout: Readout { window_classes: 0, quarter_turns: true },
    }
}

fn comparison() -> ComparisonConfig {
    ComparisonConfig {
        input_px: 16,
        trunk_channels: vec![2],
        trunk_convs: vec![1],
        reach: 0,
        stage_channels: vec![2],
        stage_convs: vec![1],
        norm_groups: 1,
        hidden: 2,
    }
}

fn weights_of(config: &RcnnConfig) -> StateDict {
    state_dict::export(&config.init_blank(&Device::flex()).expect("a small detector"))
}

fn prefixed(module: &str, weights: StateDict) -> StateDict {
    weights.into_iter().map(|(name, weight)| (format!("{module}.{name}"), weight)).collect()
}
