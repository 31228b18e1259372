//! `sdg-base-weights`: pretrains preset `edge`, exports what teaching starts from, and compares weights.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use sdg_base_weights::checkpoint::{Checkpoint, write_whole};
use sdg_base_weights::compare::Comparison;
use sdg_base_weights::episodes::{EpisodeSettings, Episodes};
use sdg_base_weights::outcome::{Outcome, outcomes};
use sdg_base_weights::pretrain::{Settings, export, start_or_resume};
use sdg_base_weights::table::table;
use sdg_grasp::{BaseWeights, BaseWeightsFile, ComputeBackend, FineTuning, Preset, TeachOptions};
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
    /// Pretrains, or goes on where a run was stopped.
    Pretrain {
        /// Where the run keeps what it goes on from.
        #[arg(long)]
        checkpoint: PathBuf,
        /// Decides parts, pictures and every random choice.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Parts that are told apart.
        #[arg(long, default_value_t = 128)]
        parts: usize,
        /// Steps of the whole run.
        #[arg(long, default_value_t = 4000)]
        steps: usize,
        /// Steps between checkpoints.
        #[arg(long, default_value_t = 200)]
        every: usize,
        /// Ends after so many minutes; the next call goes on.
        #[arg(long)]
        minutes: Option<f64>,
        /// flex, or a device that this build has.
        #[arg(long, default_value = "flex")]
        device: String,
    },
    /// Teaches part after part for a few steps and moves towards what comes of it, or goes on where a run was stopped.
    Episodes {
        /// Where the run keeps what it goes on from.
        #[arg(long)]
        checkpoint: PathBuf,
        /// Base weights to start from; none for nothing.
        #[arg(long)]
        start: Option<PathBuf>,
        /// Decides parts, pictures and every random choice.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Episodes of the whole run.
        #[arg(long, default_value_t = 500)]
        episodes: usize,
        /// Episodes between checkpoints.
        #[arg(long, default_value_t = 20)]
        every: usize,
        /// Ends after so many minutes; the next call goes on.
        #[arg(long)]
        minutes: Option<f64>,
        /// flex, or a device that this build has.
        #[arg(long, default_value = "flex")]
        device: String,
    },
    /// Writes what teaching starts from, in half precision.
    Export {
        /// A checkpoint.
        #[arg(long)]
        checkpoint: PathBuf,
        /// The file to write.
        #[arg(long)]
        out: PathBuf,
        /// The commit that the checkpoint was made with.
        #[arg(long)]
        commit: String,
    },
    /// Teaches unseen parts for a few steps and measures the network alone.
    Compare {
        /// Weights to start from; none for nothing.
        #[arg(long)]
        weights: Option<PathBuf>,
        /// Their name in the outcomes.
        #[arg(long)]
        name: String,
        /// Seed of the first part.
        #[arg(long, default_value_t = 9000)]
        first: u64,
        /// How many parts.
        #[arg(long, default_value_t = 8)]
        parts: u64,
        /// Steps of teaching, one model each.
        #[arg(long, value_delimiter = ',', default_value = "15,30,60,120")]
        steps: Vec<usize>,
        /// Seed of teaching.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// JSON lines; what stands there is not measured again.
        #[arg(long)]
        out: PathBuf,
        /// What differs from the default fine-tuning, as JSON, such as {"freeze": "FirstStage"}; null to teach as from
        /// nothing.
        #[arg(long, default_value = "{}")]
        fine_tuning: String,
    },
    /// Outcomes as a table, over the parts that every row has.
    Table {
        /// JSON lines of `compare`.
        outcomes: PathBuf,
        /// Names of weights; all where none is given.
        weights: Vec<String>,
    },
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Pretrain { checkpoint, seed, parts, steps, every, minutes, device } => {
            pretrain(&checkpoint, Settings::new(seed, parts, steps), every, minutes, &device)
        }
        Command::Episodes { checkpoint, start, seed, episodes, every, minutes, device } => {
            let settings = EpisodeSettings::new(seed, episodes);
            episodes_of(&checkpoint, start.as_deref(), settings, every, minutes, &device)
        }
        Command::Export { checkpoint, out, commit } => {
            let bytes = exported(&checkpoint, &commit)?.to_bytes();
            write_whole(&out, &bytes)?;
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
            let comparison = Comparison { name, weights, parts: first..first + parts, steps, seed, out, fine_tuning };
            comparison.run(&mut |outcome: &Outcome| println!("{}", serde_json::json!(outcome)))
        }
    }
}

