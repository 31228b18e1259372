//! Starts both sides of every chosen work, runs the sides alternately, and writes medians.

pub(crate) mod machine;
mod pace;
mod prepare;
mod report;
mod worker_process;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args as ClapArgs;

use crate::protocol::Facts;
use crate::registry::{GEMM, Side, WORKS, WorkSpec};
use machine::Machine;
use pace::Pace;
use prepare::Paths;
use report::{Measured, Report};
use worker_process::WorkerProcess;
pub(crate) use worker_process::peak_of_status;

/// `sdg-bench compare`
#[derive(Debug, ClapArgs)]
#[command(after_help = known_works())]
pub struct CompareArgs {
    /// Run only this work; repeat for several
    #[arg(long, value_name = "WORK")]
    only: Vec<String>,
    /// Maximum number of rounds of a work; each side runs at least once per round
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: Option<u32>,
    /// Fewer rounds and no teaching: for a quick look, not for publication
    #[arg(long)]
    quick: bool,
    /// Measure only our side, without peers
    #[arg(long)]
    alone: bool,
    /// Threads of each side
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    threads: u32,
    /// Root of the repository
    #[arg(long, default_value = ".", value_name = "DIR")]
    root: PathBuf,
    /// Rewrite the table in this file after a run of every work
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
}

fn known_works() -> String {
    let names: Vec<&str> = WORKS.iter().map(|work| work.name).collect();
    format!("Works: {}", names.join(", "))
}

/// Maximum relative difference between the facts (numbers that identify the result, see [`Facts`]) of two sides of a
/// work: the sides add sums in different orders and break ties differently.
const SAME_WORK: f64 = 0.01;

/// Runs the comparison.
pub fn run(args: &CompareArgs) -> Result<()> {
    let works = chosen(&args.only)?;
    let paths = Paths::new(&args.root);
    paths.create()?;
    let mut pace = if args.quick { Pace::QUICK } else { Pace::FULL };
    pace.rounds = args.rounds.map_or(pace.rounds, |rounds| rounds as usize);

    let mut report = Report::new(Machine::read(), args.threads as usize);
    let peak = measure(&GEMM, args, &paths, &pace)?;
    report.set_peak(&peak);
    eprintln!("{}", report.heading());
    let mut failures = Vec::new();
    for work in works {
        if work.long && args.quick && args.only.is_empty() {
            continue;
        }
        if work.needs_model && !paths.model().exists() {
            eprintln!(
                "{}: skipped, because {} does not exist; the work `teaching` writes it",
                work.name,
                paths.model().display()
            );
            continue;
        }
        match measure(work, args, &paths, &pace) {
            Ok(measured) => {
                report.add(work, measured);
                eprint!("{}", report.last_lines());
                // After each work, so that an interrupted run has written its finished works.
                report.write_json(&paths.out)?;
            }
            Err(error) => {
                eprintln!("{}: {error:#}", work.name);
                failures.push(work.name);
            }
        }
    }
    println!("{}", report.markdown());
    if let Some(results) = &args.results {
        if args.only.is_empty() && !args.quick && !args.alone && failures.is_empty() {
            report.rewrite(results)?;
        } else {
            eprintln!("{}: not rewritten, because this was not a full run without failures", results.display());
        }
    }
    if failures.is_empty() { Ok(()) } else { bail!("not measured: {}", failures.join(", ")) }
}

fn chosen(only: &[String]) -> Result<Vec<&'static WorkSpec>> {
    if let Some(unknown) = only.iter().find(|name| WORKS.iter().all(|work| work.name != **name)) {
        bail!("expected a work out of {}, found {unknown}", known_works().trim_start_matches("Works: "));
    }
    Ok(WORKS.iter().filter(|work| only.is_empty() || only.iter().any(|name| name == work.name)).collect())
}

/// Measures one work: our side first in the result, then the peers in the registry's order.
fn measure(work: &WorkSpec, args: &CompareArgs, paths: &Paths, pace: &Pace) -> Result<Vec<Measured>> {
    let sides = std::iter::once(Side::Ours).chain(work.peers.iter().map(Side::Peer));
    let mut workers = Vec::new();
    for side in sides.take(if args.alone { 1 } else { usize::MAX }) {
        let files = paths.files_for(work, side)?;
        let worker = WorkerProcess::start(work, side, &files, args.threads as usize, paths)?;
        if let Some(ours) = workers.first() {
            check_facts(ours, &worker)?;
        }
        workers.push(worker);
    }
    let warm_ups: Vec<Option<f64>> = workers.iter().map(|worker| worker.ready.seconds).collect();
    let plan = if work.long { pace.once(&warm_ups) } else { pace.plan(&warm_ups) };
    let mut seconds = vec![Vec::new(); workers.len()];
    for round in 0..plan.rounds {
        // Each round starts with the next side, so that changes of the machine affect all sides alike.
        for turn in 0..workers.len() {
            let idx = (round + turn) % workers.len();
            seconds[idx].extend(workers[idx].run(plan.repeats[idx])?);
        }
    }
    workers.into_iter().zip(seconds).map(|(worker, seconds)| Measured::new(worker, seconds)).collect()
}

fn check_facts(ours: &WorkerProcess, theirs: &WorkerProcess) -> Result<()> {
    match contradiction(&ours.ready.facts, &theirs.ready.facts) {
        None => Ok(()),
        Some((name, our, their)) => {
            bail!("not the same work: {name} is {our} on our side and {their} with {}", theirs.side.title())
        }
    }
}

/// A fact that both sides report with different values.
fn contradiction<'a>(ours: &'a Facts, theirs: &Facts) -> Option<(&'a str, f64, f64)> {
    ours.iter()
        .filter_map(|(name, our)| Some((name.as_str(), *our, *theirs.get(name)?)))
        .find(|(_, our, their)| (our - their).abs() > SAME_WORK * our.abs().max(their.abs()) || their.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(entries: &[(&str, f64)]) -> Facts {
        entries.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
    }

    #[test]
    fn facts_agree_to_one_in_a_hundred() {
        let ours = facts(&[("boxes", 100.0), ("mean_score", 0.5), ("ours_alone", 3.0)]);
        assert_eq!(contradiction(&ours, &facts(&[("boxes", 100.0), ("mean_score", 0.503)])), None);
        let fewer = facts(&[("boxes", 98.0), ("mean_score", 0.5)]);
        assert_eq!(contradiction(&ours, &fewer), Some(("boxes", 100.0, 98.0)));
        assert!(contradiction(&ours, &facts(&[("boxes", f64::NAN)])).is_some());
    }

    #[test]
    fn an_unknown_work_is_told_the_known_ones() {
        let error = chosen(&["backbone".to_owned(), "frontbone".to_owned()]).unwrap_err().to_string();
        assert!(error.contains("backbone, faster-inference") && error.ends_with("found frontbone"), "{error}");
        assert_eq!(chosen(&["augmentation".to_owned()]).unwrap()[0].name, "augmentation");
        assert_eq!(chosen(&[]).unwrap().len(), WORKS.len());
    }
}
