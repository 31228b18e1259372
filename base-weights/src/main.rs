//! `sdg-base-weights`: pretrains preset `edge`, exports the weights from which teaching starts, and compares weights.
#![forbid(unsafe_code)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand, ValueEnum};
use sdg_base_weights::checkpoint::Checkpoint;
use sdg_base_weights::compare::Trials;
use sdg_base_weights::comparison::ComparisonTask;
use sdg_base_weights::detector::DetectorTask;
use sdg_base_weights::export::{export, with_comparison};
use sdg_base_weights::network::pretrain_config;
use sdg_base_weights::orientation::OrientationTask;
use sdg_base_weights::outcome::{Outcome, outcomes};
use sdg_base_weights::run::{Run, Settings, Task};
use sdg_base_weights::table::table;
use sdg_comparison::ComparisonConfig;
use sdg_files::write_atomically;
use sdg_grasp::{BaseWeights, BaseWeightsFile, ComputeBackend, FineTuning, Preset, TeachOptions};
use sdg_orientation::OrientationConfig;
use serde_json::Value;
use sha2::{Digest, Sha256};

/// Pretraining of preset `edge` on generated parts.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Pretrains, or resumes a stopped run.
    Pretrain {
        /// Network to pretrain: the detector, the orientation CNN of model A, or the comparison network.
        #[arg(long, value_enum, default_value_t = Pretrained::Detector)]
        network: Pretrained,
        /// Determines parts, pictures and every random choice.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Number of generated parts.
        #[arg(long, default_value_t = 1024)]
        parts: usize,
        /// Number of steps of the whole run.
        #[arg(long, default_value_t = 8000)]
        steps: usize,
        /// Base weights with an orientation CNN; its first stages initialise the comparison network's trunk.
        #[arg(long)]
        trunk: Option<PathBuf>,
        #[command(flatten)]
        pace: PaceArguments,
    },
    /// Writes the weights from which teaching starts, in half precision.
    Export {
        /// Checkpoint of a detector.
        #[arg(long, required_unless_present = "base", conflicts_with = "base")]
        detector: Option<PathBuf>,
        /// Base weights whose other networks are kept.
        #[arg(long)]
        base: Option<PathBuf>,
        /// Checkpoint of an orientation CNN; without it, model A cannot start from the weights.
        #[arg(long)]
        #[arg(conflicts_with = "base")]
        orientation: Option<PathBuf>,
        /// Checkpoint of a comparison network; models taught from weights without one do not compare.
        #[arg(long)]
        comparison: Option<PathBuf>,
        /// The file to write.
        #[arg(long)]
        out: PathBuf,
        /// Commit that the checkpoints were made with.
        #[arg(long)]
        commit: String,
    },
    /// Teaches unseen parts for a few steps and measures the network alone.
    Compare {
        /// Weights to start from; random parameters without it.
        #[arg(long)]
        weights: Option<PathBuf>,
        /// Name of the weights in the outcomes.
        #[arg(long)]
        name: String,
        /// Seed of the first part.
        #[arg(long, default_value_t = 9000)]
        first: u64,
        /// Number of parts.
        #[arg(long, default_value_t = 8)]
        parts: u64,
        /// Numbers of teaching steps, separated by commas; one model is taught for each.
        #[arg(long, value_delimiter = ',', default_value = "15,30,60,120")]
        steps: Vec<usize>,
        /// Seed of teaching.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Output file, as JSON lines; trials that it already contains are not measured again.
        #[arg(long)]
        out: PathBuf,
        /// Changes to the default fine-tuning, as JSON, such as {"freeze": "FirstStage"}; null trains the weights like
        /// random parameters.
        #[arg(long, default_value = "{}")]
        fine_tuning: String,
    },
    /// Prints the outcomes as a table, over the parts that every row has.
    Table {
        /// JSON lines of `compare`.
        outcomes: PathBuf,
        /// Names of weights; all by default.
        weights: Vec<String>,
    },
}

#[derive(Clone, Copy, ValueEnum)]
enum Pretrained {
    Detector,
    Orientation,
    Comparison,
}

/// Where a run is kept, and when it ends.
#[derive(Args)]
struct PaceArguments {
    /// File from which the run resumes.
    #[arg(long)]
    checkpoint: PathBuf,
    /// Number of steps between checkpoints.
    #[arg(long, default_value_t = 200)]
    every: usize,
    /// Stops after this many minutes; the next call resumes the run.
    #[arg(long)]
    minutes: Option<f64>,
    /// Device: flex, or another one that this build has.
    #[arg(long, default_value = "flex")]
    device: String,
}

