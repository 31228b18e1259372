//! `sdg augment`: writes augmented samples as pictures and COCO JSON, for inspection.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args as ClapArgs;
use sdg_demonstration::{AugmentationConfig, Augmenter, CocoFile, Sample};
use sdg_evaluation::held_back::{HeldBackSamples, labels_of};
use sdg_grasp::CheckConfig;
use serde_json::json;

use crate::demonstrations;
use crate::exit::{Outcome, Usage};
use crate::output_paths::prepare_new_folder;

/// `sdg augment`
#[derive(Debug, ClapArgs)]
pub struct AugmentArgs {
    /// A photo, followed by a colon and its annotation (COCO, LabelMe, YOLO-pose, OpenDR's boxes_*.npy). The annotation
    /// may be omitted if it is beside the photo (.json, .txt) or in a YOLO dataset's folder of labels; repeat for
    /// several views
    #[arg(long = "demo", required = true, value_name = "IMAGE[:ANNOTATION]")]
    pub demonstrations: Vec<String>,
    /// Number of samples to write
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub count: u32,
    /// Folder to write to, new or empty
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The augmentation: edge (used in teaching), or paper (as in the paper)
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Write the held-out samples instead, of at most 640x480 pixels; `sdg teach` with the same seed tests the finished
    /// model on the first 24 of these samples
    #[arg(long, conflicts_with = "preset")]
    pub held_back: bool,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// The file with the marks of all samples.
const ANNOTATIONS: &str = "annotations.json";

/// Writes the pictures first and the list of their marks last: an interrupted run leaves no list that names missing
/// pictures.
pub fn run(args: &AugmentArgs) -> Result<Outcome> {
    let config = match args.preset.as_str() {
        "edge" => AugmentationConfig::default(),
        "paper" => AugmentationConfig::paper(),
        other => {
            return Err(Usage(format!("--preset: expected a preset out of edge, paper, found \"{other}\"")).into());
        }
    };
    let demonstrations = demonstrations::read_all(&args.demonstrations)?;
    let label = demonstrations[0].annotation.label.clone();
    let sample: Box<dyn Fn(u64) -> Sample> = if args.held_back {
        let held_back = HeldBackSamples::new(&demonstrations, &CheckConfig::DEFAULT_SIZE_TOLERANCE, args.seed)?;
        Box::new(move |i| held_back.sample(i))
    } else {
        let augmenter = Augmenter::new(&demonstrations, config, args.seed)?;
        Box::new(move |i| augmenter.sample(i))
    };
    prepare_new_folder("--out", &args.out)?;

    let mut coco = CocoFile::new();
    let mut with_part = 0;
    for i in 0..u64::from(args.count) {
        let sample = sample(i);
        let name = format!("{i:06}.png");
        sdg_files::write_png(&args.out.join(&name), &sample.image)?;

        let instances = labels_of(&sample, &label);
        with_part += usize::from(!instances.is_empty());
        coco.push_labelled(&name, sample.image.width(), sample.image.height(), &instances);
    }
    sdg_files::write(&args.out.join(ANNOTATIONS), coco.to_json().as_bytes())?;

    let out = args.out.display();
    if args.json {
        println!("{}", json!({"out": out.to_string(), "samples": args.count, "with_part": with_part, "label": label}));
    } else {
        println!("wrote {} samples, {with_part} of them with \"{label}\", and {ANNOTATIONS} to {out}", args.count);
    }
    Ok(Outcome::Done)
}