fn pretrain(checkpoint: &Path, settings: Settings, every: usize, minutes: Option<f64>, device: &str) -> Result<()> {
    let device = device.parse::<ComputeBackend>()?.open()?;
    let start = Instant::now();
    let mut run = start_or_resume(checkpoint, settings, &device)?;
    println!("at step {}, {:.1} s to prepare", run.step(), start.elapsed().as_secs_f64());
    let (mut sums, mut count) = (Vec::<f64>::new(), 0usize);
    while !run.is_over() {
        let losses = run.advance()?;
        let values = [losses.rpn_cls, losses.rpn_loc, losses.cls, losses.box_reg, losses.keypoint, losses.mask];
        sums.resize(values.len(), 0.0);
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        count += 1;
        let is_out_of_time = minutes.is_some_and(|minutes| start.elapsed().as_secs_f64() > 60.0 * minutes);
        if run.step().is_multiple_of(50) || is_out_of_time || run.is_over() {
            let means: Vec<String> = sums.iter().map(|sum| format!("{:.3}", sum / count as f64)).collect();
            println!(
                "step {:5} {:7.1} s  rpn_cls rpn_loc cls box_reg keypoint mask {}",
                run.step(),
                start.elapsed().as_secs_f64(),
                means.join(" ")
            );
            (sums, count) = (Vec::new(), 0);
        }
        if run.step().is_multiple_of(every) || is_out_of_time || run.is_over() {
            run.checkpoint().write(checkpoint)?;
        }
        if is_out_of_time {
            break;
        }
    }
    Ok(())
}

fn episodes_of(
    checkpoint: &Path,
    start_file: Option<&Path>,
    mut settings: EpisodeSettings,
    every: usize,
    minutes: Option<f64>,
    device: &str,
) -> Result<()> {
    let device = device.parse::<ComputeBackend>()?.open()?;
    let start = Instant::now();
    let start_weights =
        start_file.map(|path| std::fs::read(path).with_context(|| path.display().to_string())).transpose()?;
    settings.start_sha256 = start_weights.as_ref().map(|bytes| sha256(bytes));
    let mut run = if checkpoint.exists() {
        let read = Checkpoint::<EpisodeSettings>::read(checkpoint)?;
        if read.settings != settings {
            bail!("{}: expected a run of {settings:?}, found one of {:?}", checkpoint.display(), read.settings);
        }
        Episodes::start(settings, &read.parameters, read.step, &device)?
    } else {
        let weights = start_weights.map(|bytes| BaseWeightsFile::from_bytes(&bytes)).transpose()?;
        Episodes::start(settings, &weights.map(|file| file.parameters).unwrap_or_default(), 0, &device)?
    };
    println!("at episode {}, {:.1} s to prepare", run.episode(), start.elapsed().as_secs_f64());
    let mut losses = Vec::new();
    while !run.is_over() {
        losses.push(run.advance()?);
        let is_out_of_time = minutes.is_some_and(|minutes| start.elapsed().as_secs_f64() > 60.0 * minutes);
        if run.episode().is_multiple_of(every) || is_out_of_time || run.is_over() {
            let mean = losses.iter().sum::<f64>() / losses.len() as f64;
            losses.clear();
            println!(
                "episode {:5} {:7.1} s  loss after teaching {mean:.3}",
                run.episode(),
                start.elapsed().as_secs_f64()
            );
            run.checkpoint().write(checkpoint)?;
        }
        if is_out_of_time {
            break;
        }
    }
    Ok(())
}

/// What teaching starts from, of a checkpoint of either method.
fn exported(path: &Path, commit: &str) -> Result<BaseWeightsFile> {
    if let Ok(checkpoint) = Checkpoint::<Settings>::read(path) {
        return export(&checkpoint, commit);
    }
    let checkpoint = Checkpoint::<EpisodeSettings>::read(path)?;
    let device = ComputeBackend::default().open()?;
    Ok(Episodes::start(checkpoint.settings, &checkpoint.parameters, checkpoint.step, &device)?.export(commit))
}

/// A fine-tuning with some values changed, those of its training too; `None` for null.
fn changed(fine_tuning: FineTuning, changes: &str) -> Result<Option<FineTuning>> {
    let changes: Value = serde_json::from_str(changes)?;
    if changes.is_null() {
        return Ok(None);
    }
    let mut all = serde_json::to_value(&fine_tuning)?;
    merge(&mut all, changes);
    Ok(Some(serde_json::from_value(all)?))
}

/// Objects entry by entry, anything else as a whole.
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

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
