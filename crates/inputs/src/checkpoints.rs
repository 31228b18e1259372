//! Detectors from checkpoints: which detector a file is for, and whether its outputs equal the original's.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_detection::RcnnConfig;
use sdg_detection::golden::{self, GoldenReport};
use sdg_grasp::Device;
use sdg_layers::state_dict::{self, StateDict, WeightTensor};
use sdg_weights_conversion::architecture::{Architecture, Backbone};
use sdg_weights_conversion::{Checkpoint, Conversion, Naming, is_backbone_alone, naming_of};

use crate::base_weights::{check_input, open};
use crate::detector_config::{architecture_of, preset, preset_for, read_config};
use crate::error::ConfigError;

/// The detector of a checkpoint: given by a configuration or a preset's name, stated in the file, or derived from the
/// parameters' names.
///
/// # Errors
/// The names are unknown or match no preset; [`ConfigError`] if a configuration would help.
pub fn config_of(checkpoint: &Checkpoint, config: Option<RcnnConfig>, preset_name: Option<&str>) -> Result<RcnnConfig> {
    if let Some(config) = config {
        return Ok(config);
    }
    let naming = naming_of(checkpoint)?;
    let stored = checkpoint.metadata.get("network").filter(|_| naming == Naming::Ours && preset_name.is_none());
    match (stored, preset_name) {
        (Some(network), _) => RcnnConfig::from_json(network).context("metadata \"network\""),
        (None, Some(name)) => preset(name, checkpoint),
        (None, None) => preset(preset_for(checkpoint, naming).ok_or(ConfigError::OwnNames)?, checkpoint),
    }
}

/// The network to fill with a checkpoint, and the metadata that identify it. The detector is found as by [`config_of`];
/// a checkpoint of a backbone alone needs none.
///
/// # Errors
/// The errors of [`config_of`]; the configuration cannot be read, or the preset is for another image input than the
/// weights.
pub fn conversion_target(
    checkpoint: &Checkpoint,
    config: Option<&Path>,
    preset: Option<&str>,
) -> Result<(Architecture, BTreeMap<String, String>)> {
    let naming = naming_of(checkpoint)?;
    if is_backbone_alone(checkpoint, naming) && preset.is_none() && config.is_none() {
        let metadata = BTreeMap::from([("part".to_owned(), "backbone.bottom_up".to_owned())]);
        return Ok((Architecture { backbone: Backbone::of(checkpoint, naming)?, heads: None }, metadata));
    }
    let is_configured = config.is_some();
    let config = config_of(checkpoint, config.map(read_config).transpose()?, preset)?;
    // A configuration states the input of its own weights.
    if !is_configured {
        check_input(checkpoint, &config)?;
    }
    let mut metadata = BTreeMap::from([("network".to_owned(), serde_json::to_string(&config)?)]);
    if let Some(preset) = preset {
        metadata.insert("preset".to_owned(), preset.to_owned());
    }
    Ok((architecture_of(&config), metadata))
}

/// Builds the detector of a checkpoint, loads the weights, and compares it stage by stage with the original's outputs
/// for an image.
///
/// # Errors
/// Files cannot be read, the checkpoint is incomplete, or the targets among the outputs do not fit each other.
pub fn verify_checkpoint(
    file: &Path,
    config: Option<RcnnConfig>,
    image: &RgbImage,
    against: &Path,
    device: &Device,
) -> Result<GoldenReport> {
    let named = || file.display().to_string();
    let (mut source, checkpoint) = open(file)?;
    let config = config_of(&checkpoint, config, None).with_context(named)?.without_sampling();
    let reference = read_reference(against)?;
    let conversion = Conversion::plan(&checkpoint, &architecture_of(&config), &[]).with_context(named)?;
    let weights: StateDict = conversion
        .values(&mut source)
        .with_context(named)?
        .into_iter()
        .map(|(name, (shape, values))| (name, WeightTensor { shape, values }))
        .collect();
    let (detector, imported) = state_dict::import(config.init(&device.clone().autodiff(), 0)?, &weights);
    if !imported.is_complete() {
        bail!("{}: expected a tensor for every parameter, found {} missing", named(), imported.missing.len());
    }
    golden::verify(&detector, image, &reference).with_context(|| against.display().to_string())
}

/// Reads the outputs of the original program. The original's names of gradients are converted to this project's.
fn read_reference(path: &Path) -> Result<StateDict> {
    const GRADIENTS: &str = "gradients.";
    let (mut source, outputs) = open(path)?;
    let parameters = outputs.tensors.keys().filter_map(|name| name.strip_prefix(GRADIENTS));
    let naming = Naming::detect(parameters).unwrap_or(Naming::Ours);
    let mut reference = StateDict::new();
    for (name, tensor) in &outputs.tensors {
        let ours = match name.strip_prefix(GRADIENTS) {
            Some(parameter) => naming.our_name(parameter).map(|ours| format!("{GRADIENTS}{ours}")),
            None => Some(name.clone()),
        };
        let values = tensor.numbers(&mut source).with_context(|| path.display().to_string())?;
        reference.insert(ours.unwrap_or_else(|| name.clone()), WeightTensor { shape: tensor.shape().to_vec(), values });
    }
    Ok(reference)
}
