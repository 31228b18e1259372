//! Evaluation of a model on labelled pictures.

use std::path::Path;

use sdg_evaluation::NoProgress;
use sdg_evaluation::labelled_pictures::{Evaluated, LabelledFolder, TestedFolder, page, to_json};
use sdg_grasp::Verification;

use crate::fault::{Fault, FaultKind, Result};
use crate::model::{Model, View};
use crate::threads::on_threads;

/// Evaluates a model on a folder of labelled pictures like `sdg evaluate --pictures`, writes the page to `report`, and
/// returns the figures as JSON.
///
/// # Errors
/// `min_score` is outside 0 to 1, labels cannot be read or belong to other pictures, detection fails, or the page
/// cannot be written.
pub fn evaluate(
    model: &Model,
    folder: &Path,
    view: &View,
    label: Option<&str>,
    min_score: f64,
    report: &Path,
) -> Result<String> {
    if !(0.0..=1.0).contains(&min_score) {
        return Err(Fault::new(FaultKind::Argument, format!("expected min_score from 0 to 1, found {min_score}")));
    }
    let verification = Verification::ByShape;
    on_threads(view.threads, || {
        let perception = model.perception(view.camera.as_ref(), view.region)?;
        let labelled =
            LabelledFolder::read(folder, &perception, label).map_err(Fault::of_kind_or(FaultKind::Teaching))?;
        sdg_files::prepare_folder(report)?;
        let TestedFolder { tested, left_out, others, foreign_label, .. } =
            labelled.test(&perception, verification, min_score, &|| false, &NoProgress)?;
        let evaluated = Evaluated {
            folder,
            // The model may not come from a file.
            model_file: Path::new(""),
            model: perception.model(),
            verification,
            min_score,
            tested,
            left_out,
            others,
            foreign_label,
        };
        let page = page(&evaluated, "sdg.evaluate (Python)")?.write(report).map_err(anyhow::Error::from)?;
        Ok(to_json(&evaluated, &page).to_string())
    })?
}
