//! `sdg evaluate --cameras`: parts taught with one calibrated camera, detected with other cameras.

use anyhow::{Result, bail};
use sdg_evaluation::Store;
use sdg_evaluation::cameras::{CamerasEvaluation, CamerasSummary, MAX_PHOTOS, PictureSet};
use sdg_grasp::ModelKind;
use sdg_simulation::objects::ObjectSpec;
use serde_json::json;

use super::args::EvaluateArgs;
use super::model_names::models;
use super::selection::{jobs, objects, settings};
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::progress::EvaluationProgress;

const _: () = assert!(MAX_PHOTOS == 3, "the range of --photos in args.rs");

/// Runs the remaining units, then writes the tables of all finished ones; also after Ctrl-C.
pub fn run(args: &EvaluateArgs, names: &[String]) -> Result<Outcome> {
    let sets = sets(names)?;
    let models = models(&args.models, &[ModelKind::S, ModelKind::C])?;
    let objects = objects(&args.objects, ObjectSpec::names())?;
    let (preset, settings) = settings(args, &models)?;
    let store = Store::open(&args.out, &settings)?;
    let report_folder = args.report.clone().unwrap_or_else(|| args.out.join("cameras"));
    sdg_files::prepare_folder(&report_folder)?;

    let jobs = jobs(args);
    let evaluation = CamerasEvaluation {
        models: &models,
        objects: &objects,
        sets: &sets,
        preset,
        store: &store,
        views: args.axis_views,
        photos: args.photos,
        jobs,
    };
    let interrupt = Interrupt::watch();
    let progress = EvaluationProgress::new();
    let ended = evaluation.run(&|| interrupt.is_requested(), &progress);
    progress.finish();
    ended?;

    let summary = CamerasSummary::collect(&evaluation)?;
    let command = command(args, names);
    let [tables, report] = summary.write(&store, jobs, &command, &report_folder)?;
    if args.json {
        let (tables, report) = (tables.display().to_string(), report.display().to_string());
        println!("{}", json_line(&json!({ "summary": summary, "tables": tables, "report": report }))?);
    } else {
        print!("{}", summary.lines());
        println!("tables: {}\nreport: {}", tables.display(), report.display());
    }
    match summary.remaining {
        0 => Ok(Outcome::Done),
        remaining => bail!("interrupted with {remaining} units of work left: run the same command again to continue"),
    }
}

/// The picture sets with these names; all sets if there are no names.
fn sets(names: &[String]) -> Result<Vec<PictureSet>> {
    let all = PictureSet::all();
    if names.is_empty() {
        return Ok(all);
    }
    let known = || all.iter().map(|set| set.name()).collect::<Vec<_>>().join(", ");
    let mut sets = Vec::new();
    for name in names {
        let found = all.iter().copied().find(|set| set.name() == name);
        let set = found.ok_or_else(|| Usage(format!("--cameras: expected a set out of {}, found {name}", known())))?;
        if sets.contains(&set) {
            return Err(Usage(format!("--cameras: expected each set once, found {name} again")).into());
        }
        sets.push(set);
    }
    Ok(sets)
}

/// The command that reproduces the results.
fn command(args: &EvaluateArgs, names: &[String]) -> String {
    let mut words = vec!["sdg evaluate --cameras".to_owned()];
    words.extend((!names.is_empty()).then(|| names.join(",")));
    words.extend((!args.models.is_empty()).then(|| format!("--models {}", args.models.join(","))));
    words.extend((!args.objects.is_empty()).then(|| format!("--objects {}", args.objects.join(","))));
    words.push(format!("--axis-views {} --preset {}", args.axis_views, args.preset));
    words.extend((args.photos > 1).then(|| format!("--photos {}", args.photos)));
    words.extend(args.steps.map(|steps| format!("--steps {steps}")));
    words.extend(args.time_budget.map(|secs| format!("--time-budget {secs}")));
    words.push(format!("--seed {}", args.seed));
    words.join(" ")
}
