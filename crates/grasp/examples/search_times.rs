//! Search times of model S: `search_times MODEL [--repeat N] [--size-tolerance LOW-HIGH] [--region X,Y,W,H] PICTURE…`.
//!
//! Prints for each picture the median time of its repeats in milliseconds, from the decoded picture to the verdict, and
//! the numbers of accepted and of all detections; then the median time over the pictures. Each repeat goes through all
//! pictures, so that a short load of the machine does not affect one picture alone.

use std::time::Instant;

use burn::tensor::Device;
use sdg_demonstration::{ImageLimits, decode_image};
use sdg_geometry::upper_median;
use sdg_grasp::{GraspModel, SearchRegion, Verification};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let model_path = arguments
        .next()
        .ok_or("usage: search_times MODEL [--repeat N] [--size-tolerance LOW-HIGH] [--region X,Y,W,H] PICTURE…")?;
    let mut model = GraspModel::from_bytes(&std::fs::read(model_path)?, &Device::flex())?;
    let (mut repeats, mut paths) = (15, Vec::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--repeat" => repeats = arguments.next().ok_or("--repeat needs a number")?.parse()?,
            "--size-tolerance" => {
                let range = arguments.next().ok_or("--size-tolerance needs LOW-HIGH")?;
                let (low, high) = range.split_once('-').ok_or("--size-tolerance needs LOW-HIGH")?;
                model = model.with_size_tolerance(low.parse()?..=high.parse()?)?;
            }
            "--region" => {
                let text = arguments.next().ok_or("--region needs X,Y,W,H")?;
                let numbers = text.split(',').map(str::parse).collect::<Result<Vec<u32>, _>>()?;
                let numbers = <[u32; 4]>::try_from(numbers).map_err(|_| "--region needs four numbers")?;
                model = model.with_region(Some(SearchRegion::new(numbers)))?;
            }
            _ => paths.push(argument),
        }
    }
    let decoded = |path: &String| {
        Ok::<_, Box<dyn std::error::Error>>(decode_image(&std::fs::read(path)?, &ImageLimits::default())?)
    };
    let images = paths.iter().map(decoded).collect::<Result<Vec<_>, _>>()?;

    let mut times = vec![Vec::new(); images.len()];
    let mut found = vec![(0, 0); images.len()];
    for round in 0..=repeats {
        for (k, image) in images.iter().enumerate() {
            let start = Instant::now();
            let detections = model.detect(image, Verification::ByShape)?;
            // The first round prepares the model for the pictures' sizes.
            if round > 0 {
                times[k].push(1e3 * start.elapsed().as_secs_f64());
            }
            found[k] = (detections.iter().filter(|d| d.is_accepted()).count(), detections.len());
        }
    }
    let middle = |times: Vec<f64>| upper_median(times).unwrap_or(f64::NAN);
    let medians: Vec<f64> = times.into_iter().map(middle).collect();
    for ((path, image), (ms, (accepted, seen))) in paths.iter().zip(&images).zip(medians.iter().zip(&found)) {
        println!("{ms:8.1} ms  {}×{}  {accepted} accepted of {seen}  {path}", image.width(), image.height());
    }
    println!("{:8.1} ms  median of {} pictures", middle(medians.clone()), medians.len());
    Ok(())
}
