//! Measurements of a part during teaching: a section of the model file.

use serde::{Deserialize, Serialize};

use crate::network_calibration::NetworkCalibration;
use crate::network_evidence::NetworkEvidence;

/// The measurements of the part during teaching, as stored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScoreCalibration {
    pub(crate) network: NetworkCalibration,
    /// The evidence of the network's scores; `None` without a network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) evidence: Option<NetworkEvidence>,
    /// Mean agreement of other objects with the part.
    pub(crate) resemblance: f64,
}

impl ScoreCalibration {
    /// The calibration without any measurement.
    #[cfg(feature = "teach")]
    pub(crate) const NEUTRAL: Self = Self {
        network: NetworkCalibration::NEUTRAL,
        evidence: None,
        resemblance: crate::check_config::ScoreConfig::DEFAULT.resemblance.neutral,
    };

    /// The log-likelihood ratio of a place from the network's score there (0 without a box); `None` without the
    /// network's evidence.
    pub(crate) fn log_likelihood_ratio(&self, network_score: f64) -> Option<f64> {
        Some(self.evidence?.log_likelihood_ratio(network_score, &self.network))
    }
}
