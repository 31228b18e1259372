//! The paper's protocol, and its tables.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Result, bail};
use sdg_evaluation::{Evaluation, PartGroup, Settings, Store, WrittenTables};
use sdg_grasp::ModelKind;
use sdg_simulation::objects::ObjectSpec;
use serde_json::json;

use super::args::EvaluateArgs;
use super::model_names::models;
use super::selection::{jobs, objects, settings};
use crate::exit::Outcome;
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::progress::EvaluationProgress;

/// Runs the remaining units, then writes the tables of all finished ones; also after Ctrl-C.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    let models = models(&args.models, &ModelKind::ALL)?;
    let objects = objects(&args.objects, ObjectSpec::paper_names())?;
    let (preset, settings) = settings(args, &models)?;
    let store = Store::open(&args.out, &settings)?;
    sdg_files::prepare_folder(report_folder(args))?;

    let jobs = jobs(args);
    let evaluation =
        Evaluation { models: &models, objects: &objects, preset, store: &store, unverified: args.unverified, jobs };
    let interrupt = Interrupt::watch();
    let progress = EvaluationProgress::new();
    let ended = evaluation.run(&|| interrupt.is_requested(), &progress);
    progress.finish();
    let interrupted = ended?.is_break();

    let remaining = write_tables(args, &evaluation, &settings)?;
    if interrupted {
        bail!("interrupted with {remaining} units of work left: run the same command again to continue");
    }
    Ok(Outcome::Done)
}

/// The folder of the page.
pub(super) fn report_folder(args: &EvaluateArgs) -> &Path {
    args.report.as_ref().unwrap_or(&args.out)
}

/// Writes the tables of the finished units, prints a summary, and returns the number of remaining units. The page
/// states `settings`.
pub(super) fn write_tables(args: &EvaluateArgs, evaluation: &Evaluation, settings: &Settings) -> Result<usize> {
    let command = command(args, settings);
    let WrittenTables { summaries, remaining, cells, tables, report } =
        evaluation.write_tables(settings, &command, report_folder(args))?;
    let of_group = |group: PartGroup| summaries.iter().find(|summary| summary.group == group);
    let [paper, held_out] = PartGroup::ALL.map(of_group);
    if args.json {
        let line = json!({
            "models": paper.map_or(&[][..], |summary| &summary.models),
            "held_out": held_out.map(|summary| json!({ "models": summary.models })),
            "remaining": remaining,
            "tables": tables.display().to_string(),
            "cells": cells.display().to_string(),
            "report": report.display().to_string(),
        });
        println!("{}", json_line(&line)?);
    } else {
        summaries.iter().for_each(|summary| print!("{}", summary.lines()));
        println!("tables: {}\nreport: {}", tables.display(), report.display());
    }
    Ok(remaining)
}

/// The command that reproduces the results.
pub(super) fn command(args: &EvaluateArgs, settings: &Settings) -> String {
    let mut command = "sdg evaluate".to_owned();
    let mut option = |name: &str, value: &dyn std::fmt::Display| {
        // Writing to a string cannot fail.
        let _ = write!(command, " --{name} {value}");
    };
    if !args.models.is_empty() {
        option("models", &args.models.join(","));
    }
    if !args.objects.is_empty() {
        option("objects", &args.objects.join(","));
    }
    option("attempts", &settings.attempts);
    option("views", &settings.views);
    option("scenes", &settings.scenes);
    option("preset", &settings.preset);
    if let Some(steps) = settings.steps {
        option("steps", &steps);
    }
    if let Some(secs) = settings.time_budget {
        option("time-budget", &secs);
    }
    option("seed", &settings.seed);
    if args.unverified { command + " --unverified" } else { command }
}
