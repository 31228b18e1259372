//! What teaching measures of a part besides its networks: a section of the model file.

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::check_config::ScoreConfig;
use crate::network_evidence::NetworkEvidence;

/// What was measured of the part while teaching, as stored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Calibrations {
    pub(crate) network: Calibration,
    /// What the network's scores are worth; `None` without a network, and in version 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) evidence: Option<NetworkEvidence>,
    /// Mean agreement of other things with the part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) resemblance: Option<f64>,
    /// Version 1: the agreement from which on the part counted as found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    agreement: Option<Calibration>,
}

impl Calibrations {
    #[cfg(any(feature = "teach", test))]
    pub(crate) fn new(network: Calibration, evidence: Option<NetworkEvidence>, resemblance: f64) -> Self {
        Self { network, evidence, resemblance: Some(resemblance), agreement: None }
    }

    /// The same, of a file whose slope is per unit of the score.
    pub(crate) fn of_older_file(self) -> Self {
        Self { network: self.network.of_older_file(), ..self }
    }

    /// The log-likelihood ratio of a place by the network's score there, 0 where it proposes nothing; `None` where that is not known.
    pub(crate) fn log_likelihood_ratio(&self, network_score: f64) -> Option<f64> {
        Some(self.evidence?.log_likelihood_ratio(network_score, &self.network))
    }

    /// Mean agreement of other things with the part. Version 1 set its threshold 0.2 above that, within bounds.
    pub(crate) fn resemblance(&self) -> f64 {
        const MARGIN_OF_VERSION_1: f64 = 0.2;
        let from_threshold = || self.agreement.map(|agreement| agreement.threshold - MARGIN_OF_VERSION_1);
        self.resemblance.or_else(from_threshold).unwrap_or(ScoreConfig::DEFAULT.resemblance.neutral)
    }
}
