//! Writes the base weights: the trunk, all heads except a part's own layers, and the imprint networks that
//! compute those layers from views of the part.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail};
use burn::tensor::Device;
use sdg_comparison::ComparisonConfig;
use sdg_grasp::BaseWeightsFile;
use sdg_layers::state_dict::{self, StateDict};

use crate::checkpoint::Checkpoint;
use crate::network::pretrain_config;
use crate::run::Settings;

/// Adds a comparison network to a file, or replaces the one that it has.
///
/// # Errors
/// A checkpoint of another network.
pub fn with_comparison(
    mut file: BaseWeightsFile,
    comparison: &Checkpoint<Settings>,
    commit: &str,
) -> Result<BaseWeightsFile> {
    let wanted = state_dict::export(&ComparisonConfig::edge().init_blank(&Device::flex())?);
    let same_shapes = wanted
        .iter()
        .all(|(name, blank)| comparison.parameters.get(name).is_some_and(|found| found.shape == blank.shape));
    if !same_shapes || wanted.len() != comparison.parameters.len() {
        bail!("expected a checkpoint of the comparison network of preset edge, found one of a different network");
    }
    file.parameters.retain(|name, _| !name.starts_with("comparison."));
    take(&comparison.parameters, "", "comparison.", &mut file.parameters)?;
    file.origin.insert("comparison".into(), format!("{}, commit {commit}", origin_of(comparison)));
    Ok(file)
}

/// A description of how a checkpoint was trained.
fn origin_of(
    Checkpoint { settings: Settings { seed, num_parts, batch_size, .. }, step, .. }: &Checkpoint<Settings>,
) -> String {
    format!("seed {seed}, {step} steps, {num_parts} parts, {} pictures", step * batch_size)
}

/// Makes the file from a detector's checkpoint and, for model A, an orientation CNN's checkpoint.
///
/// # Errors
/// A checkpoint of another network.
pub fn export(
    detector: &Checkpoint<Settings>,
    orientation: Option<&Checkpoint<Settings>>,
    commit: &str,
) -> Result<BaseWeightsFile> {
    let wanted = state_dict::export(&pretrain_config().init_blank(&Device::flex())?);
    let anew = |name: &str| name.contains("box_predictor.cls_score.");
    let mut parameters = StateDict::new();
    let mut reinitialized = BTreeSet::new();
    for (name, blank) in wanted {
        if anew(&name) {
            reinitialized.insert(name);
            continue;
        }
        let key = format!("detector.{name}");
        let found = detector.parameters.get(&key).with_context(|| format!("expected {key} in the checkpoint"))?;
        if found.shape != blank.shape {
            bail!("{key}: expected shape {:?}, found {:?}", blank.shape, found.shape);
        }
        parameters.insert(name, found.clone());
    }
    take(&detector.parameters, "imprint.", "imprint.", &mut parameters)?;
    if let Some(Checkpoint { parameters: of_orientation, .. }) = orientation {
        take(of_orientation, "network.", "orientation.", &mut parameters)?;
        take(of_orientation, "imprint.", "orientation_imprint.", &mut parameters)?;
        parameters.retain(|name, _| !name.starts_with("orientation.classes."));
    }
    let mut origin = BTreeMap::from([
        ("commit".to_owned(), commit.to_owned()),
        ("licence".to_owned(), "MIT OR Apache-2.0".to_owned()),
    ]);
    for (network, checkpoint) in [("detector", Some(detector)), ("orientation", orientation)] {
        if let Some(checkpoint) = checkpoint {
            origin.insert(network.to_owned(), origin_of(checkpoint));
        }
    }
    Ok(BaseWeightsFile { preset: "edge".into(), reinitialized, parameters, origin })
}

/// Copies the parameters that begin with `name`, renamed to begin with `other_name`.
fn take(from: &StateDict, name: &str, other_name: &str, to: &mut StateDict) -> Result<()> {
    let before = to.len();
    let named = from.iter().filter_map(|(key, tensor)| Some((key.strip_prefix(name)?, tensor)));
    to.extend(named.map(|(key, tensor)| (format!("{other_name}{key}"), tensor.clone())));
    if to.len() == before {
        bail!("expected parameters {name}* in the checkpoint, found none");
    }
    Ok(())
}
