//! `sdg weights`: Detectron2 and torchvision checkpoints.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use sdg_detection::RcnnConfig;
use sdg_weights_conversion::architecture::Backbone;
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Naming, Precision, Source, naming_of, sha256_of};
use serde_json::json;

use crate::args::{ConvertArgs, InspectArgs, WeightsArgs, WeightsCommand};
use crate::detector_config::{architecture_of, preset, preset_for, read_config};
use crate::exit::Outcome;

/// Runs one of the verbs.
pub fn run(args: &WeightsArgs) -> Result<Outcome> {
    match &args.command {
        WeightsCommand::Convert(convert) => self::convert(convert),
        WeightsCommand::Inspect(inspect) => self::inspect(inspect),
    }
}

fn open(path: &Path) -> Result<(Source, Checkpoint)> {
    let named = || path.display().to_string();
    let mut source = Source::open(path).with_context(named)?;
    let checkpoint = Checkpoint::read(&mut source).with_context(named)?;
    Ok((source, checkpoint))
}

/// The network to fill, and the metadata that says which one it is.
fn target(args: &ConvertArgs, checkpoint: &Checkpoint) -> Result<(Architecture, BTreeMap<String, String>)> {
    let naming = naming_of(checkpoint)?;
    let mut metadata = BTreeMap::new();
    if let Some(path) = &args.config {
        let config = read_config(path)?;
        metadata.insert("network".to_owned(), serde_json::to_string(&config)?);
        return Ok((architecture_of(&config), metadata));
    }
    if naming.is_backbone_alone() && args.preset.is_none() {
        metadata.insert("part".to_owned(), "backbone.bottom_up".to_owned());
        return Ok((Architecture { backbone: Backbone::of(checkpoint, naming)?, heads: None }, metadata));
    }
    let stored = checkpoint.metadata.get("network").filter(|_| naming == Naming::Ours && args.preset.is_none());
    let config: RcnnConfig = match stored {
        Some(network) => serde_json::from_str(network).context("metadata \"network\"")?,
        None => {
            let name = match &args.preset {
                Some(name) => name,
                None => preset_for(naming)?,
            };
            metadata.insert("preset".to_owned(), name.to_owned());
            preset(name, checkpoint)?
        }
    };
    metadata.insert("network".to_owned(), serde_json::to_string(&config)?);
    Ok((architecture_of(&config), metadata))
}

/// The report comes first, whole even where something is missing; then the file is written, or nothing is.
fn convert(args: &ConvertArgs) -> Result<Outcome> {
    let start = Instant::now();
    let named = || args.input.display().to_string();
    let (mut source, checkpoint) = open(&args.input)?;
    let (architecture, metadata) = target(args, &checkpoint).with_context(named)?;
    let conversion = Conversion::plan(&checkpoint, &architecture, &args.reinitialized).with_context(named)?;
    let precision = if args.f16 { Precision::F16 } else { Precision::F32 };
    let paths = [args.input.as_path(), args.output.as_path()];
    let report = conversion.report();
    let mut stdout = std::io::stdout().lock();
    if !args.json {
        write!(stdout, "{report}")?;
    }
    let written = conversion.write(&checkpoint, &mut source, paths, precision, &metadata);
    let seconds = start.elapsed().as_secs_f64();
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
        writeln!(stdout, "{line}")?;
    }
    let written = written.with_context(named)?;
    if !args.json {
        writeln!(
            stdout,
            "wrote {} from {} ({}, names of {}): {}; {} values, {} bytes, {seconds:.1} s",
            args.output.display(),
            args.input.display(),
            report.format,
            report.naming,
            report.summary(),
            conversion.num_parameters(),
            written.bytes,
        )?;
    }
    Ok(Outcome::Done)
}

fn inspect(args: &InspectArgs) -> Result<Outcome> {
    let (source, checkpoint) = open(&args.file)?;
    let sha256 = sha256_of(&args.file).with_context(|| args.file.display().to_string())?;
    // Unknown names are worth looking at, too.
    let naming = naming_of(&checkpoint).ok();
    let types: Vec<_> = checkpoint.element_types().iter().map(|(e, count)| format!("{count} {}", e.name())).collect();
    let mut stdout = std::io::stdout().lock();
    if args.json {
        let tensors: Vec<_> = checkpoint
            .tensors
            .iter()
            .map(|(name, tensor)| json!({"name": name, "shape": tensor.shape(), "dtype": tensor.element().name()}))
            .collect();
        let line = json!({
            "file": args.file.display().to_string(),
            "format": checkpoint.format.to_string(),
            "naming": naming,
            "author": checkpoint.author,
            "bytes": source.len(),
            "sha256": sha256,
            "parameters": checkpoint.num_parameters(),
            "metadata": checkpoint.metadata,
            "tensors": tensors,
            "not_tensors": checkpoint.not_tensors,
        });
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

/// A text from a file, whatever it holds, on one line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}
