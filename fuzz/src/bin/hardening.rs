//! `hardening [--executions N] [--seconds S] [--out DIR] [TARGET…]` executes the targets many times and resumes an
//! earlier run of the same program; `--seconds` limits the time of all targets together. `hardening --input FILE
//! TARGET` executes a target once and prints its panic in full.
//!
//! A target's figures are in DIR/TARGET.json, and each input that caused a failure is in DIR/TARGET-NUMBER.bin.
#![cfg_attr(test, allow(clippy::unwrap_used))]

use std::error::Error;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use peak_alloc::PeakAlloc;
use sdg_fuzz::{Outcome, TARGETS, Target, execute, run};
use serde_json::{Value, json};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Number of executions between checks of the time.
const BATCH: u64 = 50;
/// Time between writes of the figures.
const KEEP_EVERY: Duration = Duration::from_secs(5);
const USAGE: &str =
    "usage: hardening [--executions N] [--seconds S] [--out DIR] [TARGET…], or hardening --input FILE TARGET";

struct Asked {
    executions: u64,
    /// Time limit of all targets together.
    time: Option<Duration>,
    out: PathBuf,
    input: Option<PathBuf>,
    targets: Vec<&'static Target>,
}

fn asked() -> Result<Asked, Box<dyn Error>> {
    let mut asked =
        Asked { executions: 100_000, time: None, out: "target/hardening".into(), input: None, targets: Vec::new() };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(USAGE);
        match argument.as_str() {
            "--executions" => asked.executions = value()?.parse()?,
            "--seconds" => asked.time = Some(Duration::from_secs(value()?.parse()?)),
            "--out" => asked.out = value()?.into(),
            "--input" => asked.input = Some(value()?.into()),
            name => {
                let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
                let target = TARGETS.iter().find(|target| target.name == name);
                asked.targets.push(target.ok_or(format!("{name}: expected one of {}; {USAGE}", names.join(", ")))?);
            }
        }
    }
    if asked.targets.is_empty() {
        asked.targets = TARGETS.iter().collect();
    }
    Ok(asked)
}

/// The checksum of the running program.
fn program_crc32() -> io::Result<u32> {
    Ok(crc32fast::hash(&fs::read(std::env::current_exe()?)?))
}

/// The figures that an earlier run of the program with this checksum wrote to `file`; those of another program say
/// nothing about this one.
fn reached(file: &Path, program_crc32: u32) -> Value {
    let text = fs::read_to_string(file).ok();
    let figures: Option<Value> = text.and_then(|text| serde_json::from_str(&text).ok());
    figures.filter(|figures| figures["program_crc32"] == program_crc32).unwrap_or_else(|| json!({}))
}

fn attack(
    target: &Target,
    executions: u64,
    until: Option<Instant>,
    out: &Path,
    program_crc32: u32,
) -> Result<u64, Box<dyn Error>> {
    let file = out.join(format!("{}.json", target.name));
    let earlier = reached(&file, program_crc32);
    let number = |key: &str| earlier[key].as_u64().unwrap_or(0);
    let (mut total, mut failures) = (number("executions"), number("failures"));
    let (mut accepted, mut most_bytes) = (number("accepted"), number("most_bytes"));
    let mut slowest_secs = earlier["slowest_secs"].as_f64().unwrap_or(0.0);
    let mut seconds = earlier["seconds"].as_f64().unwrap_or(0.0);
    let seeds = (target.seeds)();
    // Memory that a target keeps for all its executions must not count for the first one.
    let _ = execute(target, &seeds[0], &ALLOCATOR);
    let is_in_time = || until.is_none_or(|until| Instant::now() < until);
    while total < executions && is_in_time() {
        let start = Instant::now();
        while total < executions && start.elapsed() < KEEP_EVERY && is_in_time() {
            let end = executions.min(total + BATCH);
            let Outcome { count, accepted: more, slowest_secs: slowest, most_bytes: most, failures: found } =
                run(target, &seeds, total..end, &ALLOCATOR);
            for failure in &found {
                fs::write(out.join(format!("{}-{}.bin", target.name, failure.number)), &failure.input)?;
                eprintln!("{}: number {}: {}", target.name, failure.number, failure.reason);
            }
            total += count;
            accepted += more;
            failures += found.len() as u64;
            most_bytes = most_bytes.max(most as u64);
            slowest_secs = slowest_secs.max(slowest);
        }
        seconds += start.elapsed().as_secs_f64();
        let figures = json!({
            "executions": total, "accepted": accepted, "failures": failures, "most_bytes": most_bytes,
            "slowest_secs": slowest_secs, "seconds": seconds, "program_crc32": program_crc32,
        });
        let unfinished = file.with_extension("json.tmp");
        fs::write(&unfinished, format!("{figures:#}\n"))?;
        fs::rename(&unfinished, &file)?;
    }
    println!(
        "{:<16} {total:>9} executions in {seconds:6.0} s, {accepted} accepted, slowest {:.0} ms, most {:.1} MB, {failures} failures",
        target.name,
        1e3 * slowest_secs,
        1e-6 * most_bytes as f64
    );
    Ok(failures)
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let asked = asked()?;
    if let Some(input) = &asked.input {
        let [target] = asked.targets[..] else { return Err(USAGE.into()) };
        let accepted = (target.run)(&fs::read(input)?);
        println!("{}: {}", target.name, if accepted { "accepted" } else { "refused" });
        return Ok(ExitCode::SUCCESS);
    }
    fs::create_dir_all(&asked.out)?;
    let program_crc32 = program_crc32()?;
    // Each panic becomes a line of the report; the default hook would print it a second time.
    std::panic::set_hook(Box::new(|_| {}));
    let mut failures = 0;
    let begin = Instant::now();
    for (place, target) in (1..).zip(&asked.targets) {
        // Time that one target does not use is left for the next ones.
        let until = asked.time.map(|time| begin + time * place / asked.targets.len() as u32);
        failures += attack(target, asked.executions, until, &asked.out, program_crc32)?;
    }
    Ok(if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_another_program_are_not_continued() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("png.json");
        fs::write(&file, json!({ "executions": 50, "program_crc32": 1 }).to_string()).unwrap();
        assert_eq!(reached(&file, 1)["executions"], 50);
        assert_eq!(reached(&file, 2), json!({}));
    }
}
