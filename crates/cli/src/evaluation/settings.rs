//! What decides an evaluation's results.

use serde::{Deserialize, Serialize};

/// Everything that results depend on, apart from which models and parts they are of. Kept in every file of a
/// [`Store`](super::Store), so that results of different settings never meet in one table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Which protocol: raised when scenes, seeds or what is counted change.
    pub protocol: u32,
    /// Network, training and augmentation.
    pub preset: String,
    /// Optimiser steps other than the preset's.
    pub steps: Option<u32>,
    /// Decides every random choice.
    pub seed: u64,
    /// Grasp attempts of each cell.
    pub attempts: u32,
    /// Unseen pictures of each part.
    pub views: u32,
    /// Pictures for each part in which it is not.
    pub scenes: u32,
}

impl Settings {
    /// The protocol of this version.
    pub const PROTOCOL: u32 = 2;

    /// What differs from `found`, in words; `None` when nothing does.
    pub fn difference(&self, found: &Self) -> Option<String> {
        let steps = |steps: Option<u32>| steps.map_or("the preset's".to_owned(), |steps| steps.to_string());
        let differing: Vec<String> = [
            ("protocol", self.protocol.to_string(), found.protocol.to_string()),
            ("preset", self.preset.clone(), found.preset.clone()),
            ("steps", steps(self.steps), steps(found.steps)),
            ("seed", self.seed.to_string(), found.seed.to_string()),
            ("attempts", self.attempts.to_string(), found.attempts.to_string()),
            ("views", self.views.to_string(), found.views.to_string()),
            ("scenes", self.scenes.to_string(), found.scenes.to_string()),
        ]
        .into_iter()
        .filter(|(_, expected, found)| expected != found)
        .map(|(name, expected, found)| format!("{name}: expected {expected}, found {found}"))
        .collect();
        (!differing.is_empty()).then(|| differing.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_difference_is_named() {
        let settings =
            Settings { protocol: 1, preset: "edge".into(), steps: None, seed: 1, attempts: 10, views: 25, scenes: 25 };
        assert_eq!(settings.difference(&settings.clone()), None);
        let other = Settings { seed: 2, steps: Some(40), ..settings.clone() };
        assert_eq!(
            settings.difference(&other).unwrap(),
            "steps: expected the preset's, found 40; seed: expected 1, found 2"
        );
        let each =
            Settings { protocol: 0, preset: String::new(), steps: Some(1), seed: 0, attempts: 0, views: 0, scenes: 0 };
        assert_eq!(settings.difference(&each).unwrap().matches("expected").count(), 7);
    }
}
