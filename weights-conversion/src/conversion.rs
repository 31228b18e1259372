//! Assigns a checkpoint's tensors to the network's parameters, and reports the outcome for every name.

use std::collections::{BTreeMap, BTreeSet};

use crate::architecture::{Architecture, Background};
use crate::checkpoint::Checkpoint;
use crate::error::{Result, WeightsError, printable};
use crate::naming::{Naming, Renamed, strip_wrapper};
use crate::report::{Applied, Mismatch, Report};
use crate::source::Source;
use crate::tensor::StoredTensor;

/// Shapes and values of parameters by name.
pub type ParameterValues = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

/// Prefix of the names of a backbone's parameters.
const BACKBONE: &str = "backbone.bottom_up.";
/// Number of box deltas per class.
const DELTAS: usize = 4;

/// The source of a parameter's values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Origin {
    /// A tensor, unchanged.
    Tensor(StoredTensor),
    /// Rows of a tensor in another order; `None` for a row of zeros.
    Rows(StoredTensor, Vec<Option<usize>>),
    /// One value for all elements of a parameter that the file omits.
    Constant(f32),
}

/// A parameter to be written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Planned {
    pub shape: Vec<usize>,
    pub origin: Origin,
}

/// The parameters to be written, and the outcome for every name.
#[derive(Debug)]
pub struct Conversion {
    pub(crate) parameters: BTreeMap<String, Planned>,
    report: Report,
}

impl Conversion {
    /// Finds a tensor for every parameter of the network, except the parts that keep their initial values.
    ///
    /// A part is named by the prefix of its parameters' names, such as `roi_heads.box_predictor`. A backbone alone
    /// fills only the backbone of a detector. The result may be incomplete: see [`Self::complete`].
    ///
    /// # Errors
    /// Names of an unknown scheme; a part to re-initialise that the network lacks.
    pub fn plan(checkpoint: &Checkpoint, target: &Architecture, reinitialized: &[String]) -> Result<Self> {
        let naming = naming_of(checkpoint)?;
        let mut expected = target.parameters();
        for part in reinitialized {
            if !expected.keys().any(|name| is_part_of(name, part)) {
                return Err(WeightsError::UnknownPart { known: parts_of(&expected), found: printable(part) });
            }
        }
        if is_backbone_alone(checkpoint, naming) {
            expected.retain(|name, _| name.starts_with(BACKBONE));
        }
        let mut report = Report::new(checkpoint.format, naming);
        let is_reinitialized = |name: &str| reinitialized.iter().any(|part| is_part_of(name, part));
        let mut parameters = BTreeMap::new();
        let mut taken = BTreeSet::new();
        report.not_needed.extend(checkpoint.not_tensors.iter().map(|name| printable(name)));
        for (their_name, tensor) in &checkpoint.tensors {
            let name = match naming.rename(strip_wrapper(their_name)) {
                Renamed::To(name) => name,
                Renamed::NotNeeded => {
                    report.not_needed.push(printable(their_name));
                    continue;
                }
                Renamed::Unknown => {
                    report.unused.push(printable(their_name));
                    continue;
                }
            };
            let Some(shape) = expected.get(&name).filter(|_| !taken.contains(&name)) else {
                report.unused.push(printable(their_name));
                continue;
            };
            taken.insert(name.clone());
            if is_reinitialized(&name) {
                report.reinitialized.push(name);
                continue;
            }
            let origin = arrange(&name, tensor, shape, naming, target);
            match origin.filter(|_| tensor.element().is_float()) {
                Some(origin) => {
                    report.applied.push(Applied {
                        name: name.clone(),
                        shape: shape.clone(),
                        from: printable(their_name),
                        rows_moved: matches!(origin, Origin::Rows(..)),
                    });
                    parameters.insert(name, Planned { shape: shape.clone(), origin });
                }
                None => report.mismatched.push(Mismatch {
                    name,
                    expected: shape.clone(),
                    found: tensor.shape().to_vec(),
                    element: tensor.element().name(),
                }),
            }
        }
        for (name, shape) in expected {
            if taken.contains(&name) {
                continue;
            }
            if is_reinitialized(&name) {
                report.reinitialized.push(name);
            } else if let Some(value) = stands_for_missing(naming, &name) {
                report.filled.push((name.clone(), value));
                parameters.insert(name, Planned { shape, origin: Origin::Constant(value) });
            } else {
                report.missing.push(name);
            }
        }
        report.reinitialized.sort();
        Ok(Self { parameters, report })
    }

