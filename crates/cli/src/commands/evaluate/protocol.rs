//! The paper's protocol, and its tables.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Result, bail};
use sdg_evaluation::machine;
use sdg_evaluation::{Evaluation, PartGroup, Settings, Store, Summary, markdown, page};
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

/// Does what is still to do, then writes the tables of all that there is: after Ctrl-C, too.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    let models = models(&args.models, &ModelKind::ALL)?;
    let objects = objects(&args.objects, ObjectSpec::paper_names())?;
    let (preset, settings) = settings(args)?;
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
        bail!("interrupted with {remaining} units of work to do: the same command goes on");
    }
    Ok(Outcome::Done)
}

/// Where the page goes.
pub(super) fn report_folder(args: &EvaluateArgs) -> &Path {
    args.report.as_ref().unwrap_or(&args.out)
}

/// Writes the tables of what there is, prints them in brief, and says how many units are still to do. `settings` are what the
/// reader is told.
pub(super) fn write_tables(args: &EvaluateArgs, evaluation: &Evaluation, settings: &Settings) -> Result<usize> {
    let store = evaluation.store;
    let summaries = Summary::collect(evaluation)?;
    let remaining = evaluation.remaining()?;
    let command = command(args, settings);
    let facts = [
        ("seed", settings.seed.to_string()),
        ("preset", settings.preset.clone()),
        ("side by side", format!("{} units of work", evaluation.jobs)),
        ("machine", machine()),
        ("version", format!("sdg {}", env!("CARGO_PKG_VERSION"))),
    ];
    store.write_bytes("tables.md", markdown(&summaries, &facts, &command).as_bytes())?;
    let of_group = |group: PartGroup| summaries.iter().find(|summary| summary.group == group);
    let [paper, held_out] = PartGroup::ALL.map(of_group);
    let json = json!({
        "models": paper.map_or(&[][..], |summary| &summary.models),
        "cells": paper.map_or(&[][..], |summary| &summary.cells),
        "held_out": held_out.map(|summary| json!({ "models": summary.models, "cells": summary.cells })),
        "settings": settings,
        "remaining": remaining,
        "machine": machine(),
        "command": command,
    });
    store.write_bytes("tables.json", format!("{json:#}\n").as_bytes())?;
    let report = page(&summaries, store, &facts, &command)?.write(report_folder(args))?;

    let tables = store.path("tables.md");
    if args.json {
        let line = json!({
            "models": paper.map_or(&[][..], |summary| &summary.models),
            "held_out": held_out.map(|summary| json!({ "models": summary.models })),
            "remaining": remaining,
            "tables": tables.display().to_string(),
            "cells": store.path("tables.json").display().to_string(),
            "report": report.display().to_string(),
        });
        println!("{}", json_line(&line)?);
    } else {
        for summary in &summaries {
            let of = if summary.group == PartGroup::HeldOut { " (held-out parts)" } else { "" };
            for model in &summary.models {
                let figures = &model.verified;
                println!(
                    "{}{of}: held {} ({} at the first look), right {}, false alarms {}",
                    model.model, figures.held, figures.held_at_first_look.count, figures.right, figures.false_alarms
                );
            }
        }
        println!("tables: {}\nreport: {}", tables.display(), report.display());
    }
    Ok(remaining)
}

/// The command that gives the same results.
pub(super) fn command(args: &EvaluateArgs, settings: &Settings) -> String {
    let mut command = "sdg evaluate".to_owned();
    let mut option = |name: &str, value: &dyn std::fmt::Display| {
        // Writing into a string cannot fail.
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
