//! Time per sample on one thread: the paper's samples at the photo's size and at a network's input size, and scenes as
//! whole frames and as windows.
//!
//! ```sh
//! cargo run --release -p sdg-demonstration --example pace -- IMAGE ANNOTATION [SAMPLES]
//! ```

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration, Sample};

/// Width and height of the edge preset's input.
const FRAME: [u32; 2] = [320, 240];
/// Sides of windows are multiples of this.
const WINDOW_MULTIPLE: u32 = 32;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, annotation, rest @ ..] = arguments.as_slice() else {
        return Err("expected IMAGE ANNOTATION [SAMPLES]".into());
    };
    let samples = rest.first().map_or(Ok(300), |count| count.parse::<u64>())?;
    let name = Path::new(image).file_name().and_then(|name| name.to_str());
    let demonstration = Demonstration::decode(&std::fs::read(image)?, &std::fs::read(annotation)?, name)?;
    let demonstration = std::slice::from_ref(&demonstration);

    let [width, height] = FRAME;
    let scenes = || AugmentationConfig::default().with_output_size(width, height);
    let photo_sized = Augmenter::new(demonstration, AugmentationConfig::paper(), 1)?;
    let input_sized = Augmenter::new(demonstration, AugmentationConfig::paper().with_output_size(width, height), 1)?;
    let frames = Augmenter::new(demonstration, scenes(), 1)?;
    let windows = frames.windows(WINDOW_MULTIPLE);
    let kinds: [(&str, &dyn Fn(u64) -> Sample); 4] = [
        ("paper, the photo's size", &|i| photo_sized.sample(i)),
        ("paper, input size", &|i| input_sized.sample(i)),
        ("scene, frame", &|i| frames.sample(i)),
        ("scene, window", &|i| windows.sample(i)),
    ];
    for (kind, sample) in kinds {
        let (width, height) = sample(0).image.dimensions();
        let start = Instant::now();
        let pixels: u64 = (0..samples).map(|i| u64::from(sample(i).image.get_pixel(9, 9)[0])).sum();
        let millis = start.elapsed().as_secs_f64() * 1e3 / samples as f64;
        println!("{kind:24} {width:4}×{height:<4} {millis:7.3} ms a sample (checksum {pixels})");
    }
    Ok(())
}