    /// The outcome for every name.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Checks that nothing is missing and every shape fits.
    ///
    /// # Errors
    /// [`WeightsError::Incomplete`] otherwise; [`Self::report`] lists the errors.
    pub fn complete(&self) -> Result<()> {
        let Report { missing, mismatched, .. } = &self.report;
        let first = match (mismatched.first(), missing.first()) {
            (Some(mismatch), _) => mismatch.to_string(),
            (None, Some(name)) => name.clone(),
            (None, None) => return Ok(()),
        };
        Err(WeightsError::Incomplete { missing: missing.len(), mismatched: mismatched.len(), first })
    }

    /// Reads the parameters instead of writing them: shapes and values by name.
    ///
    /// # Errors
    /// The errors of [`Self::complete`]; a truncated checkpoint.
    pub fn values(&self, source: &mut Source) -> Result<ParameterValues> {
        self.complete()?;
        let mut parameters = BTreeMap::new();
        for (name, planned) in &self.parameters {
            let mut values = Vec::with_capacity(planned.shape.iter().product());
            planned.stream(source, |piece| {
                values.extend_from_slice(piece);
                Ok(())
            })?;
            parameters.insert(name.clone(), (planned.shape.clone(), values));
        }
        Ok(parameters)
    }

    /// Number of values that will be written.
    pub fn num_parameters(&self) -> usize {
        self.parameters.values().map(|planned| planned.shape.iter().product::<usize>()).sum()
    }
}

/// The checkpoint's naming scheme.
///
/// # Errors
/// Names of an unknown scheme.
pub fn naming_of(checkpoint: &Checkpoint) -> Result<Naming> {
    let names = checkpoint.tensors.keys().map(|name| strip_wrapper(name));
    Naming::detect(names).ok_or_else(|| WeightsError::UnknownNames {
        count: checkpoint.tensors.len(),
        examples: checkpoint.tensors.keys().take(3).map(|name| printable(name)).collect(),
    })
}

/// The naming scheme and the author of a checkpoint's weights. For a file that was converted before, once or several
/// times, they are in its metadata and describe the first file; if they are missing, the scheme is [`Naming::Ours`].
pub fn source_of(checkpoint: &Checkpoint, naming: Naming) -> (Naming, Option<&str>) {
    let entry = |key: &str| checkpoint.metadata.get(key).map(String::as_str);
    let stored = entry("source_names").filter(|_| naming == Naming::Ours).and_then(Naming::from_text);
    (stored.unwrap_or(naming), checkpoint.author.as_deref().or_else(|| entry("source_author")))
}

/// Whether a checkpoint contains a backbone and no detector: by its naming scheme or, if converted before, by its
/// names.
pub fn is_backbone_alone(checkpoint: &Checkpoint, naming: Naming) -> bool {
    let all_in_backbone = || checkpoint.tensors.keys().all(|name| strip_wrapper(name).starts_with(BACKBONE));
    naming.is_backbone_alone() || (naming == Naming::Ours && all_in_backbone())
}

/// Examples of parts that a user may name: the first two words of each parameter's name.
fn parts_of(expected: &BTreeMap<String, Vec<usize>>) -> Vec<String> {
    let parts: BTreeSet<String> =
        expected.keys().map(|name| name.split('.').take(2).collect::<Vec<_>>().join(".")).collect();
    parts.into_iter().collect()
}

