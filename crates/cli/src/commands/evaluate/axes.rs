//! `sdg evaluate --axes`: pictures along one axis of difficulty at a time, and grasps under errors.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use sdg_evaluation::axes::{
    Against, AxesEvaluation, AxesSummary, GRASPING_MODELS, RunEnd, Selection, difference_lines, summary_lines,
};
use sdg_evaluation::{Store, quoted};
use sdg_grasp::ModelKind;
use sdg_simulation::objects::ObjectSpec;
use serde_json::json;

use super::args::{DEFAULT_PICTURES, EvaluateArgs};
use super::model_names::models;
use super::selection::{jobs, objects, settings};
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::progress::EvaluationProgress;

/// Runs the remaining units, then writes the tables of all finished ones; also after Ctrl-C.
pub fn run(args: &EvaluateArgs, names: &[String]) -> Result<Outcome> {
    let selection = Selection::parse(names).map_err(|error| Usage(format!("--axes: {error}")))?;
    if args.against.is_some() && selection.axes.is_empty() {
        return Err(Usage("--against: expected axes of pictures in --axes, found only grasps".into()).into());
    }
    let models = models(&args.models, &ModelKind::ALL)?;
    if selection.axes.is_empty() && !GRASPING_MODELS.iter().any(|model| models.contains(model)) {
        let letters = |models: &[ModelKind]| models.iter().map(|model| model.letter()).collect::<Vec<_>>();
        let (grasping, found) = (letters(&GRASPING_MODELS).join(" or "), letters(&models).join(", "));
        return Err(Usage(format!("--models: expected {grasping} for the grasps of --axes, found {found}")).into());
    }
    let objects = objects(&args.objects, ObjectSpec::names())?;
    let (preset, settings) = settings(args, &models)?;
    let store = Store::open(&args.out, &settings)?;
    let against = args.against.as_deref().map(Against::open).transpose().context("--against")?;
    // The page has its own folder, so that the page of the paper's protocol is kept.
    let report_folder = args.report.clone().unwrap_or_else(|| args.out.join("axes"));
    sdg_files::prepare_folder(&report_folder)?;

    let jobs = jobs(args);
    let evaluation = AxesEvaluation {
        models: &models,
        objects: &objects,
        selection: &selection,
        preset,
        store: &store,
        axis_views: args.axis_views,
        search_points: args.search_points,
        jobs,
    };
    let interrupt = Interrupt::watch();
    let progress = EvaluationProgress::new();
    let ended = evaluation.run(&|| interrupt.is_requested(), &progress);
    progress.finish();
    let RunEnd { remaining, failures } = ended?;

    let summary = AxesSummary::collect(&evaluation)?;
    let command = command(args, names);
    let comparisons = against.as_ref().map(|against| against.compare(&evaluation)).transpose()?.unwrap_or_default();
    let other = against.as_ref().map(Against::folder);
    let [tables, report] = summary.write(&store, jobs, (&comparisons, other), &command, &report_folder)?;
    if args.json {
        let line = json!({
            "summary": summary,
            "against": comparisons,
            "tables": tables.display().to_string(),
            "report": report.display().to_string(),
        });
        println!("{}", json_line(&line)?);
    } else {
        print!("{}{}", summary_lines(&summary), difference_lines(&comparisons));
        println!("worker seconds: {}", summary.seconds);
        println!("tables: {}\nreport: {}", tables.display(), report.display());
    }
    match (failures.first(), remaining) {
        (None, 0) => match other.filter(|_| comparisons.is_empty()) {
            Some(other) => bail!(
                "--against {}: expected results of these models on pictures of these parts and axes, found none",
                other.display()
            ),
            None => Ok(Outcome::Done),
        },
        (None, _) => bail!("interrupted with {remaining} units of work left: run the same command again to continue"),
        (Some(first), _) => bail!(
            "{} units of work failed, {remaining} are left: run the same command again to retry; the first error: {first}",
            failures.len()
        ),
    }
}

/// The command that reproduces the results.
fn command(args: &EvaluateArgs, names: &[String]) -> String {
    let mut command = "sdg evaluate --axes".to_owned();
    let mut option = |name: &str, value: &dyn std::fmt::Display| {
        // Writing to a string cannot fail.
        let _ = write!(command, "{}{value}", if name.is_empty() { " ".to_owned() } else { format!(" --{name} ") });
    };
    if !names.is_empty() {
        option("", &names.join(","));
    }
    if !args.models.is_empty() {
        option("models", &args.models.join(","));
    }
    if !args.objects.is_empty() {
        option("objects", &args.objects.join(","));
    }
    option("axis-views", &args.axis_views);
    option("attempts", &args.attempts);
    // Attempts without an error are shared with the paper's protocol: they are stored with all of its settings.
    for (name, number) in [("views", args.views), ("scenes", args.scenes)] {
        if number != DEFAULT_PICTURES {
            option(name, &number);
        }
    }
    if let Some(points) = args.search_points {
        option("search-points", &points);
    }
    if let Some(folder) = &args.against {
        option("against", &quoted(&folder.display().to_string()));
    }
    option("preset", &args.preset);
    if let Some(steps) = args.steps {
        option("steps", &steps);
    }
    if let Some(secs) = args.time_budget {
        option("time-budget", &secs);
    }
    option("seed", &args.seed);
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;

    #[test]
    fn the_command_of_the_page_has_the_settings_of_its_records() {
        let repeated = |line: &str| {
            let Command::Evaluate(args) = Args::try_parse_from(line.split(' ')).unwrap().command else {
                panic!("another command")
            };
            command(&args, args.axes.as_deref().unwrap())
        };
        let line =
            "sdg evaluate --axes no-error --axis-views 2 --attempts 3 --views 4 --scenes 5 --preset edge --seed 1";
        assert_eq!(repeated(line), line);
        assert!(!repeated("sdg evaluate --axes").contains("--views"));
    }
}
