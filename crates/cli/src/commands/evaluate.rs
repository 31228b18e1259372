//! `sdg evaluate`: the paper's protocol, and its tables.

use std::fmt::Write;

use anyhow::{Result, bail};
use sdg_grasp::{GraspError, ModelKind, Preset};
use sdg_simulation::objects::ObjectSpec;
use serde_json::json;

use crate::args::EvaluateArgs;
use crate::evaluation::{Evaluation, EvaluationProgress, PartGroup, Settings, Store, Summary, markdown, page};
use crate::exit::{Outcome, Usage};
use crate::files;
use crate::interrupt::Interrupt;
use crate::machine::machine;

/// The preset, and what the store's results depend on.
///
/// # Errors
/// No preset of that name.
pub(super) fn settings(args: &EvaluateArgs) -> Result<(Preset, Settings)> {
    let preset: Preset = args.preset.parse().map_err(|error: GraspError| Usage(format!("--preset: {error}")))?;
    let settings = Settings {
        protocol: Settings::PROTOCOL,
        preset: preset.name().to_owned(),
        steps: args.steps,
        seed: args.seed,
        attempts: args.attempts,
        views: args.views,
        scenes: args.scenes,
    };
    Ok((preset, settings))
}

/// Units of work side by side: as asked for, else one for each core.
pub(super) fn jobs(args: &EvaluateArgs) -> usize {
    args.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), |jobs| jobs as usize)
}

/// Does what is still to do, then writes the tables of all that there is: after Ctrl-C, too.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    if let Some(names) = &args.axes {
        return super::evaluate_axes::run(args, names);
    }
    if let Some(names) = &args.cameras {
        return super::evaluate_cameras::run(args, names);
    }
    let models = models(&args.models)?;
    let objects = objects(&args.objects, ObjectSpec::paper_names())?;
    let (preset, settings) = settings(args)?;
    let store = Store::open(&args.out, &settings)?;
    let report_folder = args.report.as_ref().unwrap_or(&args.out);
    files::prepare_folder(report_folder)?;

    let jobs = jobs(args);
    let evaluation =
        Evaluation { models: &models, objects: &objects, preset, store: &store, unverified: args.unverified, jobs };
    let interrupt = Interrupt::watch();
    let progress = EvaluationProgress::new();
    let ended = evaluation.run(&|| interrupt.is_requested(), &progress);
    progress.finish();
    let interrupted = ended?.is_break();

    let summaries = Summary::collect(&evaluation)?;
    let remaining = evaluation.remaining()?;
    let command = command(args, &settings);
    let facts = [
        ("seed", settings.seed.to_string()),
        ("preset", settings.preset.clone()),
        ("side by side", format!("{jobs} units of work")),
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
    let report = page(&summaries, &store, &facts, &command)?.write(report_folder)?;

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
        println!("{line}");
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
    if interrupted {
        bail!("interrupted with {remaining} units of work to do: the same command goes on");
    }
    Ok(Outcome::Done)
}

pub(super) fn models(letters: &[String]) -> Result<Vec<ModelKind>> {
    if letters.is_empty() {
        return Ok(ModelKind::ALL.to_vec());
    }
    let mut models = Vec::new();
    for letter in letters {
        let model = letter.trim().parse().map_err(|error: GraspError| Usage(format!("--models: {error}")))?;
        if models.contains(&model) {
            return Err(Usage(format!("--models: expected each letter once, found {model} again")).into());
        }
        models.push(model);
    }
    Ok(models)
}

/// The parts of these names; without a name, `all`.
pub(super) fn objects(names: &[String], all: impl Iterator<Item = &'static str>) -> Result<Vec<ObjectSpec>> {
    let names: Vec<String> = if names.is_empty() { all.map(str::to_owned).collect() } else { names.to_vec() };
    let mut objects: Vec<ObjectSpec> = Vec::new();
    for name in names {
        let object = ObjectSpec::by_name(name.trim()).map_err(|error| Usage(format!("--objects: {error}")))?;
        if objects.iter().any(|known| known.name == object.name) {
            return Err(Usage(format!("--objects: expected each part once, found {} again", object.name)).into());
        }
        objects.push(object);
    }
    Ok(objects)
}

/// The command that gives the same results.
fn command(args: &EvaluateArgs, settings: &Settings) -> String {
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
    option("seed", &settings.seed);
    if args.unverified { command + " --unverified" } else { command }
}
