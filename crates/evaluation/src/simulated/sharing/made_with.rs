//! The models with which a unit's results were made.

use anyhow::{Context, Result};
use sdg_weights_conversion::sha256_of;

use super::super::units::Evaluation;
use super::records::ModelHashes;
use super::unit_list::ListedUnit;

impl Evaluation<'_> {
    /// The models that a unit reads, as they are now.
    pub(super) fn models_of(&self, unit: &ListedUnit) -> Result<ModelHashes> {
        let with_hash = |file: &String| -> Result<(String, Option<String>)> {
            let path = self.store.path(file);
            if !path.exists() {
                return Ok((file.clone(), None));
            }
            Ok((file.clone(), Some(sha256_of(&path).with_context(|| path.display().to_string())?)))
        };
        unit.models.iter().map(with_hash).collect()
    }
}

/// The first model file that has changed since a unit's results were made.
pub(super) fn other_model<'m>(made_with: &ModelHashes, now: &'m ModelHashes) -> Option<&'m str> {
    let mut others = now.iter().filter(|(file, hash)| made_with.get(*file).is_some_and(|with| with != *hash));
    others.next().map(|(file, _)| file.as_str())
}

/// Why a unit's results cannot be used any more.
pub(super) fn made_with_another(model: &str, unit: &str) -> String {
    format!("done with an earlier {model}; this model was taught again: remove units/{unit} and do it again")
}
