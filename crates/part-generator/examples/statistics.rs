//! Compares generated pictures with folders of others by simple statistics, as a Markdown table.
//!
//! Usage: `cargo run --release -p sdg-part-generator --example statistics [FOLDER…]`
//!
//! A row describes the generator's default scenes of 60 parts, or all pictures of a folder (PNG, JPEG; LabelMe marks in
//! a `.json` beside a picture are read for the part's size and contrast). Pictures are first reduced to a width of 320
//! pixels. The columns after the number of pictures are means over pictures: brightness, its standard deviation within
//! a picture, saturation, the 50th, 90th and 99th percentile of the gradient's magnitude (grey levels per pixel), the
//! fraction of pixels with a gradient above 40, and noise (Immerkær's estimate). The last two columns are means over
//! parts: the part's diagonal divided by the picture's, and the colour distance between the part's box and the frame
//! around it.

use std::path::Path;

use image::imageops::FilterType;
use image::{GrayImage, RgbImage, imageops};
use rayon::prelude::*;
use sdg_demonstration::{Annotation, ImageFacts};
use sdg_geometry::BoundingBox;
use sdg_part_generator::{Part, SceneConfig, Scenes};

/// Width to which pictures are reduced.
const WIDTH: u32 = 320;

/// Minimum gradient of strong edges, in grey levels per pixel.
const STRONG_EDGE: f32 = 40.0;

/// Measurements of a picture: the values of all columns except the last two, and these two values for each box.
struct Measured {
    values: [f64; 8],
    parts: Vec<[f64; 2]>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| pictures | number | brightness | deviation | saturation | gradient 50 % | 90 % | 99 % | strong edges | noise | part / picture | contrast |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let parts: Vec<Part> = (0..60).into_par_iter().map(|k| Part::generate(5000 + k)).collect();
    let scenes = Scenes::new(&parts, SceneConfig::default(), 5)?;
    let generated: Vec<Measured> = (0..300u64)
        .into_par_iter()
        .map(|k| {
            let sample = scenes.sample(k);
            let boxes: Vec<BoundingBox> = sample.instances.iter().map(|instance| instance.bbox).collect();
            measure(&sample.image, &boxes)
        })
        .collect();
    print_row("generated", &generated);
    for folder in std::env::args().skip(1) {
        let mut paths: Vec<_> = std::fs::read_dir(&folder)?.filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.sort();
        paths.retain(|path| {
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
            ["png", "jpg", "jpeg"].contains(&extension.as_str())
        });
        let measured: Vec<Measured> = paths.par_iter().filter_map(|path| read(path)).collect();
        let name = Path::new(&folder).file_name().and_then(|name| name.to_str()).unwrap_or("folder").to_owned();
        print_row(&name, &measured);
    }
    Ok(())
}

/// A picture of a folder, reduced, with its marked boxes.
fn read(path: &Path) -> Option<Measured> {
    let image = image::open(path).ok()?.into_rgb8();
    let facts = ImageFacts { width: image.width(), height: image.height(), file_name: path.file_name()?.to_str() };
    let marks = std::fs::read(path.with_extension("json")).ok();
    let boxes = marks.and_then(|bytes| Annotation::read(&bytes, &facts).ok()).unwrap_or_default();
    let factor = f64::from(WIDTH) / f64::from(image.width());
    let height = (f64::from(image.height()) * factor).round() as u32;
    let reduced = imageops::resize(&image, WIDTH, height, FilterType::Triangle);
    let boxes: Vec<BoundingBox> = boxes.iter().map(|marked| marked.bbox.scaled(factor, factor)).collect();
    Some(measure(&reduced, &boxes))
}

