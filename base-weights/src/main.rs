//! `sdg-base-weights`: pretrains preset `edge`, exports what teaching starts from, and compares weights.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use sdg_base_weights::checkpoint::{Checkpoint, write_whole};
use sdg_base_weights::compare::{Comparison, Outcome};
use sdg_base_weights::episodes::{EpisodeSettings, Episodes};
use sdg_base_weights::pretrain::{Settings, export, start_or_resume};
use sdg_grasp::{BaseWeights, BaseWeightsFile, ComputeBackend, Preset, TeachOptions};
use sdg_training::TrainingConfig;
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
        /// A training other than the preset's, as JSON.
        #[arg(long)]
        training: Option<String>,
        /// Stages of the backbone that are not trained: Nothing, Stem, ThroughRes2, ThroughRes3 or FirstStage.
        #[arg(long)]
        freeze: Option<String>,
        /// Generated parts that lie about while a part is taught.
        #[arg(long, default_value_t = 0)]
        other_parts: usize,
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
        Command::Compare { weights, name, first, parts, steps, seed, out, training, freeze, other_parts } => {
            let weights = weights.map(|path| read_weights(&path)).transpose()?;
            let training: Option<serde_json::Value> =
                training.map(|text| serde_json::from_str(&text)).transpose().context("--training")?;
            let freeze =
                freeze.map(|name| serde_json::from_value(serde_json::json!(name))).transpose().context("--freeze")?;
            let adapt = |options: &mut TeachOptions, _steps: usize| {
                options.freeze = freeze;
                options.num_other_parts = other_parts;
                options.training = training.as_ref().map(|changes| changed(TrainingConfig::edge(seed), changes));
            };
            let comparison = Comparison {
                name: &name,
                weights,
                parts: first..first + parts,
                steps: &steps,
                seed,
                out: &out,
                adapt: &adapt,
            };
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
            let mean = losses.drain(..).collect::<Vec<_>>();
            let mean = mean.iter().sum::<f64>() / mean.len() as f64;
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

/// A training with some values other than the preset's.
fn changed(training: TrainingConfig, changes: &serde_json::Value) -> TrainingConfig {
    let merged = serde_json::to_value(&training).map(|mut all| {
        if let (Some(all), Some(changes)) = (all.as_object_mut(), changes.as_object()) {
            all.extend(changes.clone());
        }
        all
    });
    merged.and_then(serde_json::from_value).unwrap_or_else(|error| panic!("--training: {error}"))
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