/// Number of steps between printed losses.
const REPORT_EVERY: usize = 50;

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Pretrain { network, seed, parts, steps, trunk, pace } => {
            let settings = Settings::new(seed, parts, steps);
            match network {
                Pretrained::Detector => pretrain(DetectorTask::new(&settings, pretrain_config())?, settings, &pace),
                Pretrained::Orientation => {
                    pretrain(OrientationTask::new(&settings, OrientationConfig::edge())?, settings, &pace)
                }
                Pretrained::Comparison => {
                    let settings = Settings { batch_size: ComparisonTask::BATCH_SIZE, ..settings };
                    let path = trunk.context(
                        "expected --trunk: the base weights whose first stages the comparison network starts from",
                    )?;
                    let orientation = BaseWeightsFile::from_bytes(&std::fs::read(&path)?)?.parameters;
                    let orientation = orientation
                        .into_iter()
                        .filter_map(|(name, values)| Some((name.strip_prefix("orientation.")?.to_owned(), values)))
                        .collect();
                    let task = ComparisonTask::new(&settings, ComparisonConfig::edge(), orientation)?;
                    pretrain(task, settings, &pace)
                }
            }
        }
        Command::Export { detector, base, orientation, comparison, out, commit } => {
            let read = |path: Option<PathBuf>| path.map(|path| Checkpoint::read(&path)).transpose();
            let mut file = match (read(detector)?, base) {
                (Some(detector), _) => export(&detector, read(orientation)?.as_ref(), &commit)?,
                (None, base) => read_file(&base.context("expected --detector or --base")?)?,
            };
            if let Some(comparison) = read(comparison)? {
                file = with_comparison(file, &comparison, &commit)?;
            }
            let bytes = file.to_bytes();
            write_atomically(&out, &bytes)?;
            println!("{}: {} bytes, SHA-256 {}", out.display(), bytes.len(), sha256(&bytes));
            Ok(())
        }
        Command::Table { outcomes: path, weights } => {
            let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            print!("{}", table(&outcomes(&text), &weights));
            Ok(())
        }
        Command::Compare { weights, name, first, parts, steps, seed, out, fine_tuning } => {
            let weights = weights.map(|path| read_weights(&path)).transpose()?;
            let fine_tuning = changed(FineTuning::new(seed), &fine_tuning).context("--fine-tuning")?;
            let (steps, out, name) = (&steps[..], &out, &name);
            let comparison = Trials { name, weights, parts: first..first + parts, steps, seed, out, fine_tuning };
            comparison.run(&mut |outcome: &Outcome| println!("{}", serde_json::json!(outcome)))
        }
    }
}

fn pretrain<T: Task>(task: T, settings: Settings, pace: &PaceArguments) -> Result<()> {
    let device = pace.device.parse::<ComputeBackend>()?.open()?;
    let checkpoint = &pace.checkpoint;
    let start = Instant::now();
    let mut run = Run::start_or_resume(task, checkpoint, settings, &device)?;
    println!("at step {}", run.step());
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    let mut count = 0usize;
    while !run.is_over() {
        for (name, loss) in run.advance()? {
            *sums.entry(name).or_default() += loss;
        }
        count += 1;
        let elapsed_secs = start.elapsed().as_secs_f64();
        let is_out_of_time = pace.minutes.is_some_and(|minutes| elapsed_secs > 60.0 * minutes);
        if run.step().is_multiple_of(REPORT_EVERY) || is_out_of_time || run.is_over() {
            let means: Vec<String> =
                sums.iter().map(|(name, sum)| format!("{name} {:.3}", sum / count as f64)).collect();
            println!("step {:5} {elapsed_secs:7.1} s  {}", run.step(), means.join("  "));
            (sums, count) = (BTreeMap::new(), 0);
        }
        if run.step().is_multiple_of(pace.every) || is_out_of_time || run.is_over() {
            run.checkpoint().write(checkpoint)?;
        }
        if is_out_of_time {
            break;
        }
    }
    Ok(())
}

/// Changes some values of a fine-tuning, including its training; `None` for null.
fn changed(fine_tuning: FineTuning, changes: &str) -> Result<Option<FineTuning>> {
    let changes: Value = serde_json::from_str(changes)?;
    if changes.is_null() {
        return Ok(None);
    }
    let mut all = serde_json::to_value(&fine_tuning)?;
    merge(&mut all, changes);
    Ok(Some(serde_json::from_value(all)?))
}

/// Merges objects entry by entry; replaces any other value as a whole.
fn merge(value: &mut Value, changes: Value) {
    match (value, changes) {
        (Value::Object(all), Value::Object(changes)) => {
            for (name, change) in changes {
                merge(all.entry(name).or_insert(Value::Null), change);
            }
        }
        (value, change) => *value = change,
    }
}

fn read_weights(path: &Path) -> Result<BaseWeights> {
    let named = || path.display().to_string();
    let bytes = std::fs::read(path).with_context(named)?;
    let network = TeachOptions::new(1).taught_network().context("model C has a network")?;
    Ok(BaseWeightsFile::from_bytes(&bytes).with_context(named)?.for_network(
        Preset::Edge.name(),
        &network,
        sha256(&bytes),
    )?)
}

fn read_file(path: &Path) -> Result<BaseWeightsFile> {
    let named = || path.display().to_string();
    BaseWeightsFile::from_bytes(&std::fs::read(path).with_context(named)?).with_context(named)
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
