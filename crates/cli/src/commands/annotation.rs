//! `sdg annotation`: converts annotation files from one tool's format to another's.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args as ClapArgs, Subcommand};
use sdg_demonstration::AnnotationFormat;
use sdg_inputs::{ConvertedAnnotation, ImageError, convert_annotation};
use serde_json::json;

use crate::exit::{Outcome, Usage};

/// `sdg annotation`
#[derive(Debug, ClapArgs)]
#[command(arg_required_else_help = true)]
pub struct AnnotationArgs {
    /// The command to run.
    #[command(subcommand)]
    pub command: AnnotationCommand,
}

/// The commands of `sdg annotation`.
#[derive(Debug, Subcommand)]
pub enum AnnotationCommand {
    /// Write the marks on one image in another format
    Convert(ConvertAnnotationArgs),
}

/// `sdg annotation convert`
#[derive(Debug, ClapArgs)]
pub struct ConvertAnnotationArgs {
    /// COCO, LabelMe, YOLO-pose (data.yaml beside or above it), OpenDR's boxes_*.npy (kps_*.npy beside it): recognised by content
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// The image; needed if IN has several images or does not state the size of its image
    #[arg(long, value_name = "IMAGE")]
    pub image: Option<PathBuf>,
    /// The format to write: coco, labelme or yolo-pose; default: coco for .json, yolo-pose for .txt
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Runs one of the commands.
pub fn run(args: &AnnotationArgs) -> Result<Outcome> {
    match &args.command {
        AnnotationCommand::Convert(convert) => self::convert(convert),
    }
}

/// Converts a file. Information that the output format cannot hold is listed on standard error and in the JSON.
fn convert(args: &ConvertAnnotationArgs) -> Result<Outcome> {
    let format = format_of_output(args)?;
    if sdg_files::is_same_file(&args.input, &args.output) {
        return Err(Usage(format!("{}: expected an output file other than the input", args.output.display())).into());
    }
    let converted = convert_annotation(&args.input, args.image.as_deref(), &args.output, format);
    let ConvertedAnnotation { input_format, image, labels, left_out, data_yaml } =
        converted.map_err(|error| match error.downcast_ref() {
            Some(ImageError::NoSize { .. } | ImageError::Several { .. }) => Usage(format!("--image: {error}")).into(),
            _ => error,
        })?;
    for left_out in &left_out {
        eprintln!("left out: {left_out}");
    }
    if args.json {
        let line = json!({
            "in": args.input.display().to_string(),
            "in_format": input_format.name(),
            "out": args.output.display().to_string(),
            "out_format": format.name(),
            "data_yaml": data_yaml.map(|path| path.display().to_string()),
            "image": {"file_name": image.file_name, "width": image.width, "height": image.height},
            "objects": labels,
            "left_out": left_out,
        });
        println!("{line}");
    } else {
        println!(
            "wrote {} ({} from {}): {}",
            args.output.display(),
            format.name(),
            input_format.name(),
            labels.join(", ")
        );
        if let Some(path) = data_yaml {
            println!("its labels are in {}", path.display());
        }
    }
    Ok(Outcome::Done)
}

/// The format given by `--format`, or else by the file name's extension.
fn format_of_output(args: &ConvertAnnotationArgs) -> Result<AnnotationFormat> {
    let writable = AnnotationFormat::ALL.into_iter().filter(|format| *format != AnnotationFormat::OpenDr);
    match &args.format {
        Some(name) => writable.clone().find(|format| format.name() == name).ok_or_else(|| {
            let names: Vec<_> = writable.map(AnnotationFormat::name).collect();
            Usage(format!("--format: expected a format out of {}, found \"{name}\"", names.join(", "))).into()
        }),
        None => match args.output.extension().and_then(|ending| ending.to_str()) {
            Some("json") => Ok(AnnotationFormat::Coco),
            Some("txt") => Ok(AnnotationFormat::YoloPose),
            _ => Err(Usage(format!(
                "{}: expected a name that ends in .json (COCO) or .txt (YOLO-pose), or --format",
                args.output.display()
            ))
            .into()),
        },
    }
}
