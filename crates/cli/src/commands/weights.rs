//! `sdg weights`: Detectron2 and torchvision checkpoints.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{Args as ClapArgs, Subcommand};
use sdg_inputs::ConfigError;
use sdg_inputs::base_weights::open;
use sdg_inputs::checkpoints::{conversion_target, verify_checkpoint};
use sdg_inputs::detector_config::read_config;
use sdg_weights_conversion::{Conversion, Precision, naming_of, sha256_of};
use serde_json::json;

use crate::clock;
use crate::commands::devices;
use crate::exit::{Outcome, Usage};
use crate::shared_args::ComputeArgs;

/// `sdg weights`
#[derive(Debug, ClapArgs)]
#[command(arg_required_else_help = true)]
pub struct WeightsArgs {
    /// The command to run.
    #[command(subcommand)]
    pub command: WeightsCommand,
}

/// The commands of `sdg weights`.
#[derive(Debug, Subcommand)]
pub enum WeightsCommand {
    /// Convert a checkpoint to this project's safetensors, with a report on every tensor name
    Convert(ConvertArgs),
    /// Print the contents of a checkpoint, without converting it
    Inspect(InspectArgs),
    /// Compare the detector of a checkpoint, stage by stage, with the outputs of the original implementation
    Verify(VerifyArgs),
}

