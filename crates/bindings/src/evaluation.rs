//! Evaluation of a model on labelled pictures.

use std::path::Path;

use sdg_cell::CellError;
use sdg_evaluation::labelled_pictures::{Evaluated, LabelledFolder, LeftOut, Tested, page, to_json};
use sdg_grasp::{GraspError, Verification};

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
        let mut labelled =
            LabelledFolder::read(folder, &perception, label).map_err(Fault::of_kind_or(FaultKind::Teaching))?;
        sdg_files::prepare_folder(report)?;
        let mut tested = Vec::new();
        for picture in labelled.pictures {
            let file = picture.name();
            match Tested::detect(picture, &perception, verification) {
                Ok(of_picture) => tested.push(of_picture),
                // The model's region does not fit a picture of this size.
                Err(error) if matches!(error.downcast_ref(), Some(CellError::Grasp(GraspError::Region(_)))) => {
                    labelled.left_out.push(LeftOut { file, why: error.root_cause().to_string() });
                }
                Err(error) => return Err(error.into()),
            }
        }
        let evaluated = Evaluated {
            folder,
            // The model may not come from a file.
            model_file: Path::new(""),
            model: perception.model(),
            verification,
            min_score,
            tested,
            left_out: labelled.left_out,
            others: labelled.others,
        };
        let page = page(&evaluated, "sdg.evaluate (Python)")?.write(report).map_err(anyhow::Error::from)?;
        Ok(to_json(&evaluated, &page).to_string())
    })?
}
