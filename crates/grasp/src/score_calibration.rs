//! What teaching measures of a part besides its networks: a section of the model file.

use serde::{Deserialize, Serialize};

use crate::network_calibration::NetworkCalibration;
use crate::network_evidence::NetworkEvidence;

/// What was measured of the part while teaching, as stored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScoreCalibration {
    pub(crate) network: NetworkCalibration,
    /// What the network's scores are worth; `None` without a network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) evidence: Option<NetworkEvidence>,
    /// Mean agreement of other things with the part.
    pub(crate) resemblance: f64,
}

impl ScoreCalibration {
    /// The log-likelihood ratio of a place by the network's score there, 0 where it proposes nothing; `None` where that is not known.
    pub(crate) fn log_likelihood_ratio(&self, network_score: f64) -> Option<f64> {
        Some(self.evidence?.log_likelihood_ratio(network_score, &self.network))
    }
}
