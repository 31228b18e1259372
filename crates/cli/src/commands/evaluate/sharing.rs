//! `sdg evaluate --list-units`, `--unit`, `--collect`, `--watch` and `--submit`: the protocol's units divided among
//! many processes.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use sdg_evaluation::Progress;
use sdg_evaluation::sharing::{
    Collecting, Ended, ListedUnit, SlurmJob, UnitFolder, UnitKind, UnitList, Watch, all_units, cores, faults,
    near_names, own_sha256, submit_script, submitted_jobs,
};
use sdg_evaluation::{Evaluation, Settings, Store, quoted};
use sdg_grasp::{ModelKind, Preset};
use sdg_simulation::objects::ObjectSpec;
use serde_json::json;

use super::args::EvaluateArgs;
use super::model_names::models;
use super::protocol;
use super::selection::{objects, settings};
use crate::exit::{Outcome, Usage, one_line};
use crate::interrupt::Interrupt;
use crate::progress::EvaluationProgress;

/// Time between two reads of the folder.
const POLL_INTERVAL: Duration = Duration::from_secs(2);

/// The evaluation described by the arguments.
struct Asked {
    models: Vec<ModelKind>,
    objects: Vec<ObjectSpec>,
    preset: Preset,
    /// Settings of an ordinary run, without the program's hash.
    settings: Settings,
    unverified: bool,
}

impl Asked {
    fn new(args: &EvaluateArgs) -> Result<Self> {
        let models = models(&args.models, &ModelKind::ALL)?;
        let (preset, settings) = settings(args, &models)?;
        Ok(Self {
            models,
            objects: objects(&args.objects, ObjectSpec::paper_names())?,
            preset,
            settings,
            unverified: args.unverified,
        })
    }

    fn units(&self) -> Vec<ListedUnit<'_>> {
        all_units(&self.models, &self.objects, self.unverified)
    }

    /// Opens the folder for use by several processes.
    fn open(&self, folder: &Path) -> Result<Store> {
        let settings = Settings { program: Some(own_sha256()?), ..self.settings.clone() };
        Store::open_shared(folder, &settings)
    }

    /// The evaluation in one process, where units run one at a time.
    fn evaluation<'a>(&'a self, store: &'a Store) -> Evaluation<'a> {
        Evaluation {
            models: &self.models,
            objects: &self.objects,
            preset: self.preset,
            store,
            unverified: self.unverified,
            jobs: 1,
        }
    }
}

/// Runs the option that was given.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    let sharing = &args.sharing;
    if let Some(folder) = &sharing.watch {
        return watch(folder, args.json);
    }
    let asked = Asked::new(args)?;
    if sharing.list_units {
        list(&asked, args)
    } else if sharing.collect {
        collect(&asked, args)
    } else if sharing.submit.is_some() {
        submit(&asked, args)
    } else {
        do_units(&asked, args)
    }
}

fn list(asked: &Asked, args: &EvaluateArgs) -> Result<Outcome> {
    let units = asked.units();
    if !args.json {
        let names: String = units.iter().map(|unit| format!("{}\n", unit.name)).collect();
        std::io::stdout().write_all(names.as_bytes())?;
        return Ok(Outcome::Done);
    }
    let listed = units.iter().map(|unit| {
        let receipts = UnitFolder::of(&args.out, &unit.name).read()?.receipts;
        let done = receipts.iter().any(|receipt| receipt.covers(&unit.files));
        Ok(json!({ "name": unit.name, "after": unit.after, "done": done }))
    });
    println!("{}", json!({ "units": listed.collect::<Result<Vec<_>>>()? }));
    Ok(Outcome::Done)
}

fn do_units(asked: &Asked, args: &EvaluateArgs) -> Result<Outcome> {
    let units = asked.units();
    let named = args.sharing.unit.iter().map(|name| {
        units.iter().find(|unit| unit.name == *name).ok_or_else(|| {
            let near = near_names(name, units.iter().map(|unit| unit.name.as_str())).join(", ");
            Usage(format!(
                "--unit: expected a unit of this evaluation, found \"{name}\"; the nearest are {near}; --list-units prints all"
            ))
        })
    });
    let named = named.collect::<Result<Vec<_>, _>>()?;
    // A missing simulator is reported once, before any unit starts.
    if named.iter().any(|unit| UnitKind::of(&unit.name).is_some_and(UnitKind::is_simulated)) {
        sdg_simulation::load()?;
    }
    let store = asked.open(&args.out)?;
    UnitList::new(&units).save(&args.out)?;
    let (evaluation, interrupt) = (asked.evaluation(&store), Interrupt::watch());
    let progress = EvaluationProgress::new();
    progress.expect(named.len());
    let mut failures: Vec<anyhow::Error> = Vec::new();
    let mut ended = Vec::new();
    for unit in &named {
        let done = evaluation.do_listed(unit, cores(), &|| interrupt.is_requested(), &|line| progress.print_line(line));
        let (told, how) = match done {
            Ok(Ended::Done(summary)) => (summary, "done"),
            Ok(Ended::Already(receipt)) => (format!("done already, by {}", receipt.by), "already"),
            Ok(Ended::Interrupted) => bail!("{}: interrupted; run the same command again to continue", unit.name),
            Err(error) => {
                failures.push(error);
                continue;
            }
        };
        progress.unit_done(&format!("{}: {told}", unit.name));
        ended.push(json!({ "name": unit.name, "ended": how, "summary": told }));
    }
    progress.finish();
    if args.json && failures.is_empty() {
        println!("{}", json!({ "units": ended }));
    }
    match failures.len() {
        0 => Ok(Outcome::Done),
        1 => Err(failures.remove(0)),
        several => {
            failures.iter().for_each(|failure| eprintln!("sdg: {}", one_line(failure)));
            bail!("{several} of {} units failed", named.len())
        }
    }
}

