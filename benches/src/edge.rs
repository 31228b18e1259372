//! `sdg-bench edge`: measures the program for small machines under the conditions of such a machine.
//!
//! One core, a memory limit, one image from the start of the process to its end; then a sequence of images for the
//! frames per second. Each figure except the frames per second and the time of teaching has a bound that we promise,
//! and the run fails if a bound is broken.

use std::fmt::Write as _;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::Args as ClapArgs;
use sdg_geometry::median;

use crate::compare::machine::Machine;
use crate::results::{duration, rewrite};

const MAX_BYTES: u64 = 25_000_000;
const MAX_START_SECS: f64 = 0.3;
const MAX_MEMORY_BYTES: u64 = 150_000_000;
/// Memory limit of the run, in KiB of address space.
const LIMIT_KIB: u32 = 256 * 1024;
/// Number of timed starts.
const STARTS: usize = 9;
/// Number of images in the sequence.
const FRAMES: usize = 30;
/// Number of teaching steps; the figures depend only on the network's shape.
const STEPS: &str = "60";
const DEMONSTRATION: &str = "datasets/demonstrations/pendulum";

/// `sdg-bench edge`
#[derive(Debug, ClapArgs)]
pub struct EdgeArgs {
    /// The program under test, built without default features
    binary: PathBuf,
    /// A grasp model of the preset `edge`; without it, the program teaches one
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Root of the repository
    #[arg(long, default_value = ".", value_name = "DIR")]
    root: PathBuf,
    /// Rewrite the table in this file
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
}

/// A figure and its bound.
struct Figure {
    what: &'static str,
    found: String,
    wanted: String,
    kept: bool,
}

/// Measures, prints the table, and fails if a bound is broken.
pub fn run(args: &EdgeArgs) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let photo = args.root.join(DEMONSTRATION).join("image.png");
    let (model, teaching) = match &args.model {
        Some(model) => (model.clone(), None),
        None => {
            let model = folder.path().join("edge.sdg");
            let secs = teach(&args.binary, &photo, &model)?;
            (model, Some(secs))
        }
    };
    let figures = measure(&args.binary, &model, &photo)?;
    let table = markdown(&figures, teaching);
    println!("{table}");
    if let Some(results) = &args.results {
        rewrite(results, "edge", &table)?;
    }
    let broken: Vec<&str> = figures.iter().filter(|figure| !figure.kept).map(|figure| figure.what).collect();
    ensure!(broken.is_empty(), "out of bounds: {}", broken.join(", "));
    Ok(())
}

fn teach(binary: &Path, photo: &Path, out: &Path) -> Result<f64> {
    let demo = format!("{}:{}", photo.display(), photo.with_file_name("annotation.json").display());
    let begun = Instant::now();
    let output = Command::new(binary)
        // This build contains no base weights.
        .args(["teach", "--base-weights", "crates/grasp/weights/edge.safetensors"])
        .args(["--seed", "1", "--steps", STEPS, "--demo", &demo, "--out"])
        .arg(out)
        .output()
        .with_context(|| binary.display().to_string())?;
    ensure!(output.status.success(), "teaching failed: {}", String::from_utf8_lossy(&output.stderr));
    Ok(begun.elapsed().as_secs_f64())
}

fn measure(binary: &Path, model: &Path, photo: &Path) -> Result<Vec<Figure>> {
    let bytes = std::fs::metadata(binary).with_context(|| binary.display().to_string())?.len();
    let core = first_core()?;
    let one = [photo];
    let mut starts = Vec::new();
    let mut peak = 0;
    for _ in 0..STARTS {
        let look = Look::run(pinned(&core, binary, model, &one))?;
        starts.push(look.seconds);
        peak = peak.max(look.peak_bytes);
    }
    // The shell sets the limit and replaces itself with the program.
    let limited = pinned(&core, binary, model, &one);
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -v {LIMIT_KIB} && exec \"$@\""), "sh"]);
    shell.arg(limited.get_program()).args(limited.get_args());
    let under_limit = Look::run(shell);
    let row = Look::run(pinned(&core, binary, model, &[photo; FRAMES]))?;
    let frame = median(row.frame_seconds.iter().copied()).unwrap_or(f64::NAN);
    let (start, mb) =
        (median(starts.iter().copied()).unwrap_or(f64::NAN), |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6));
    Ok(vec![
        Figure {
            what: "program",
            found: mb(bytes),
            wanted: format!("at most {}", mb(MAX_BYTES)),
            kept: bytes <= MAX_BYTES,
        },
        Figure {
            what: "start, read the model, detect one image of 640×480, end: one core",
            found: duration(start),
            wanted: format!("below {}", duration(MAX_START_SECS)),
            kept: start < MAX_START_SECS,
        },
        Figure {
            what: "peak memory of that",
            found: mb(peak),
            wanted: format!("below {}", mb(MAX_MEMORY_BYTES)),
            kept: peak < MAX_MEMORY_BYTES,
        },
        Figure {
            what: "the same under a limit of 256 MiB of address space",
            found: match &under_limit {
                Ok(look) => format!("found the part in {}", duration(look.seconds)),
                Err(error) => format!("failed: {error:#}"),
            },
            wanted: "finds the part".to_owned(),
            kept: under_limit.is_ok(),
        },
        Figure {
            what: "a further image, verified: one core",
            found: format!("{}, {:.1} a second", duration(frame), 1.0 / frame),
            wanted: String::new(),
            kept: true,
        },
    ])
}