/// Whether a parameter belongs to a part: `roi_heads.box` does not contain `roi_heads.box_head.fc1.weight`.
pub fn is_part_of(name: &str, part: &str) -> bool {
    let part = part.trim_end_matches('.');
    name.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Caffe2's norms have been folded into scale and shift: their mean is 0 and their variance 1, as in Detectron2.
fn stands_for_missing(naming: Naming, name: &str) -> Option<f32> {
    let folded = naming == Naming::Caffe2Resnet;
    match name.rsplit_once('.')?.1 {
        "running_mean" if folded => Some(0.0),
        "running_var" if folded => Some(1.0),
        _ => None,
    }
}

/// The values of a parameter from a tensor: rows of classes are moved to the target's order of classes; the shapes of
/// all other parameters must be equal. `None` if the tensor does not fit.
fn arrange(
    name: &str,
    tensor: &StoredTensor,
    shape: &[usize],
    naming: Naming,
    target: &Architecture,
) -> Option<Origin> {
    let from = if naming.background_is_first() { Background::First } else { Background::Last };
    let to = target.heads.as_ref().map(|heads| heads.background).filter(|_| naming != Naming::Ours).unwrap_or(from);
    let class_rows = from != to;
    let (rows, num_rows) = (*tensor.shape().first()?, *shape.first()?);
    if tensor.shape()[1..] != shape[1..] {
        return None;
    }
    let layer = name.strip_prefix("roi_heads.").and_then(|layer| layer.rsplit_once('.')).map(|(layer, _)| layer);
    // The number of rows is checked first, because it comes from the file and the list of rows takes memory.
    let moved = match layer.filter(|_| class_rows) {
        Some("box_predictor.cls_score") if rows == num_rows => move_background(rows, to),
        // One set of deltas for all classes has no background.
        Some("box_predictor.bbox_pred") if target.heads.as_ref()?.class_specific_boxes => {
            drop_or_add_background(rows, num_rows, DELTAS, to)?
        }
        Some("mask_head.predictor") => drop_or_add_background(rows, num_rows, 1, to)?,
        _ if rows == num_rows => return Some(Origin::Tensor(tensor.clone())),
        _ => return None,
    };
    Some(Origin::Rows(tensor.clone(), moved))
}

/// The rows of all classes, with the background moved from one end to the other.
fn move_background(rows: usize, to: Background) -> Vec<Option<usize>> {
    match to {
        Background::Last => (1..rows).chain([0]).map(Some).collect(),
        Background::First => (rows - 1..rows).chain(0..rows - 1).map(Some).collect(),
    }
}

/// The rows of all classes, either without the background's rows, or with rows of zeros for the background, which come
/// first and are unused.
fn drop_or_add_background(
    rows: usize,
    num_rows: usize,
    rows_a_class: usize,
    to: Background,
) -> Option<Vec<Option<usize>>> {
    match to {
        Background::Last if rows.checked_sub(rows_a_class) == Some(num_rows) => {
            Some((rows_a_class..rows).map(Some).collect())
        }
        Background::First if num_rows.checked_sub(rows_a_class) == Some(rows) => {
            Some(std::iter::repeat_n(None, rows_a_class).chain((0..rows).map(Some)).collect())
        }
        _ => None,
    }
}

impl Planned {
    /// Passes the values in order, in pieces.
    pub(crate) fn stream(&self, source: &mut Source, mut take: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
        match &self.origin {
            Origin::Tensor(tensor) => tensor.stream(source, take),
            Origin::Rows(tensor, rows) => {
                let values = tensor.values(source)?;
                let width: usize = self.shape[1..].iter().product();
                let zeros = vec![0.0; width];
                rows.iter().try_for_each(|row| match row {
                    Some(row) => take(&values[row * width..][..width]),
                    None => take(&zeros),
                })
            }
            Origin::Constant(value) => take(&vec![*value; self.shape.iter().product()]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_background_moves_to_the_other_end() {
        let numbers =
            |rows: Vec<Option<usize>>| rows.into_iter().map(|row| row.map_or(-1, |r| r as i64)).collect::<Vec<_>>();
        assert_eq!(numbers(move_background(3, Background::Last)), [1, 2, 0]);
        assert_eq!(numbers(move_background(3, Background::First)), [2, 0, 1]);
        assert_eq!(numbers(drop_or_add_background(8, 4, 4, Background::Last).unwrap()), [4, 5, 6, 7]);
        let added = drop_or_add_background(4, 8, 4, Background::First).unwrap();
        assert_eq!(numbers(added), [-1, -1, -1, -1, 0, 1, 2, 3]);
        assert!(drop_or_add_background(3, 4, 4, Background::Last).is_none());
    }

    #[test]
    fn parts_end_at_dots() {
        assert!(is_part_of("roi_heads.box_predictor.cls_score.weight", "roi_heads.box_predictor"));
        assert!(is_part_of("roi_heads.box_predictor.cls_score.weight", "roi_heads.box_predictor."));
        assert!(!is_part_of("roi_heads.box_predictor.cls_score.weight", "roi_heads.box"));
    }
}
