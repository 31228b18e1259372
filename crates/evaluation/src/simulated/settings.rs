//! The settings on which an evaluation's results depend.

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Everything that results of the paper's protocol depend on, apart from which models and parts they are of. Kept in every
/// file of a [`Store`](super::Store), so that results of different settings never meet in one table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Which protocol: raised when scenes, seeds or what is counted change.
    pub protocol: u32,
    /// Network, training and augmentation.
    pub preset: String,
    /// Optimiser steps other than the preset's.
    pub steps: Option<u32>,
    /// Seconds that a network's training may take at most; a result then depends on the machine.
    pub time_budget: Option<u32>,
    /// Decides every random choice.
    pub seed: u64,
    /// Grasp attempts of each cell.
    pub attempts: u32,
    /// Unseen pictures of each part.
    pub views: u32,
    /// Pictures for each part in which it is not.
    pub scenes: u32,
    /// SHA-256 of the program, where many processes share the folder: then no result of another program is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

impl Settings {
    /// The protocol of this version.
    pub const PROTOCOL: u32 = 2;

    /// Settings of preset `edge`, with as many pictures with the part as without it.
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

    /// Those of them that decide a teaching.
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

/// What a teaching depends on, apart from model, part and marks: the protocol and the axes share teachings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TeachingSettings {
    /// Network, training and augmentation.
    pub preset: String,
    /// Optimiser steps other than the preset's.
    pub steps: Option<u32>,
    /// Seconds that a network's training may take at most; a result then depends on the machine.
    pub time_budget: Option<u32>,
    /// Decides every random choice.
    pub seed: u64,
    /// As in [`Settings`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

/// How the settings that a reader asks for differ from those that a file was made with, in words; `None` when each that is
/// asked for is as in the file. What the file says beyond them does not concern the reader.
///
/// # Errors
/// Settings that cannot be written as JSON.
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
        // The program counts for whoever asks for one, and for nobody else.
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