/// The program on one core, with a model and input images.
fn pinned(core: &str, binary: &Path, model: &Path, images: &[&Path]) -> Command {
    let mut command = Command::new("taskset");
    command.args(["-c", core]).arg(binary).args(["detect", "--json", "--grasp-model"]).arg(model).args(images);
    command
}

/// One run of the program.
struct Look {
    seconds: f64,
    peak_bytes: u64,
    frame_seconds: Vec<f64>,
}

impl Look {
    /// Runs the program to its end; the part must be found in every image.
    fn run(mut command: Command) -> Result<Self> {
        let begun = Instant::now();
        let mut printed = tempfile::tempfile()?;
        let mut child = command
            .stdout(printed.try_clone()?)
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("{:?}", command.get_program()))?;
        let status_file = format!("/proc/{}/status", child.id());
        let mut peak_bytes = 0;
        while child.try_wait()?.is_none() {
            let status = std::fs::read_to_string(&status_file).unwrap_or_default();
            peak_bytes = peak_bytes.max(crate::compare::peak_of_status(&status).unwrap_or(0));
            std::thread::sleep(Duration::from_millis(2));
        }
        let seconds = begun.elapsed().as_secs_f64();
        let output = child.wait_with_output()?;
        if !output.status.success() {
            bail!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
        }
        let mut lines = String::new();
        printed.rewind()?;
        printed.read_to_string(&mut lines)?;
        let frame_seconds = lines
            .lines()
            .map(|line| {
                let line: serde_json::Value = serde_json::from_str(line)?;
                line["seconds"].as_f64().context("expected the seconds of a line, found none")
            })
            .collect::<Result<_>>()?;
        Ok(Self { seconds, peak_bytes, frame_seconds })
    }
}

/// The first core that this process may use.
fn first_core() -> Result<String> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let cores = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    let first = cores
        .and_then(|list| list.trim().split([',', '-']).next())
        .context("expected a list of cores in /proc/self/status, found none")?;
    Ok(first.to_owned())
}

fn markdown(figures: &[Figure], teaching: Option<f64>) -> String {
    let Machine { processor, instructions, commit, .. } = Machine::read();
    let mut text = format!("{processor}, {instructions}; commit {commit}.\n\n| | found | wanted |\n|---|--:|--:|\n");
    for Figure { what, found, wanted, .. } in figures {
        let _ = writeln!(text, "| {what} | {found} | {wanted} |");
    }
    if let Some(secs) = teaching {
        let _ = writeln!(text, "| it teaches, {STEPS} steps, every core | {} | |", duration(secs));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_finds_nothing_is_an_error_with_its_words() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo sorry >&2; exit 3"]);
        let error = Look::run(command).map(|look| look.seconds).unwrap_err().to_string();
        assert!(error.contains('3') && error.contains("sorry"), "{error}");
    }

    #[test]
    fn seconds_are_read_from_every_line() {
        let mut command = Command::new("sh");
        command.args(["-c", r#"echo '{"seconds": 0.25}'; echo '{"seconds": 0.5}'"#]);
        assert_eq!(Look::run(command).unwrap().frame_seconds, [0.25, 0.5]);
    }

    #[test]
    fn the_table_has_a_row_for_each_figure() {
        let figure = Figure { what: "program", found: "1 MB".into(), wanted: "at most 2 MB".into(), kept: true };
        let table = markdown(&[figure], Some(12.0));
        assert!(table.contains("| program | 1 MB | at most 2 MB |") && table.contains("12.0 s"), "{table}");
        assert!(first_core().unwrap().parse::<u32>().is_ok());
    }
}
