//! `sdg rehearse`: grasp attempts in MuJoCo with a taught model.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use sdg_grasp::{GraspError, Verification};
use sdg_report::AttemptSummary;
use serde_json::json;

use super::RehearseArgs;
use crate::camera_files::CameraFile;
use crate::commands::devices;
use crate::exit::Outcome;
use crate::files;
use crate::interrupt::Interrupt;
use crate::parts::part_named;
use crate::rehearsal::{Rehearsal, RehearsalErrors, Rehearsed, step_name};
use crate::run_page::{self, RunPage};

/// Attempts, then the report; Ctrl-C reports the attempts so far.
pub fn run(args: &RehearseArgs) -> Result<Outcome> {
    let object = part_named("--object", &args.object)?;
    let model = files::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    let camera = args.camera.as_deref().map(CameraFile::read_intrinsics).transpose()?;
    if camera.is_some() && model.facts().lengths.is_none() {
        return Err(GraspError::NoLengths).with_context(|| args.grasp_model.display().to_string());
    }
    files::prepare_folder(&args.out)?;
    let verification = if args.no_verify { Verification::Off } else { Verification::ByShape };
    let rehearsal = Rehearsal {
        model: &model,
        object: &object,
        attempts: args.attempts,
        seed: args.seed,
        verification,
        errors: RehearsalErrors::default(),
        camera,
    };
    let interrupt = Interrupt::watch();
    let rehearsed = rehearsal.run(&mut |attempt| show_attempt(attempt, args.attempts, &interrupt))?;
    let mut command = format!(
        "sdg rehearse --grasp-model {} --object {} --attempts {} --seed {}",
        args.grasp_model.display(),
        args.object,
        args.attempts,
        args.seed
    );
    if let Some(camera) = &args.camera {
        command += &format!(" --camera {}", camera.display());
    }
    let page = RunPage { model: &model, object: &object, rehearsed: &rehearsed, command: &command };
    let report = run_page::rehearsal(&page)?.write(&args.out)?;
    finish(&page, None, &report, args.json)
}

/// A line for each attempt; breaks when Ctrl-C was pressed.
pub fn show_attempt(attempt: &AttemptSummary, of: u32, interrupt: &Interrupt) -> ControlFlow<()> {
    let error = attempt
        .detection_error
        .map(|e| format!(", detected {:.1} mm and {:.1}° off", e.distance_mm, e.angle_deg))
        .unwrap_or_default();
    let outcome = if attempt.success {
        "grasped and held".to_owned()
    } else {
        format!("failed at {}: {}", step_name(attempt), attempt.why)
    };
    eprintln!("attempt {} of {of}: {outcome}{error} ({:.1} s)", attempt.number, attempt.duration_secs);
    if interrupt.is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// The closing lines, or the one object of `--json` (docs/command-line.md).
pub fn finish(page: &RunPage, teach_seconds: Option<f64>, report: &std::path::Path, json: bool) -> Result<Outcome> {
    let RunPage { model, object, rehearsed, .. } = page;
    let Rehearsed { attempts, .. } = rehearsed;
    let (successes, of) = (rehearsed.successes(), attempts.len());
    if json {
        let mut line = json!({
            "model": model.kind().letter(),
            "object": object.name,
            "attempts": of,
            "successes": successes,
            "failures": rehearsed.failures(),
            "report": report.display().to_string(),
        });
        if let Some(seconds) = teach_seconds {
            line["teach_seconds"] = json!(seconds);
        }
        println!("{line}");
    } else {
        if let Some(seconds) = teach_seconds {
            println!("taught the {} from one photo in {seconds:.0} s", object.title.to_lowercase());
        }
        println!("grasped it in {successes} of {of} attempts");
        println!("report: {}", report.display());
    }
    Ok(if rehearsed.found_nothing() { Outcome::NothingToGrasp } else { Outcome::Done })
}
