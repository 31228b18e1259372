//! Writes photos of generated parts with their true outlines, in the format of
//! crates/demonstration/tests/outlines.
//!
//! ```sh
//! cargo run --release -p sdg-part-generator --example outline_pictures -- crates/demonstration/tests/outlines 15
//! ```

use std::error::Error;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use sdg_demonstration::CocoFile;
use sdg_part_generator::{Part, PhotoConfig, demonstration};

/// Far from the seeds of all parts used for fitting, teaching or pretraining.
const FIRST_SEED: u64 = 1 << 52;
const PHOTO: PhotoConfig = PhotoConfig { width: 320, height: 240, fill: [0.4, 0.6] };
const JPEG_QUALITY: u8 = 90;

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "expected a folder and a number of pictures";
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, count] = arguments.as_slice() else { return Err(usage.into()) };
    let count: u64 = count.parse().map_err(|_| usage)?;
    for number in 0..count {
        let mut made = demonstration(&Part::generate(FIRST_SEED + number), &PHOTO, number);
        // Only outlines are compared; a grasp line may extend beyond the picture.
        (made.annotation.grasp, made.annotation.jaw_width) = (None, None);
        let name = format!("generated-{number:02}.jpg");
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(&made.image)?;
        std::fs::write(Path::new(folder).join(&name), bytes)?;
        let mut coco = CocoFile::new();
        coco.push_image(&name, made.image.width(), made.image.height(), std::slice::from_ref(&made.annotation));
        std::fs::write(Path::new(folder).join(name).with_extension("json"), coco.to_json())?;
    }
    Ok(())
}
