//! `sdg teach --demos DIR`: teaches many parts, compares them with each other, and writes one page.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Result, anyhow, bail};
use sdg_evaluation::many_parts::{
    DemonstrationFolder, PartDemonstrations, PartOutcome, PartOutcomes, PartStore, PartTeaching, page,
};
use sdg_evaluation::{Progress, quoted};
use sdg_weights_conversion::sha256_of;
use serde_json::{Value, json};

use super::teach::{NO_BASE_WEIGHTS, TeachArgs, options, read_base_weights, symmetry};
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::paint::{Paint, Tone};
use crate::progress::EvaluationProgress;

/// Teaches the parts whose outcome for these inputs is not stored yet. Then, unless `--part` selects single parts, runs
/// each model on every photo.
pub fn run(args: &TeachArgs, folder: &Path) -> Result<Outcome> {
    let mut options = options(args)?;
    read_base_weights(args, &mut options)?;
    let weights_sha256 = match &args.base_weights {
        // Not `None`, which stands for the included weights: finished parts of one are not parts of the other.
        Some(path) if path.as_os_str() == NO_BASE_WEIGHTS => Some(NO_BASE_WEIGHTS.to_owned()),
        path => path.as_deref().map(sha256_of).transpose()?,
    };
    let demonstrations = DemonstrationFolder::read(folder, symmetry)?;
    let asked = asked_for(args, &demonstrations.parts)?;
    let store = PartStore::open(&args.out)?;
    let (interrupt, progress) = (Interrupt::watch(), EvaluationProgress::new());
    let checks = if args.parts.is_empty() { asked.len() } else { 0 };
    progress.expect(asked.len() + checks);
    let teaching = PartTeaching {
        store: &store,
        options: &options,
        weights_sha256: weights_sha256.as_deref(),
        reinitialized: &args.reinitialized,
    };
    let outcomes = match teaching.run(&asked, &|| interrupt.is_requested(), &progress)? {
        ControlFlow::Continue(outcomes) => outcomes,
        ControlFlow::Break(next) => bail!("interrupted: run the same command again to continue with {next}"),
    };
    if checks == 0 {
        progress.finish();
        return told(args, outcomes);
    }
    let is_interrupted = || interrupt.is_requested();
    let checked = teaching.check(&asked, outcomes, demonstrations.left_out, &is_interrupted, &progress);
    progress.finish();
    let (findings, photos) = checked?;
    let report = page(&findings, &photos, &command(args, folder)).write(args.report.as_ref().unwrap_or(&args.out))?;
    if args.json {
        let mut line = findings.to_json();
        line["report"] = json!(report.display().to_string());
        println!("{line}");
    } else {
        println!("taught {} of {} parts", findings.taught.len(), findings.parts.len());
        for pair in &findings.look_alikes {
            let ([first, second], [there, back]) = (findings.names(pair), pair.scores);
            println!("look alike: {first} and {second} ({there:.2}, {back:.2})");
        }
        for (name, outcome) in &findings.parts {
            if let PartOutcome::Failed { why } = outcome {
                println!("not taught: {name}: {why}");
            }
        }
        // Parts without a model are among them as well.
        for (name, why) in findings.need_photo.iter().filter(|(name, _)| findings.taught.contains(name)) {
            println!("needs another photo: {name}: {why}");
        }
        for (photo, why) in &findings.left_out {
            println!("left out: {photo}: {why}");
        }
        println!("report: {}", report.display());
    }
    if findings.taught.is_empty() {
        bail!("{}: expected a part that can be taught, found none; the page has the reasons", folder.display());
    }
    let is_usable =
        |outcome: &PartOutcome| matches!(outcome, PartOutcome::Taught { .. }) && outcome.failure().is_none();
    let are_all_usable = findings.parts.iter().all(|(_, outcome)| is_usable(outcome));
    Ok(if are_all_usable { Outcome::Done } else { Outcome::ModelFails })
}

/// The parts selected by `--part`, or all parts.
fn asked_for<'a>(args: &TeachArgs, parts: &'a [PartDemonstrations]) -> Result<Vec<&'a PartDemonstrations>> {
    if args.parts.is_empty() {
        return Ok(parts.iter().collect());
    }
    let named = |name: &String| {
        parts.iter().find(|part| part.name == *name).ok_or_else(|| {
            let known: Vec<&str> = parts.iter().map(|part| part.name.as_str()).take(20).collect();
            Usage(format!("--part: expected a part of the folder, such as {}, found \"{name}\"", known.join(", ")))
                .into()
        })
    };
    args.parts.iter().map(named).collect()
}

/// Reports the parts selected by `--part`. If a part could not be taught, the call fails, as without `--demos`, after
/// all parts were reported; if a model fails its held-out samples, the outcome is that of a single part.
fn told(args: &TeachArgs, outcomes: PartOutcomes) -> Result<Outcome> {
    if args.json {
        let parts: Vec<Value> =
            outcomes.iter().map(|(name, outcome)| json!({ "name": name, "outcome": outcome })).collect();
        println!("{}", json!({ "parts": parts }));
    }
    let mut result = Ok(Outcome::Done);
    for (name, outcome) in outcomes {
        if let Some(failure) = outcome.failure() {
            eprintln!("{} {name}: {failure}", Paint::stderr().text(Tone::Doubtful, "warning:"));
            result = result.map(|_| Outcome::ModelFails);
        }
        // The program prints the last error.
        if let PartOutcome::Failed { why } = outcome
            && let Err(earlier) = std::mem::replace(&mut result, Err(anyhow!("{name}: {why}")))
        {
            eprintln!("not taught: {earlier}");
        }
    }
    result
}

/// The command that makes the same page again.
fn command(args: &TeachArgs, folder: &Path) -> String {
    let rest = super::teach::command(args);
    let rest = rest.strip_prefix("sdg teach").unwrap_or(&rest);
    format!("sdg teach --demos {}{rest}", quoted(&folder.display().to_string()))
}
