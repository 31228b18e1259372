//! The two ways in which a model is measured.

use sdg_grasp::ModelKind;
use serde::Serialize;

/// With the check against the demonstration, or the network alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// With the check against the demonstration.
    WithCheck,
    NetworkAlone,
}

impl Way {
    /// Both ways, in the order of the tables.
    pub const ALL: [Self; 2] = [Self::WithCheck, Self::NetworkAlone];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::WithCheck => "with the check",
            Self::NetworkAlone => "network alone",
        }
    }

    /// Whether a model is measured in this way: a model without a network is measured only with the check.
    pub fn is_of(self, model: ModelKind) -> bool {
        self == Self::WithCheck || model.has_network()
    }
}
