//! Compares proposed outlines with drawn ones, without clicks and after one and two clicks of a simulated person.
//! Prints the overlap, the fraction of the true outline within 3 px (or 1 % of the part's diagonal if that is more),
//! the time, and at the end the medians of overlap and fraction, and the number of outlines with a fraction of at least
//! 90 %.
//!
//! ```sh
//! cargo run --release -p sdg-demonstration --example outlines -- PICTURE[:ANNOTATION] …
//! ```
//! The default annotation is the .json file beside the picture; every outline in it counts.

#[path = "../tests/outlines/simulated_person.rs"]
mod simulated_person;

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use sdg_demonstration::{Annotation, ImageFacts, ImageLimits, decode_image};
use simulated_person::{agreement, outlines};

const NUM_CLICKS: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let mut all: Vec<Vec<simulated_person::Agreement>> = vec![Vec::new(); NUM_CLICKS + 1];
    for argument in std::env::args().skip(1) {
        let (picture, annotation) = match argument.split_once(':') {
            Some((picture, annotation)) => (PathBuf::from(picture), PathBuf::from(annotation)),
            None => (PathBuf::from(&argument), PathBuf::from(&argument).with_extension("json")),
        };
        let image = decode_image(&std::fs::read(&picture)?, &ImageLimits::default())?;
        let file_name = picture.file_name().and_then(|name| name.to_str());
        let facts = ImageFacts { width: image.width(), height: image.height(), file_name };
        for object in Annotation::read(&std::fs::read(annotation)?, &facts)? {
            let Some(truth) = object.outline else { continue };
            let start = Instant::now();
            let proposed = outlines(&image, &object.bbox, &truth, NUM_CLICKS);
            let millis = start.elapsed().as_secs_f64() * 1e3;
            print!("{:60}", picture.display());
            for (clicks, all) in all.iter_mut().enumerate() {
                let outline = proposed.get(clicks).or(proposed.last()).ok_or("no outline")?;
                let agreement = agreement(outline, &truth, &image);
                print!("  {:.3} {:3.0} %", agreement.iou, 100.0 * agreement.near);
                all.push(agreement);
            }
            println!("  {millis:.0} ms");
        }
    }
    for (clicks, all) in all.iter().enumerate() {
        let median = |value: fn(&simulated_person::Agreement) -> f64| {
            sdg_geometry::median(all.iter().map(value)).unwrap_or(f64::NAN)
        };
        let reached = all.iter().filter(|one| one.near >= 0.9).count();
        println!(
            "{clicks} clicks: median overlap {:.3}, median fraction within the tolerance {:.0} %; {reached} of {} have at least 90 %",
            median(|one| one.iou),
            100.0 * median(|one| one.near),
            all.len()
        );
    }
    Ok(())
}
