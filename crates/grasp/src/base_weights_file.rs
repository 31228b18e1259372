//! This project's base weights as bytes: one safetensors file with every head of preset `edge`.
//!
//! ```text
//! metadata   format          "sdg base weights 1"
//!            preset          the preset to which the weights belong
//!            reinitialized   names of the parameters that teaching initialises randomly   (JSON)
//!            further information about the creation of the weights: commit, seed, steps, parts, licence
//! tensors    NAME            f16: the detector's parameters
//!            imprint.*       f16: the weights that compute the detector's last layers from a part's views
//!            orientation.*, orientation_imprint.*   f16: the same for the orientation CNN
//!            comparison.*    f16: the comparison network
//! ```

use std::collections::{BTreeMap, BTreeSet};

use burn::tensor::Device;
use safetensors::{Dtype, SafeTensors};
use sdg_detection::RcnnConfig;
use sdg_layers::state_dict::{self, StateDict, WeightTensor};
use sdg_training::orientation::OrientationStart;

use crate::base_weights::BaseWeights;
use crate::error::{GraspError, Result};
use crate::safetensors_file::{self, TensorBytes, values_from_halves};

/// The name of the format, without and with the version.
const FORMAT_NAME: &str = "sdg base weights";
const FORMAT: &str = "sdg base weights 1";

/// The shipped base weights, made by `make base-weights`, and the file's SHA-256.
#[cfg(feature = "base-weights")]
pub(crate) static SHIPPED: &[u8] = include_bytes!("../weights/edge.safetensors");
#[cfg(feature = "base-weights")]
pub(crate) const SHIPPED_SHA256: &str = include_str!("../weights/edge.sha256");

/// This project's base weights and their provenance.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseWeightsFile {
    /// The preset to which the weights belong.
    pub preset: String,
    /// Parameters that teaching initialises randomly, such as predictors of other classes.
    pub reinitialized: BTreeSet<String>,
    /// Values by the parameters' names.
    pub parameters: StateDict,
    /// The provenance of the weights, by keys such as `commit` and `seed`.
    pub origin: BTreeMap<String, String>,
}

impl BaseWeightsFile {
    /// The bytes, in half precision.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut metadata = self.origin.clone();
        metadata.insert("format".into(), FORMAT.into());
        metadata.insert("preset".into(), self.preset.clone());
        metadata.insert("reinitialized".into(), serde_json::json!(self.reinitialized).to_string());
        let tensors = self.parameters.iter();
        let tensors = tensors
            .map(|(name, tensor)| (name.clone(), (tensor.shape.clone(), TensorBytes::halves(&tensor.values))))
            .collect();
        safetensors_file::write(&metadata, &tensors)
    }

    /// Whether a safetensors file with this metadata has this format, in any version.
    pub fn is_described_by(metadata: &BTreeMap<String, String>) -> bool {
        metadata.get("format").is_some_and(|format| format.starts_with(FORMAT_NAME))
    }

    fn origin_of(bytes: &[u8]) -> Result<BTreeMap<String, String>> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| refused(&error.to_string()))?;
        Ok(header.metadata().clone().unwrap_or_default().into_iter().collect())
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// [`GraspError::BaseWeights`] for bytes of another format and for values that are not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut origin = Self::origin_of(bytes)?;
        let mut take = |name: &str| origin.remove(name).ok_or_else(|| refused(&format!("no metadata \"{name}\"")));
        let format = take("format")?;
        if format != FORMAT {
            return Err(refused(&format!("format \"{format}\" instead of \"{FORMAT}\"")));
        }
        let preset = take("preset")?;
        let reinitialized = serde_json::from_str(&take("reinitialized")?)
            .map_err(|error| refused(&format!("metadata \"reinitialized\" that cannot be read: {error}")))?;
        let file = SafeTensors::deserialize(bytes).map_err(|error| refused(&error.to_string()))?;
        let mut parameters = StateDict::new();
        for (name, view) in file.iter() {
            if view.dtype() != Dtype::F16 {
                return Err(refused(&format!("{name} of type {:?} instead of F16", view.dtype())));
            }
            let values = values_from_halves(view.data());
            if values.iter().any(|value| !value.is_finite()) {
                return Err(refused(&format!("{name} with values that are not finite")));
            }
            parameters.insert(name.to_owned(), WeightTensor { shape: view.shape().to_vec(), values });
        }
        Ok(Self { preset, reinitialized, parameters, origin })
    }

    /// The weights for a network; heads that the network lacks are left out. `sha256` is the hash of the file.
    ///
    /// # Errors
    /// [`GraspError::BaseWeights`] for another preset, [`GraspError::Detection`] for an invalid configuration.
    pub fn for_network(&self, preset: &str, network: &RcnnConfig, sha256: String) -> Result<BaseWeights> {
        if self.preset != preset {
            return Err(refused(&format!("weights for preset {} instead of {preset}", self.preset)));
        }
        let names = state_dict::export(&network.init_blank(&Device::flex())?);
        let own = |name: &&String| names.contains_key(*name);
        Ok(BaseWeights {
            sha256,
            parameters: self
                .parameters
                .iter()
                .filter(|(name, _)| own(name))
                .map(|(n, v)| (n.clone(), v.clone()))
                .collect(),
            reinitialized: self.reinitialized.iter().filter(own).cloned().collect(),
            imprint: self.named("imprint."),
            not_imprinted: BTreeSet::new(),
            comparison: self.named("comparison."),
            orientation: Some(OrientationStart {
                parameters: self.named("orientation."),
                imprint: self.named("orientation_imprint."),
            })
            .filter(|start| !start.parameters.is_empty()),
        })
    }

    /// The values whose names have this prefix, with the prefix removed.
    fn named(&self, beginning: &str) -> StateDict {
        let named =
            |(name, tensor): (&String, &WeightTensor)| Some((name.strip_prefix(beginning)?.to_owned(), tensor.clone()));
        self.parameters.iter().filter_map(named).collect()
    }
}

