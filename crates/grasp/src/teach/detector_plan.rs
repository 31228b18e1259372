//! The detector of a model, and what it is taught with besides.

use burn::tensor::Device;
use sdg_detection::config::KeypointHeadConfig;
use sdg_detection::{GeneralizedRcnn, RcnnConfig};
use sdg_layers::state_dict;

use crate::base_weights::BaseWeights;
use crate::error::Result;

/// A detector and a head that is left out after teaching.
#[derive(Debug, Clone)]
pub(crate) struct DetectorPlan {
    /// The detector's configuration.
    pub(crate) network: RcnnConfig,
    /// A keypoint head that only teaching has.
    ///
    /// A box, or the mask of something thin, tells a network made from nothing too little of what the part is. After 260
    /// steps model A's found the rod end in 17 and the fuel line in 12 of 35 held-back samples; after 300 with keypoints
    /// in 20 and 14.
    pub(crate) auxiliary_keypoints: Option<KeypointHeadConfig>,
}

impl DetectorPlan {
    /// The detector while it is taught.
    pub(crate) fn taught(&self) -> RcnnConfig {
        let mut taught = self.network.clone();
        if let Some(head) = &self.auxiliary_keypoints {
            taught.roi_heads.keypoint_head = Some(head.clone());
        }
        taught
    }

    /// The detector as teaching starts, from base weights or from what the seed draws.
    ///
    /// # Errors
    /// [`GraspError::BaseWeights`](crate::GraspError::BaseWeights) for weights of another network.
    pub(super) fn initial(&self, weights: Option<&BaseWeights>, device: &Device, seed: u64) -> Result<GeneralizedRcnn> {
        let device = device.clone().autodiff();
        let taught = || self.taught().init(&device, seed);
        match weights {
            None => Ok(taught()?),
            // Of ours, which have every head that is taught.
            Some(weights) if weights.has_keypoint_head() => weights.apply(taught()?),
            // Imported ones have the model's heads alone: the others start from nothing.
            Some(weights) => {
                let own = weights.apply(self.network.init(&device, seed)?)?;
                Ok(state_dict::import(taught()?, &state_dict::export(&own)).0)
            }
        }
    }
}
