//! The networks that are compared, and the weights that both sides load.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use burn::tensor::Device;
use clap::ValueEnum;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use sdg_detection::config::*;
use sdg_detection::presets::{self, RcnnKind};
use sdg_detection::{GeneralizedRcnn, RcnnConfig};
use sdg_layers::state_dict::{self, StateDict, WeightTensor};

/// Number of keypoints of a part for R50: COCO's number.
pub const NUM_KEYPOINTS: usize = 17;
/// Number of positive ROIs among the 512 ROIs per image in training. It equals the number of parts in the picture.
/// Their ground-truth boxes are among the candidates, so the number is reached with any weights.
pub const POSITIVE_ROIS: usize = 32;

/// The networks that both sides build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Network {
    /// R50-FPN with boxes.
    Faster,
    /// R50-FPN with boxes and masks.
    Mask,
    /// R50-FPN with boxes and keypoints.
    Keypoint,
    /// The preset for two cores.
    Edge,
}

impl Network {
    /// Name on the command line and of the weights file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Faster => "faster",
            Self::Mask => "mask",
            Self::Keypoint => "keypoint",
            Self::Edge => "edge",
        }
    }

    /// The configuration. R50 has torchvision's numerics, because it is compared with torchvision.
    pub fn config(self) -> RcnnConfig {
        match self {
            Self::Faster => with_torchvision_numerics(RcnnKind::Faster { num_classes: 1 }),
            Self::Mask => with_torchvision_numerics(RcnnKind::Mask { num_classes: 1 }),
            Self::Keypoint => with_torchvision_numerics(RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS }),
            Self::Edge => presets::edge(sdg_grasp::NUM_KEYPOINTS),
        }
    }

    /// Writes weights from a fixed seed, scaled so that values stay of order one through R50's sixteen blocks,
    /// because there are no trained norms that limit them.
    pub fn write_weights(self, out: &Path) -> Result<()> {
        let mut weights = state_dict::export(&self.config().init(&Device::flex(), SEED)?);
        for (name, weight) in &mut weights {
            if name.ends_with("conv3.norm.weight") {
                weight.values.fill(RESIDUAL_GAIN);
            }
        }
        let bytes: Vec<(&String, &WeightTensor, Vec<u8>)> = weights
            .iter()
            .map(|(name, weight)| (name, weight, weight.values.iter().flat_map(|v| v.to_le_bytes()).collect()))
            .collect();
        let views = bytes
            .iter()
            .map(|(name, weight, bytes)| Ok((*name, TensorView::new(Dtype::F32, weight.shape.clone(), bytes)?)))
            .collect::<Result<Vec<_>>>()?;
        let unfinished = out.with_extension("unfinished");
        safetensors::serialize_to_file(views, None, &unfinished)?;
        std::fs::rename(&unfinished, out).with_context(|| out.display().to_string())
    }

    /// Builds the network with the weights of a file.
    pub fn load(self, device: &Device, weights: &Path) -> Result<GeneralizedRcnn> {
        let bytes = std::fs::read(weights).with_context(|| weights.display().to_string())?;
        let dict: StateDict = SafeTensors::deserialize(&bytes)?
            .iter()
            .map(|(name, view)| {
                ensure!(view.dtype() == Dtype::F32, "{name}: expected F32, found {:?}", view.dtype());
                let values = view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
                Ok((name.to_owned(), WeightTensor { shape: view.shape().to_vec(), values: values.collect() }))
            })
            .collect::<Result<_>>()?;
        drop(bytes);
        let (network, report) = state_dict::import(self.config().init(device, SEED)?, &dict);
        if !report.is_complete() {
            bail!(
                "{}: expected the weights of {}, found those of another network: {report:?}",
                weights.display(),
                self.name()
            );
        }
        Ok(network)
    }
}

/// Seed of the weights.
const SEED: u64 = 11;
/// Factor on the last convolution of every bottleneck.
const RESIDUAL_GAIN: f32 = 0.2;

/// torchvision's detector as the peers build it: short side 480, norms with an epsilon, and enough ROIs for the
/// heads.
fn with_torchvision_numerics(kind: RcnnKind) -> RcnnConfig {
    let mut config = presets::r50_torchvision(kind);
    config.input.resize = ResizeRule::ShortSide { short_px: 480, max_long_px: 1333, rounding: SizeRounding::Floor };
    config.backbone.norm = NormKind::FrozenBatch { eps: 1e-5 };
    let sampler = &mut config.roi_heads.sampler;
    sampler.positive_fraction = POSITIVE_ROIS as f64 / sampler.batch_size_per_image as f64;
    config
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_configuration_is_sound() {
        for network in Network::value_variants() {
            assert!(network.config().validate().is_ok(), "{}", network.name());
        }
    }

    #[test]
    fn weights_come_back_from_their_file_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("edge.safetensors");
        Network::Edge.write_weights(&file).unwrap();
        let device = Device::flex();
        let loaded = Network::Edge.load(&device, &file).unwrap();
        let drawn = Network::Edge.config().init(&device, SEED).unwrap();
        assert_eq!(state_dict::export(&loaded), state_dict::export(&drawn));
        let error = Network::Faster.load(&device, &file).unwrap_err().to_string();
        assert!(error.contains("expected the weights of faster"), "{error}");
    }
}
