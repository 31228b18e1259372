//! `sdg augment`: augmented samples as pictures and COCO JSON, to look at.

use std::io::Cursor;

use anyhow::Result;
use image::ImageFormat;
use sdg_demonstration::{AugmentationConfig, Augmenter, CocoFile, LabelledInstance};
use sdg_report::write_atomically;
use serde_json::json;

use crate::args::AugmentArgs;
use crate::demonstrations;
use crate::exit::{Outcome, Usage};
use crate::files;

/// The file that lists every sample's marks.
const ANNOTATIONS: &str = "annotations.json";

/// Pictures first, the list of them last: a run that breaks off leaves no list of pictures that are not there.
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
    let augmenter = Augmenter::new(&demonstrations, config, args.seed)?;
    files::prepare_folder(&args.out)?;

    let mut coco = CocoFile::new();
    let mut with_part = 0;
    for i in 0..u64::from(args.count) {
        let sample = augmenter.sample(i);
        let name = format!("{i:06}.png");
        let mut png = Cursor::new(Vec::new());
        sample.image.write_to(&mut png, ImageFormat::Png)?;
        write_atomically(&args.out.join(&name), &png.into_inner())?;

        // A part whose grasp the border cuts off need not be found by whoever is tested on the samples.
        let instances: Vec<LabelledInstance> = sample
            .objects
            .iter()
            .map(|object| object.annotation(&label, &sample.image))
            .map(|annotation| LabelledInstance::new(annotation.clone(), annotation.grasp.is_none()))
            .collect();
        with_part += usize::from(!instances.is_empty());
        coco.push_labelled(&name, sample.image.width(), sample.image.height(), &instances);
    }
    write_atomically(&args.out.join(ANNOTATIONS), coco.to_json().as_bytes())?;

    let out = args.out.display();
    if args.json {
        println!("{}", json!({"out": out.to_string(), "samples": args.count, "with_part": with_part, "label": label}));
    } else {
        println!("wrote {} samples, {with_part} of them with \"{label}\", and {ANNOTATIONS} to {out}", args.count);
    }
    Ok(Outcome::Done)
}