fn refused(found: &str) -> GraspError {
    GraspError::BaseWeights { fitting: 0, found: found.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_detection::presets::{RcnnKind, edge_of};

    fn file() -> BaseWeightsFile {
        let config = edge_of(RcnnKind::Keypoint { num_keypoints: crate::NUM_KEYPOINTS });
        let mut parameters = state_dict::export(&config.init(&Device::flex(), 3).unwrap());
        let reinitialized: BTreeSet<String> =
            parameters.keys().filter(|name| name.contains("cls_score")).cloned().collect();
        parameters.retain(|name, _| !reinitialized.contains(name));
        let origin = BTreeMap::from([("seed".to_owned(), "3".to_owned())]);
        BaseWeightsFile { preset: "edge".into(), reinitialized, parameters, origin }
    }

    #[test]
    fn a_file_comes_back_but_for_rounding_and_fits_networks_with_fewer_heads() {
        let written = file();
        let bytes = written.to_bytes();
        assert!(bytes.len() < 10 << 20);
        let read = BaseWeightsFile::from_bytes(&bytes).unwrap();
        assert_eq!((&read.reinitialized, &read.origin), (&written.reinitialized, &written.origin));
        assert_eq!(read.to_bytes(), bytes);

        let boxes_alone = edge_of(RcnnKind::Faster { num_classes: 1 });
        let weights = read.for_network("edge", &boxes_alone, "0".repeat(64)).unwrap();
        assert!(!weights.has_keypoint_head() && read.parameters.len() > weights.parameters.len());
        let network = weights.apply(boxes_alone.init(&Device::flex(), 1).unwrap()).unwrap();
        let taken = state_dict::export(&network);
        assert_eq!(taken["backbone.fpn.fpn_output2.weight"], read.parameters["backbone.fpn.fpn_output2.weight"]);
        let error = read.for_network("paper", &boxes_alone, String::new()).unwrap_err().to_string();
        assert!(error.contains("weights for preset edge instead of paper"), "{error}");
    }

    #[test]
    fn other_bytes_are_refused_with_what_is_wrong() {
        let bytes = file().to_bytes();
        assert!(BaseWeightsFile::from_bytes(b"no").is_err());
        assert!(!BaseWeightsFile::is_described_by(&BTreeMap::new()));
        let other = BaseWeightsFile { preset: "edge".into(), ..file() };
        let text = String::from_utf8_lossy(&other.to_bytes()[8..200]).replace("weights 1", "weights 9");
        let mut changed = bytes.clone();
        changed[8..8 + text.len()].copy_from_slice(text.as_bytes());
        let error = BaseWeightsFile::from_bytes(&changed).unwrap_err().to_string();
        assert!(error.contains("format \"sdg base weights 9\""), "{error}");
        assert!(BaseWeightsFile::from_bytes(&bytes[..bytes.len() - 2]).is_err());
    }
}
