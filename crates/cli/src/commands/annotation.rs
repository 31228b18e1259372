//! `sdg annotation`: converts annotation files from one tool's format to another's.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args as ClapArgs, Subcommand};
use sdg_demonstration::{Annotation, AnnotationFormat, DeclaredImage, ImageFacts};
use sdg_inputs::annotation_files::{AnnotationFile, write_data_yaml};
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
    sdg_files::check_writable(&args.output)?;
    let input = AnnotationFile::read(&args.input)?;
    let (width, height, file_name, objects) = read_marks(args, &input)?;
    let image = ImageFacts { width, height, file_name: file_name.as_deref() };
    let written = format.write(&image, &objects)?;

    let data_yaml = write_data_yaml(&args.output, &written, &image, &objects)?;
    sdg_files::write(&args.output, written.text.as_bytes())?;
    for left_out in &written.left_out {
        eprintln!("left out: {left_out}");
    }
    if args.json {
        let line = json!({
            "in": args.input.display().to_string(),
            "in_format": input.format.name(),
            "out": args.output.display().to_string(),
            "out_format": format.name(),
            "data_yaml": data_yaml.map(|path| path.display().to_string()),
            "image": {"file_name": file_name, "width": width, "height": height},
            "objects": objects.iter().map(|object| &object.label).collect::<Vec<_>>(),
            "left_out": written.left_out,
        });
        println!("{line}");
    } else {
        let labels: Vec<_> = objects.iter().map(|object| object.label.as_str()).collect();
        println!(
            "wrote {} ({} from {}): {}",
            args.output.display(),
            format.name(),
            input.format.name(),
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

/// Reads the marks and the size and name of their image: from the image itself if it is given, otherwise from the
/// file's only entry.
fn read_marks(
    args: &ConvertAnnotationArgs,
    input: &AnnotationFile,
) -> Result<(u32, u32, Option<String>, Vec<Annotation>)> {
    if let Some(path) = &args.image {
        let image = sdg_inputs::read_image(path)?;
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        return Ok((image.width(), image.height(), name, input.objects_on(path, &image)?));
    }
    let DeclaredImage { file_name, width, height } = declared_image(args, input)?;
    let objects = input.objects(&ImageFacts { width, height, file_name: file_name.as_deref() })?;
    input.report_skipped();
    Ok((width, height, file_name, objects))
}

/// The file's entry for its only image.
fn declared_image(args: &ConvertAnnotationArgs, input: &AnnotationFile) -> Result<DeclaredImage> {
    let mut declared =
        AnnotationFormat::declared_images(input.bytes()).with_context(|| args.input.display().to_string())?;
    match declared.len() {
        1 => Ok(declared.remove(0)),
        0 => Err(Usage(format!(
            "--image: {} does not state the size of its image; expected the image",
            args.input.display()
        ))
        .into()),
        several => {
            Err(Usage(format!("--image: expected one of the {several} images of {}", args.input.display())).into())
        }
    }
}