fn collect(asked: &Asked, args: &EvaluateArgs) -> Result<Outcome> {
    let store = asked.open(&args.out)?;
    let Some(_collecting) = Collecting::begin(&args.out)? else {
        bail!("{}: another --collect is running in this folder", args.out.display());
    };
    let (evaluation, units) = (asked.evaluation(&store), asked.units());
    let faults = faults(&evaluation, &units)?;
    if !faults.is_empty() {
        faults.iter().for_each(|fault| eprintln!("{fault}"));
        bail!("{} of {} units cannot be counted; no tables were written", faults.len(), units.len());
    }
    sdg_files::prepare_folder(protocol::report_folder(args))?;
    let remaining = protocol::write_tables(args, &evaluation, &asked.settings)?;
    if remaining > 0 {
        bail!("{}: {remaining} units have a receipt but no result", args.out.display());
    }
    Ok(Outcome::Done)
}

fn watch(folder: &Path, json: bool) -> Result<Outcome> {
    let mut watch = Watch::new(folder)?;
    let is_terminal = std::io::stdout().is_terminal();
    let mut told = String::new();
    loop {
        let progress = watch.progress()?;
        if json {
            println!("{}", serde_json::to_string(&progress)?);
            return Ok(Outcome::Done);
        }
        // Not by the macros, whose errors are returned after the last unit.
        let mut stdout = std::io::stdout();
        let screen = progress.to_string();
        let line = screen.lines().next().unwrap_or_default();
        if is_terminal {
            // Redraws from the upper left corner, and clears the rest.
            write!(stdout, "\x1b[H\x1b[J{screen}")?;
        } else if progress.is_settled {
            write!(stdout, "{screen}")?;
        } else if line.split(';').next() != told.split(';').next() {
            writeln!(stdout, "{line}")?;
        }
        line.clone_into(&mut told);
        stdout.flush()?;
        if progress.is_settled {
            let submit_again = match progress.interrupted.is_empty() {
                true => "",
                false => {
                    "; submit the interrupted ones again, with a longer --limit-mins if they reached the limit, or \
                     watch again if Slurm requeued them"
                }
            };
            return match progress.units - progress.done {
                0 => Ok(Outcome::Done),
                missing => Err(anyhow!(
                    "{}: {missing} of {} units have no result{submit_again}",
                    folder.display(),
                    progress.units
                )),
            };
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

fn submit(asked: &Asked, args: &EvaluateArgs) -> Result<Outcome> {
    let sharing = &args.sharing;
    let folder = std::path::absolute(&args.out)?;
    let program = std::env::current_exe().context("the program's own path")?;
    let arguments = protocol::command(args, &asked.settings);
    // No argument contains a space: names are trimmed when they are parsed.
    let arguments = arguments.split(' ').skip(1).map(str::to_owned);
    let command: Vec<String> = [program.display().to_string()].into_iter().chain(arguments).collect();
    let job = SlurmJob {
        command: &command,
        folder: &folder,
        cores: sharing.cores,
        memory_mb: sharing.memory_mb,
        limit_mins: sharing.limit_mins,
        sbatch: &sharing.sbatch,
    };
    let units = asked.units();
    let script = submit_script(&job, &units);
    if !sharing.yes {
        match args.json {
            true => println!("{}", json!({ "units": units.len(), "script": script })),
            false => std::io::stdout().write_all(script.as_bytes())?,
        }
        return Ok(Outcome::Done);
    }
    sdg_files::prepare_folder(&folder)?;
    UnitList::new(&units).save(&folder)?;
    let mut bash = Command::new("bash");
    bash.arg("-s").stdin(Stdio::piped()).stdout(if args.json { Stdio::piped() } else { Stdio::inherit() });
    let mut bash = bash.spawn().context("bash: cannot run")?;
    bash.stdin.take().context("bash: no standard input")?.write_all(script.as_bytes())?;
    let output = bash.wait_with_output()?;
    let printed = String::from_utf8_lossy(&output.stdout);
    if !output.status.success() {
        // The jobs that were submitted before the error.
        eprint!("{printed}");
        bail!(
            "the script that hands units to Slurm ended with {}: check that sbatch is installed and Slurm is running",
            output.status
        );
    }
    if args.json {
        let jobs = submitted_jobs(&printed);
        println!("{}", json!({ "jobs": jobs, "units": units.len(), "out": folder.display().to_string() }));
        return Ok(Outcome::Done);
    }
    let out = quoted(&folder.display().to_string());
    let command: Vec<String> = command.iter().map(|word| quoted(word)).collect();
    println!("then: sdg evaluate --watch {out}; {} --out {out} --collect", command.join(" "));
    Ok(Outcome::Done)
}
