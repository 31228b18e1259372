//! `sdg evaluate --pictures`: tests a taught model on the user's own labelled pictures.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_evaluation::labelled_pictures::{Evaluated, LabelledFolder, TestedFolder, Totals, page, summary, to_json};
use sdg_evaluation::quoted;
use sdg_inputs::camera_files;

use super::args::EvaluateArgs;
use crate::commands::devices;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::progress::EvaluationProgress;
use crate::shared_args::{ComputeArgs, verification};

/// Default folder of the page, outside the folder of the user's pictures.
const DEFAULT_REPORT: &str = "target/pictures-report";

/// Reads and checks every label first, then searches the pictures in order.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    let (Some(folder), Some(model_file)) = (&args.pictures, &args.grasp_model) else {
        return Err(
            Usage("expected --pictures DIR and --grasp-model FILE, found one without the other".to_owned()).into()
        );
    };
    let model = sdg_inputs::read_model(model_file, &devices::open(&ComputeArgs { device: args.device })?)?;
    let detector = camera_files::perception(model, model_file, args.camera.as_deref())?;
    let model = detector.model();
    let labelled = LabelledFolder::read(folder, &detector, args.label.as_deref())?;
    if let Some(label) = &labelled.foreign_label {
        eprintln!("{}", of_another_part(label, model.object()));
    }
    let report_folder = args.report.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_REPORT));
    sdg_files::prepare_folder(&report_folder)?;

    let verification = verification(args.no_verify, model);
    let progress = EvaluationProgress::new();
    let (interrupt, num_pictures) = (Interrupt::watch(), labelled.pictures.len());
    let ended = labelled.test(&detector, verification, args.min_score, &|| interrupt.is_requested(), &progress);
    progress.finish();
    let TestedFolder { tested, left_out, others, foreign_label, is_interrupted } = ended?;

    let evaluated = Evaluated {
        folder,
        model_file,
        model,
        verification,
        min_score: args.min_score,
        tested,
        left_out,
        others,
        foreign_label,
    };
    let report = page(&evaluated, &command(args, folder, model_file))?.write(&report_folder)?;
    let judged = evaluated.judged();
    let totals = Totals::of(&judged);
    if args.json {
        println!("{}", json_line(&to_json(&evaluated, &report))?);
    } else {
        print!("{}", summary(&evaluated, &totals));
        println!("report: {}", report.display());
    }
    if is_interrupted {
        bail!("interrupted after {} of {num_pictures} pictures", evaluated.tested.len());
    }
    let found_nothing = totals.found.of > 0 && judged.iter().all(|judged| judged.hits.is_empty());
    Ok(if found_nothing { Outcome::NothingToGrasp } else { Outcome::Done })
}

/// The message about labels that all have another name than the model's part.
fn of_another_part(label: &str, object: &str) -> String {
    format!(
        "all labels are `{label}`, the model's part is `{object}`: they count as the part; --label {} counts the \
         pictures as without it",
        quoted(object)
    )
}

/// The command that reproduces the results.
fn command(args: &EvaluateArgs, folder: &Path, model_file: &Path) -> String {
    let mut command = "sdg evaluate".to_owned();
    let mut option = |name: &str, value: &str| command += &format!(" --{name} {}", quoted(value));
    option("pictures", &folder.display().to_string());
    option("grasp-model", &model_file.display().to_string());
    option("min-score", &args.min_score.to_string());
    if let Some(camera) = &args.camera {
        option("camera", &camera.display().to_string());
    }
    if let Some(label) = &args.label {
        option("label", label);
    }
    command += &ComputeArgs { device: args.device }.in_command();
    if args.no_verify { command + " --no-verify" } else { command }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_label_can_be_pasted_into_a_shell() {
        let told = of_another_part("bolt", "my part");
        assert!(told.contains("the model's part is `my part`") && told.contains("--label 'my part' counts"), "{told}");
    }
}
