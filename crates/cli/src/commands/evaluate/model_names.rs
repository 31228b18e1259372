//! The grasp models that `--models` names.

use anyhow::Result;
use sdg_demonstration::UnknownModel;
use sdg_grasp::ModelKind;

use crate::exit::Usage;

/// The models with these letters or names, or `otherwise` if there are no names.
///
/// # Errors
/// A name is unknown, or a model is given twice.
pub fn models(names: &[String], otherwise: &[ModelKind]) -> Result<Vec<ModelKind>> {
    if names.is_empty() {
        return Ok(otherwise.to_vec());
    }
    let mut models = Vec::new();
    for name in names {
        let model = name.parse().map_err(|error: UnknownModel| Usage(format!("--models: {error}")))?;
        if models.contains(&model) {
            return Err(Usage(format!("--models: expected each model once, found {model} again")).into());
        }
        models.push(model);
    }
    Ok(models)
}
