//! Base weights for teaching: this project's own, or a checkpoint of any format, loaded into the taught network.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_detection::RcnnConfig;
use sdg_detection::config::{ImageTransformConfig, NormKind};
use sdg_grasp::{BaseWeights, BaseWeightsFile, TeachOptions};
use sdg_layers::state_dict::{StateDict, WeightTensor};
use sdg_weights_conversion::{
    Checkpoint, Conversion, Naming, Report, Source, is_backbone_alone, is_part_of, naming_of, sha256_of,
};

use crate::detector_config::{architecture_of, kind_of, preset_for, preset_of_kind};

/// How this project's base weights were made: facts by name, such as `seed`.
pub type Origin = BTreeMap<String, String>;

/// Maximum size of this project's base weights.
const MAX_OWN_BYTES: u64 = 64 << 20;
/// Value that the norms of a backbone alone add to their variance, in Detectron2 and in torchvision. Only the norms of
/// torchvision's detectors add nothing, and only with their COCO weights.
const BACKBONE_EPS: f64 = 1e-5;

/// Reads this project's base weights for the network of `options`, and their [`Origin`]. Parameters of the parts in
/// `reinitialized`, such as `roi_heads.box_predictor`, are left out. `None` if the file is of another kind, or the
/// taught model has no network.
///
/// # Errors
/// The file cannot be read, the weights are of another preset, or the network has no such part.
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
    for part in reinitialized {
        let names: Vec<String> = weights.parameters.keys().filter(|name| is_part_of(name, part)).cloned().collect();
        // The file itself leaves some parts out, such as the predictor of its classes.
        if names.is_empty() && !weights.reinitialized.iter().any(|name| is_part_of(name, part)) {
            bail!(
                "{}: expected a part of the network to initialise randomly, such as roi_heads.box_predictor, \
                 found \"{part}\"",
                path.display()
            );
        }
        names.iter().for_each(|name| drop(weights.parameters.remove(name)));
        weights.reinitialized.extend(names);
    }
    let is_named = |name: &&String| reinitialized.iter().any(|part| is_part_of(name, part));
    weights.not_imprinted = weights.reinitialized.iter().filter(is_named).cloned().collect();
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

/// Reads the weights in `path` for `network`. Parameters of the parts in `reinitialized` are left out. If the file
/// contains only a backbone, the rest of the network is initialised randomly and need not be named.
///
/// `tell` receives the report of the conversion before the values are read.
///
/// # Errors
/// The file cannot be read, the weights are for another network or image input, or the network has no such part.
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
    let mut parameters: StateDict =
        values.into_iter().map(|(name, (shape, values))| (name, WeightTensor { shape, values })).collect();
    if is_backbone_alone(&checkpoint, conversion.report().naming)
        && let NormKind::FrozenBatch { eps } = network.backbone.norm
    {
        for (_, variance) in parameters.iter_mut().filter(|(name, _)| name.ends_with(".norm.running_var")) {
            variance.values.iter_mut().for_each(|value| *value = (f64::from(*value) + (BACKBONE_EPS - eps)) as f32);
        }
    }
    let reinitialized = architecture.parameters().into_keys().filter(|name| !parameters.contains_key(name)).collect();
    Ok(BaseWeights {
        sha256: sha256_of(path).with_context(named)?,
        parameters,
        reinitialized,
        imprint: StateDict::new(),
        not_imprinted: BTreeSet::new(),
        comparison: StateDict::new(),
        orientation: None,
    })
}

/// Checks the channel order and the range of the input: a network's weights are useless for any other input.
pub(crate) fn check_input(checkpoint: &Checkpoint, network: &RcnnConfig) -> Result<()> {
    let naming = naming_of(checkpoint)?;
    let stored = checkpoint.metadata.get("network").filter(|_| naming == Naming::Ours);
    let made_for = match (stored, preset_for(checkpoint, naming)) {
        (Some(network), _) => RcnnConfig::from_json(network).context("metadata \"network\"")?,
        (None, Some(preset)) => preset_of_kind(preset, kind_of(network))?,
        // A file of this project without this information cannot be checked.
        (None, None) => return Ok(()),
    };
    let (expected, found) = (&network.input, &made_for.input);
    let says = |input: &ImageTransformConfig| (input.channel_order, input.pixel_range, input.mean, input.std);
    if says(expected) != says(found) {
        bail!(
            "the weights are for images as {:?} in {:?} with mean {:?}, the detector uses {:?} in {:?} with mean {:?}: \
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

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_detection::presets::{RcnnKind, r50_detectron2, r50_torchvision};

    /// A file of one weight, as Detectron2's convert-torchvision-to-d2.py and numpy pickle it.
    const TORCHVISION_IN_DETECTRON2_NAMES: &[u8] = b"\x80\x04}(\x8c\x0a__author__\x8c\x0btorchvision\
        \x8c\x11stem.conv1.weightcnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85C\x01b\x87R\
        (K\x01(K\x01tcnumpy\ndtype\n\x8c\x02f4\x89\x88\x87R(K\x03\x8c\x01<NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb\
        \x89B\x04\x00\x00\x00\x00\x00\x00\x00tbu.";

    #[test]
    fn torchvision_s_backbone_in_detectron2_s_names_is_for_torchvision_s_input() {
        let checkpoint = Checkpoint::read(&mut Source::from_bytes(TORCHVISION_IN_DETECTRON2_NAMES)).unwrap();
        let kind = RcnnKind::Faster { num_classes: 1 };
        check_input(&checkpoint, &r50_torchvision(kind)).unwrap();
        let refused = check_input(&checkpoint, &r50_detectron2(kind)).unwrap_err().to_string();
        assert!(refused.contains("torchvision's for r50-torchvision"), "{refused}");
    }
}
