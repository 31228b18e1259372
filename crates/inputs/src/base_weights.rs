//! Base weights for teaching: this project's own, or a checkpoint of any format, loaded into the taught network.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_detection::RcnnConfig;
use sdg_detection::config::ImageTransformConfig;
use sdg_grasp::{BaseWeights, BaseWeightsFile, TeachOptions};
use sdg_layers::state_dict::{StateDict, WeightTensor};
use sdg_weights_conversion::{Checkpoint, Conversion, Naming, Report, Source, naming_of, sha256_of};

use crate::detector_config::{architecture_of, kind_of, preset_for, preset_of_kind};

/// How this project's base weights were made: facts by name, such as `seed`.
pub type Origin = BTreeMap<String, String>;

/// Maximum size of this project's base weights.
const MAX_OWN_BYTES: u64 = 64 << 20;

/// Reads this project's base weights for the network of `options`, and their [`Origin`]. Parameters whose names begin
/// with an entry of `reinitialized` are left out. `None` if the file is of another kind, or the taught model has no
/// network.
///
/// # Errors
/// The file cannot be read, the weights are of another preset, or no parameter has a given prefix.
pub fn read_own(
    path: &Path,
    options: &TeachOptions,
    reinitialized: &[String],
) -> Result<Option<(BaseWeights, Origin)>> {
    let named = || path.display().to_string();
    let (_, checkpoint) = open(path)?;
    let (true, Some(network)) = (BaseWeightsFile::is_described_by(&checkpoint.metadata), options.taught_network())
    else {
        return Ok(None);
    };
    let file = BaseWeightsFile::from_bytes(&sdg_files::read(path, MAX_OWN_BYTES)?).with_context(named)?;
    let sha256 = sha256_of(path).with_context(named)?;
    let mut weights = file.for_network(options.preset.name(), &network, sha256).with_context(named)?;
    for prefix in reinitialized {
        let names: Vec<String> = weights.parameters.keys().filter(|name| name.starts_with(prefix)).cloned().collect();
        if names.is_empty() {
            bail!(
                "{}: expected the beginning of the names of parameters to initialise randomly, found \"{prefix}\"",
                path.display()
            );
        }
        names.iter().for_each(|name| drop(weights.parameters.remove(name)));
        weights.reinitialized.extend(names);
    }
    Ok(Some((weights, file.origin)))
}

/// Opens a checkpoint of any format.
///
/// # Errors
/// The file cannot be read, or is not a checkpoint.
pub fn open(path: &Path) -> Result<(Source, Checkpoint)> {
    let named = || path.display().to_string();
    let mut source = Source::open(path).with_context(named)?;
    let checkpoint = Checkpoint::read(&mut source).with_context(named)?;
    Ok((source, checkpoint))
}

/// Reads the weights in `path` for `network`. Parameters whose names begin with an entry of `reinitialized` are left
/// out. If the file contains only a backbone, the rest of the network is initialised randomly and need not be named.
///
/// `tell` receives the report of the conversion before the values are read.
///
/// # Errors
/// The file cannot be read, the weights are for another network or another image input, or a prefix fits no parameter.
pub fn read(
    path: &Path,
    network: &RcnnConfig,
    reinitialized: &[String],
    tell: &mut dyn FnMut(&Report) -> Result<()>,
) -> Result<BaseWeights> {
    let named = || path.display().to_string();
    let (mut source, checkpoint) = open(path)?;
    check_input(&checkpoint, network).with_context(named)?;
    let architecture = architecture_of(network);
    let conversion = Conversion::plan(&checkpoint, &architecture, reinitialized).with_context(named)?;
    tell(conversion.report())?;
    let values = conversion.values(&mut source).with_context(named)?;
    let parameters: StateDict =
        values.into_iter().map(|(name, (shape, values))| (name, WeightTensor { shape, values })).collect();
    let reinitialized = architecture.parameters().into_keys().filter(|name| !parameters.contains_key(name)).collect();
    Ok(BaseWeights {
        sha256: sha256_of(path).with_context(named)?,
        parameters,
        reinitialized,
        imprint: StateDict::new(),
        comparison: StateDict::new(),
        orientation: None,
    })
}

/// Checks the channel order and the range of the input: a network's weights are useless for any other input.
fn check_input(checkpoint: &Checkpoint, network: &RcnnConfig) -> Result<()> {
    let naming = naming_of(checkpoint)?;
    let made_for = match (checkpoint.metadata.get("network"), naming) {
        (Some(network), Naming::Ours) => RcnnConfig::from_json(network).context("metadata \"network\"")?,
        // A file of this project without this information cannot be checked.
        (None, Naming::Ours) => return Ok(()),
        _ => preset_of_kind(preset_for(naming)?, kind_of(network))?,
    };
    let (expected, found) = (&network.input, &made_for.input);
    let says = |input: &ImageTransformConfig| (input.channel_order, input.pixel_range, input.mean, input.std);
    if says(expected) != says(found) {
        bail!(
            "the weights are for images as {:?} in {:?} with mean {:?}, the preset uses {:?} in {:?} with mean {:?}: \
             Detectron2's weights are for r50-detectron2, torchvision's for r50-torchvision",
            found.channel_order,
            found.pixel_range,
            found.mean,
            expected.channel_order,
            expected.pixel_range,
            expected.mean,
        );
    }
    Ok(())
}