fn measure(image: &RgbImage, boxes: &[BoundingBox]) -> Measured {
    let grey: GrayImage = imageops::grayscale(image);
    let (width, height) = grey.dimensions();
    let at = |x: u32, y: u32| f32::from(grey.get_pixel(x, y).0[0]);
    let n = f64::from(width * height);
    let mean = grey.pixels().map(|p| f64::from(p.0[0])).sum::<f64>() / n;
    let variance = grey.pixels().map(|p| (f64::from(p.0[0]) - mean).powi(2)).sum::<f64>() / n;
    let saturation = image
        .pixels()
        .map(|p| {
            let (low, high) = (p.0.iter().min().unwrap_or(&0), p.0.iter().max().unwrap_or(&0));
            f64::from(high - low) / f64::from(*high).max(1.0)
        })
        .sum::<f64>()
        / n;
    let mut gradients = Vec::new();
    let mut noise = 0.0;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let dx = 0.5 * (at(x + 1, y) - at(x - 1, y));
            let dy = 0.5 * (at(x, y + 1) - at(x, y - 1));
            gradients.push(dx.hypot(dy));
            let corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
            let sides = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
            noise += f64::from((corners - 2.0 * sides + 4.0 * at(x, y)).abs());
        }
    }
    gradients.sort_by(f32::total_cmp);
    let percentile = |share: f64| f64::from(gradients[(share * (gradients.len() - 1) as f64) as usize]);
    let strong = gradients.iter().filter(|&&g| g > STRONG_EDGE).count() as f64 / gradients.len() as f64;
    // Immerkær 1996.
    let sigma = (std::f64::consts::PI / 2.0).sqrt() / 6.0 * noise / gradients.len() as f64;
    let diagonal = f64::from(width).hypot(f64::from(height));
    let parts =
        boxes.iter().map(|bbox| [bbox.width().hypot(bbox.height()) / diagonal, contrast(image, bbox)]).collect();
    let values =
        [mean, variance.sqrt(), saturation, percentile(0.5), percentile(0.9), percentile(0.99), 100.0 * strong, sigma];
    Measured { values, parts }
}

/// Distance between the mean colours of a box and of a frame around it. The frame's width is a fifth of the box's size.
fn contrast(image: &RgbImage, bbox: &BoundingBox) -> f64 {
    let mut sums = [[0.0f64; 4]; 2];
    let (mx, my) = (0.2 * bbox.width(), 0.2 * bbox.height());
    for (x, y, pixel) in image.enumerate_pixels() {
        let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let within =
            |mx: f64, my: f64| px > bbox.x1 - mx && px < bbox.x2 + mx && py > bbox.y1 - my && py < bbox.y2 + my;
        let sum = match (within(0.0, 0.0), within(mx, my)) {
            (true, _) => &mut sums[0],
            (false, true) => &mut sums[1],
            _ => continue,
        };
        (0..3).for_each(|k| sum[k] += f64::from(pixel.0[k]));
        sum[3] += 1.0;
    }
    let mean = |k: usize, i: usize| sums[i][k] / sums[i][3].max(1.0);
    (0..3).map(|k| (mean(k, 0) - mean(k, 1)).powi(2)).sum::<f64>().sqrt()
}

fn print_row(name: &str, measured: &[Measured]) {
    let n = measured.len().max(1) as f64;
    let mean = |k: usize| measured.iter().map(|m| m.values[k]).sum::<f64>() / n;
    let parts: Vec<[f64; 2]> = measured.iter().flat_map(|m| m.parts.iter().copied()).collect();
    let of_parts = |k: usize| {
        if parts.is_empty() {
            "–".into()
        } else {
            format!("{:.2}", parts.iter().map(|p| p[k]).sum::<f64>() / parts.len() as f64)
        }
    };
    println!(
        "| {name} | {} | {:.0} | {:.0} | {:.2} | {:.1} | {:.1} | {:.1} | {:.2} % | {:.1} | {} | {} |",
        measured.len(),
        mean(0),
        mean(1),
        mean(2),
        mean(3),
        mean(4),
        mean(5),
        mean(6),
        mean(7),
        of_parts(0),
        of_parts(1)
    );
}