/// `sdg weights convert`
#[derive(Debug, ClapArgs)]
pub struct ConvertArgs {
    /// Detectron2 .pkl or .pth, torchvision .pth, safetensors: recognised by content, not by name
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// The detector: r50-detectron2, r50-torchvision; default: recognised by the names in the checkpoint
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    pub preset: Option<String>,
    /// The detector's configuration as JSON, for other widths and depths
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Store kernels and matrices in half precision, which halves the file
    #[arg(long)]
    pub f16: bool,
    /// Leave parameters with this prefix at their initial values, such as roi_heads.box_predictor; repeat for several
    #[arg(long = "reinit", value_name = "PREFIX")]
    pub reinitialized: Vec<String>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg weights inspect`
#[derive(Debug, ClapArgs)]
pub struct InspectArgs {
    /// A checkpoint of any format that convert reads
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg weights verify`
#[derive(Debug, ClapArgs)]
pub struct VerifyArgs {
    /// A checkpoint of any format that convert reads, or a converted file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The detector's configuration as JSON; a converted file contains its own
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The input image of the original's outputs
    #[arg(long, value_name = "IMAGE")]
    pub image: PathBuf,
    /// Outputs of the original at each stage: safetensors
    #[arg(long, value_name = "FILE")]
    pub against: PathBuf,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Runs one of the commands.
pub fn run(args: &WeightsArgs) -> Result<Outcome> {
    match &args.command {
        WeightsCommand::Convert(convert) => self::convert(convert),
        WeightsCommand::Inspect(inspect) => self::inspect(inspect),
        WeightsCommand::Verify(verify) => self::verify(verify),
    }
}

/// Adds the names of the options that the error concerns; `detector` names those that describe the command's detector.
fn in_options(error: anyhow::Error, detector: &str) -> anyhow::Error {
    match error.downcast_ref() {
        Some(ConfigError::UnknownPreset { .. }) => Usage(format!("--preset: {error}")).into(),
        Some(ConfigError::OwnNames) => {
            Usage(format!("expected {detector} for a file with this project's names")).into()
        }
        _ => error,
    }
}

/// Prints the whole report, even if tensors are missing, and writes the file unless there is an error.
fn convert(args: &ConvertArgs) -> Result<Outcome> {
    let named = || args.input.display().to_string();
    let (mut source, checkpoint) = open(&args.input)?;
    let target = conversion_target(&checkpoint, args.config.as_deref(), args.preset.as_deref());
    let target = target.map_err(|error| in_options(error, "--preset or --config"));
    let (architecture, metadata) = target.with_context(named)?;
    let conversion = Conversion::plan(&checkpoint, &architecture, &args.reinitialized).with_context(named)?;
    let precision = if args.f16 { Precision::F16 } else { Precision::F32 };
    let paths = [args.input.as_path(), args.output.as_path()];
    let report = conversion.report();
    if !args.json {
        print!("{report}");
    }
    let written = conversion.write(&checkpoint, &mut source, paths, precision, &metadata);
    let seconds = clock::elapsed_secs();
    if args.json {
        let line = json!({
            "in": args.input.display().to_string(),
            "out": written.is_ok().then(|| args.output.display().to_string()),
            "seconds": seconds,
            "precision": precision,
            "parameters": conversion.num_parameters(),
            "written": written.as_ref().ok(),
            "report": report,
        });
        println!("{line}");
    }
    let written = written.with_context(named)?;
    if !args.json {
        println!(
            "wrote {} from {} ({}, names of {}): {}; {} values, {} bytes, {seconds:.1} s",
            args.output.display(),
            args.input.display(),
            report.format,
            report.naming,
            report.summary(),
            conversion.num_parameters(),
            written.bytes,
        );
    }
    Ok(Outcome::Done)
}

fn inspect(args: &InspectArgs) -> Result<Outcome> {
    let (source, checkpoint) = open(&args.file)?;
    let sha256 = sha256_of(&args.file).with_context(|| args.file.display().to_string())?;
    // A checkpoint whose naming is unknown is shown as well.
    let naming = naming_of(&checkpoint).ok();
    let types: Vec<_> = checkpoint.element_types().iter().map(|(e, count)| format!("{count} {}", e.name())).collect();
    let mut stdout = std::io::stdout().lock();
    if args.json {
        let mut line = checkpoint.to_json();
        line["file"] = json!(args.file.display().to_string());
        line["naming"] = json!(naming);
        line["bytes"] = json!(source.len());
        line["sha256"] = json!(sha256);
        writeln!(stdout, "{line}")?;
        return Ok(Outcome::Done);
    }
    writeln!(stdout, "file        {}, {} bytes", args.file.display(), source.len())?;
    writeln!(stdout, "sha256      {sha256}")?;
    writeln!(stdout, "format      {}", checkpoint.format)?;
    writeln!(stdout, "names       {}", naming.map_or("unknown".to_owned(), |naming| naming.to_string()))?;
    if let Some(author) = &checkpoint.author {
        writeln!(stdout, "author      {author}")?;
    }
    writeln!(stdout, "tensors     {}; {} values in floats", types.join(", "), checkpoint.num_parameters())?;
    for (key, value) in &checkpoint.metadata {
        writeln!(stdout, "metadata    {} = {}", one_line(key), one_line(value))?;
    }
    for (name, tensor) in &checkpoint.tensors {
        writeln!(stdout, "tensor      {} {:?} {}", one_line(name), tensor.shape(), tensor.element().name())?;
    }
    for name in &checkpoint.not_tensors {
        writeln!(stdout, "no tensor   {}", one_line(name))?;
    }
    Ok(Outcome::Done)
}

/// Builds the detector, loads the weights and compares the outputs. Writes no file.
fn verify(args: &VerifyArgs) -> Result<Outcome> {
    let config = args.config.as_deref().map(read_config).transpose()?;
    let image = sdg_inputs::read_image(&args.image)?;
    let device = devices::open(&args.compute)?;
    let verified = verify_checkpoint(&args.file, config, &image, &args.against, &device);
    let report = verified.map_err(|error| in_options(error, "--config"))?;
    if args.json {
        println!("{}", json!({"passed": report.passed(), "stages": report.stages}));
    } else {
        print!("{report}");
    }
    match report.stages.iter().find(|stage| !stage.passed) {
        None if report.passed() => Ok(Outcome::Done),
        None => bail!("{}: expected outputs of the detector's stages, found none", args.against.display()),
        Some(first) => {
            let failed = report.stages.iter().filter(|stage| !stage.passed).count();
            bail!("{failed} of {} stages outside their tolerance (first: {})", report.stages.len(), first.name)
        }
    }
}

/// A text from a file, on one line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}
