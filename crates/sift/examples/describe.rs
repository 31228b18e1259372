//! Detects and describes the PNG pictures of a folder and writes the features beside them, for comparison with other
//! implementations (`compare/side_by_side.py` reads the files).
//!
//! Usage: `cargo run --release -p sdg-sift --example describe -- FOLDER [--repeats N] [--clipped]`
//!
//! For `NAME.png`, `NAME.sift` holds rows of 5 + 128 little-endian 32-bit floats: x, y (first pixel's centre at 0.5),
//! σ, angle in degrees, contrast, descriptor. Prints one JSON object: the best and the median time in seconds for each
//! picture, including the conversion from 8-bit grey but without reading and writing.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use sdg_sift::{DescriptorNormalization, Features, Plane, Sift, SiftConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut folder: Option<PathBuf> = None;
    let mut repeats = 1usize;
    let mut config = SiftConfig::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--repeats" => repeats = arguments.next().ok_or("expected a number after --repeats")?.parse()?,
            "--clipped" => config.normalization = DescriptorNormalization::Clipped,
            _ => folder = Some(argument.into()),
        }
    }
    let folder = folder.ok_or("expected a folder of PNG pictures")?;
    let sift = Sift::new(config)?;

    let mut pictures: Vec<PathBuf> =
        std::fs::read_dir(&folder)?.map(|e| Ok(e?.path())).collect::<std::io::Result<_>>()?;
    pictures.retain(|path| path.extension().is_some_and(|extension| extension == "png"));
    pictures.sort();
    let mut seconds = BTreeMap::new();
    for path in pictures {
        let gray = image::open(&path)?.into_luma8();
        let mut times = Vec::new();
        let mut features = Features::default();
        for _ in 0..repeats.max(1) {
            let start = Instant::now();
            features = sift.detect_and_describe(&Plane::from_gray(&gray), None)?;
            times.push(start.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        seconds.insert(name, [times[0], times[times.len() / 2]]);

        let mut bytes = Vec::new();
        for (keypoint, descriptor) in features.keypoints.iter().zip(&features.descriptors) {
            let place = [keypoint.position.x, keypoint.position.y, keypoint.sigma];
            let rest = [keypoint.angle.degrees(), keypoint.contrast];
            let numbers = place.into_iter().chain(rest).map(|v| v as f32).chain(descriptor.iter().copied());
            numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        }
        std::fs::File::create(path.with_extension("sift"))?.write_all(&bytes)?;
    }
    println!("{}", serde_json::to_string(&seconds)?);
    Ok(())
}
