//! Teaching by the node's services, which use the functions of `sdg teach`.

use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_grasp::{Device, TeachOptions};
use sdg_inputs::TeachingFiles;
use sdg_ros2_node::TeachJob;

use super::args::TeachTriggerArgs;
use crate::commands::teach::teach_to_file;
use crate::demonstrations::photo_and_marks;
use crate::interrupt::Interrupt;
use crate::shared_args::{TaughtCameraArgs, height_mm};

/// The teaching of the Trigger service; `None` without its arguments.
pub(super) fn trigger_job(args: &TeachTriggerArgs) -> Option<TeachJob> {
    Some(TeachJob {
        photo: args.teach_demo.clone()?,
        marks: None,
        out: args.teach_out.clone()?,
        model: args.teach_model.clone(),
        seed: TeachJob::DEFAULT_SEED,
        time_budget: None,
        mark_height_mm: args.teach_mark_height_mm,
        is_used: true,
    })
}

/// The options of a job, on the node's device.
fn options(job: &TeachJob, device: &Device) -> Result<TeachOptions> {
    let mut options = TeachOptions::new(job.seed);
    options.kind = job.model.parse().context("model")?;
    options.time_budget = job.time_budget;
    options.device = device.clone();
    Ok(options)
}

/// Teaches a model and writes it; `device` and `camera` are the node's device and its camera file.
///
/// # Errors
/// The errors of `sdg teach`; a height of marks is given without a camera; or the written model fails on its held-out
/// samples.
pub(super) fn teach(job: &TeachJob, device: &Device, camera: Option<&Path>, interrupt: &Interrupt) -> Result<()> {
    let demonstration = match &job.marks {
        Some(marks) => (job.photo.clone().into(), marks.clone()),
        None => photo_and_marks(&job.photo)?,
    };
    let camera = match job.mark_height_mm {
        Some(mark_height_mm) => {
            let mark_height_mm = height_mm(&mark_height_mm.to_string()).map_err(anyhow::Error::msg);
            let mark_height_mm = Some(mark_height_mm.context("mark_height_mm")?);
            let camera = camera.context("mark_height_mm: expected a node that was started with --camera")?;
            let of_camera = TaughtCameraArgs { file: None, mark_height_mm, grasp_height_mm: None };
            Some((camera, of_camera.heights_m()))
        }
        None => None,
    };
    let mut options = options(job, device)?;
    let files = TeachingFiles { demonstrations: &[demonstration], negatives: &[], camera };
    let demonstrations = files.read(&mut options)?;
    // The node may have read the file as its model.
    let own = Some(job.out.as_path());
    sdg_files::check_extendable(&job.out, own)?;
    sdg_inputs::check_replaces_a_model(&job.out)?;
    let (_, figures) = teach_to_file(&demonstrations, &options, (&job.out, own), interrupt)?;
    check_figures(&job.out, figures.failure())
}

/// Refuses a written model that fails on its held-out samples, so that the node does not use it.
fn check_figures(out: &Path, failure: Option<String>) -> Result<()> {
    match failure {
        Some(failure) => bail!("{} was taught, but {failure}", out.display()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_fails_on_its_samples_is_no_success() {
        let out = Path::new("part.sdg");
        check_figures(out, None).unwrap();
        let error = check_figures(out, Some("the model fails".to_owned())).unwrap_err().to_string();
        assert_eq!(error, "part.sdg was taught, but the model fails");
    }

    #[cfg(feature = "ndarray")]
    #[test]
    fn a_service_teaches_on_the_device_of_the_node() {
        use sdg_grasp::ComputeBackend;

        let args = TeachTriggerArgs {
            teach_demo: Some("part.png".to_owned()),
            teach_out: Some("part.sdg".into()),
            teach_model: "S".to_owned(),
            teach_mark_height_mm: None,
        };
        let device = ComputeBackend::NdArray.open().unwrap();
        assert_eq!(options(&trigger_job(&args).unwrap(), &device).unwrap().device, device);
    }
}
