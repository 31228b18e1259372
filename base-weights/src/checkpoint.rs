//! The state from which a stopped run resumes: all parameters and moments in full precision, and the settings
//! of the run.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use sdg_files::write_atomically;
use sdg_layers::state_dict::{StateDict, WeightTensor};
use sdg_training::AdamWState;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The state of a run after a number of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint<S> {
    /// The settings that the run was started with.
    pub settings: S,
    /// Number of steps done.
    pub step: usize,
    /// The network's parameters.
    pub parameters: StateDict,
    /// The optimiser's state between steps.
    pub optimizer: AdamWState,
}

impl<S: Serialize + DeserializeOwned> Checkpoint<S> {
    /// Writes the file atomically: under a temporary name, synced, then renamed.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let named = || format!("{}: cannot write", path.display());
        let groups = [("parameters", &self.parameters), ("moments", &self.optimizer.moments)];
        let in_bytes: Vec<(String, &[usize], Vec<u8>)> = groups
            .iter()
            .flat_map(|(group, tensors)| tensors.iter().map(move |(name, tensor)| (format!("{group}/{name}"), tensor)))
            .map(|(name, tensor)| {
                let bytes = tensor.values.iter().flat_map(|value| value.to_le_bytes()).collect();
                (name, tensor.shape.as_slice(), bytes)
            })
            .collect();
        let views = in_bytes.iter().map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.to_vec(), bytes).map(|view| (name.clone(), view))
        });
        let views = views.collect::<Result<Vec<_>, _>>().with_context(named)?;
        let metadata = HashMap::from([
            ("settings".to_owned(), serde_json::to_string(&self.settings)?),
            ("step".to_owned(), self.step.to_string()),
            ("optimizer_step".to_owned(), self.optimizer.step.to_string()),
        ]);
        let bytes = safetensors::serialize(views, Some(metadata)).with_context(named)?;
        Ok(write_atomically(path, &bytes)?)
    }

    /// Reads a checkpoint.
    ///
    /// # Errors
    /// A file that cannot be read or is not a checkpoint with settings of this type.
    pub fn read(path: &Path) -> Result<Self> {
        let named = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(named)?;
        let (_, header) = SafeTensors::read_metadata(&bytes).with_context(named)?;
        let metadata = header.metadata().clone().unwrap_or_default();
        let entry = |name: &str| {
            let found = metadata.get(name).with_context(|| format!("expected metadata \"{name}\", found none"));
            found.with_context(named)
        };
        let settings = serde_json::from_str(entry("settings")?).with_context(named)?;
        let step = entry("step")?.parse().with_context(named)?;
        let mut optimizer =
            AdamWState { step: entry("optimizer_step")?.parse().with_context(named)?, ..Default::default() };
        let mut parameters = StateDict::new();
        for (name, view) in SafeTensors::deserialize(&bytes).with_context(named)?.iter() {
            let values = view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
            let tensor = WeightTensor { shape: view.shape().to_vec(), values };
            match name.split_once('/') {
                Some(("parameters", name)) => parameters.insert(name.to_owned(), tensor),
                Some(("moments", name)) => optimizer.moments.insert(name.to_owned(), tensor),
                _ => bail!("{}: expected parameters and moments, found \"{name}\"", path.display()),
            };
        }
        Ok(Self { settings, step, parameters, optimizer })
    }
}
