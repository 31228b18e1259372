//! The settings that determine the results of an evaluation.

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The settings that determine the results of the paper's protocol, besides models and parts. Each record of a
/// [`Store`](super::Store) contains those on which it depends, so that no table combines results of different settings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Version of the protocol; raised when scenes, seeds or counts change.
    pub protocol: u32,
    /// Network, training and augmentation.
    pub preset: String,
    /// Number of optimiser steps; `None` for the preset's.
    pub steps: Option<u32>,
    /// Maximum duration of training, in seconds; a result then depends on the machine.
    pub time_budget: Option<u32>,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of grasp attempts of each cell.
    pub attempts: u32,
    /// Number of unseen pictures of each part.
    pub views: u32,
    /// Number of pictures without the part for each part.
    pub scenes: u32,
    /// SHA-256 of the program, if many processes use the folder: results of other programs are then rejected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

impl Settings {
    /// The current version of the protocol.
    pub const PROTOCOL: u32 = 2;

    /// Settings with preset `edge`, and with equal numbers of pictures with and without the part.
    #[cfg(test)]
    pub(super) fn for_test(seed: u64, attempts: u32, pictures: u32) -> Self {
        Self {
            protocol: Self::PROTOCOL,
            preset: "edge".into(),
            steps: None,
            time_budget: None,
            seed,
            attempts,
            views: pictures,
            scenes: pictures,
            program: None,
        }
    }

    /// The settings on which a teaching run depends.
    pub fn teaching(&self) -> TeachingSettings {
        TeachingSettings {
            preset: self.preset.clone(),
            steps: self.steps,
            time_budget: self.time_budget,
            seed: self.seed,
            program: self.program.clone(),
        }
    }
}

/// The settings that determine a teaching run, besides model, part and marks. The protocol and the axes use the same
/// teaching runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TeachingSettings {
    /// Network, training and augmentation.
    pub preset: String,
    /// Number of optimiser steps; `None` for the preset's.
    pub steps: Option<u32>,
    /// Maximum duration of training, in seconds; a result then depends on the machine.
    pub time_budget: Option<u32>,
    /// Seed of all random choices.
    pub seed: u64,
    /// SHA-256 of the program, as in [`Settings`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

/// The differences between the requested settings and a file's settings, in words; `None` if every requested setting
/// equals the file's. Additional settings in the file are ignored.
///
/// # Errors
/// The settings cannot be serialised as JSON.
pub(super) fn difference(expected: &impl Serialize, found: &Value) -> Result<Option<String>> {
    let expected = serde_json::to_value(expected)?;
    let told = |value: &Value| match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let mut differing: Vec<String> = expected
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(name, expected)| found[name.as_str()] != **expected)
        .map(|(name, expected)| format!("{name}: expected {}, found {}", told(expected), told(&found[name.as_str()])))
        .collect();
    differing.sort();
    Ok((!differing.is_empty()).then(|| differing.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings { protocol: 1, ..Settings::for_test(1, 10, 25) }
    }

    fn told(expected: &impl Serialize, found: &Settings) -> Option<String> {
        difference(expected, &serde_json::to_value(found).unwrap()).unwrap()
    }

    #[test]
    fn every_difference_is_named() {
        assert_eq!(told(&settings(), &settings()), None);
        let other = Settings { seed: 2, steps: Some(40), ..settings() };
        assert_eq!(told(&settings(), &other).unwrap(), "seed: expected 1, found 2; steps: expected none, found 40");
        let each = Settings {
            protocol: 0,
            preset: String::new(),
            steps: Some(1),
            time_budget: Some(15),
            seed: 0,
            attempts: 0,
            views: 0,
            scenes: 0,
            program: None,
        };
        assert_eq!(told(&settings(), &each).unwrap().matches("expected").count(), 8);
        // The program is compared only if requested.
        let of_program = |name: &str| Settings { program: Some(name.into()), ..settings() };
        assert_eq!(told(&of_program("a1"), &of_program("b2")).unwrap(), "program: expected a1, found b2");
        assert_eq!(told(&of_program("a1"), &settings()).unwrap(), "program: expected a1, found none");
        assert_eq!(told(&settings(), &of_program("a1")), None);
    }

    #[test]
    fn a_teaching_depends_on_its_own_settings_alone() {
        let other = Settings { protocol: 9, attempts: 1, views: 1, scenes: 1, ..settings() };
        assert_eq!(told(&settings().teaching(), &other), None);
        let other = Settings { preset: "tiny".into(), ..settings() };
        assert_eq!(told(&settings().teaching(), &other).unwrap(), "preset: expected edge, found tiny");
    }
}
