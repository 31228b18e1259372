//! Writes photos of generated parts with their marks, in the format for `sdg teach --demos`; the last two photos show
//! the same part.
//!
//! ```sh
//! cargo run --release -p sdg-part-generator --example demonstrations -- target/many-parts 100
//! ```

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use sdg_demonstration::CocoFile;
use sdg_geometry::RotationalSymmetry;
use sdg_part_generator::{Part, PhotoConfig, demonstration};

/// Far from the seeds of all parts used for fitting, teaching or pretraining.
const FIRST_SEED: u64 = 1 << 53;
const PHOTO: PhotoConfig = PhotoConfig { width: 320, height: 240, fill: [0.4, 0.6] };

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "expected a folder and a number of parts, two at least";
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, count] = arguments.as_slice() else { return Err(usage.into()) };
    let count: u64 = count.parse().ok().filter(|&count| count >= 2).ok_or(usage)?;
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder)?;
    let mut symmetries = String::new();
    for number in 0..count {
        let part = Part::generate(FIRST_SEED + number.min(count - 2));
        // The seed `number` gives a different photo even for the same part.
        let made = demonstration(&part, &PHOTO, number);
        let name = format!("part-{number:03}");
        made.image.save(folder.join(format!("{name}.png")))?;
        let mut coco = CocoFile::new();
        let [width, height] = [made.image.width(), made.image.height()];
        coco.push_image(&format!("{name}.png"), width, height, std::slice::from_ref(&made.annotation));
        std::fs::write(folder.join(format!("{name}.json")), coco.to_json())?;
        match part.symmetry() {
            RotationalSymmetry::Fold(fold) => writeln!(symmetries, "{name} {fold}")?,
            RotationalSymmetry::Full => writeln!(symmetries, "{name} full")?,
            _ => {}
        }
    }
    std::fs::write(folder.join("symmetries.txt"), symmetries)?;
    Ok(())
}
