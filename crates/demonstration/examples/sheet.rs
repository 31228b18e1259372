//! A contact sheet of augmented samples with their marks, for inspection.
//!
//! ```sh
//! cargo run --release -p sdg-demonstration --example sheet -- IMAGE ANNOTATION OUT.png [paper] [seed] [first]
//! ```
//! Without arguments, a built-in part is drawn and `sheet.png` is written. Box green, outline yellow, keypoints from
//! blue (start) to red (end), hidden ones hollow.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_demonstration::{Annotation, AugmentationConfig, Augmenter, Demonstration, Sample};
use sdg_geometry::{GraspLine, Polygon, Visibility};

const COLUMNS: u32 = 6;
const ROWS: u32 = 6;
const CELL: [u32; 2] = [320, 240];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let demonstration = match arguments.as_slice() {
        [image, annotation, ..] => {
            let name = Path::new(image).file_name().and_then(|name| name.to_str());
            Demonstration::decode(&std::fs::read(image)?, &std::fs::read(annotation)?, name)?
        }
        _ => drawn_part(),
    };
    let paper = arguments.iter().any(|argument| argument == "paper");
    let numbers: Vec<u64> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let config = if paper { AugmentationConfig::paper() } else { AugmentationConfig::default() };
    let start = Instant::now();
    let seed = numbers.first().copied().unwrap_or(1);
    let augmenter = Augmenter::new(&[demonstration], config.with_output_size(CELL[0], CELL[1]), seed)?;
    println!("prepared in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);

    let first = numbers.get(1).copied().unwrap_or(0);
    let mut sheet = RgbImage::new(COLUMNS * CELL[0], ROWS * CELL[1]);
    for cell in 0..COLUMNS * ROWS {
        let mut sample = augmenter.sample(first + u64::from(cell));
        mark(&mut sample);
        let corner = [(cell % COLUMNS) * CELL[0], (cell / COLUMNS) * CELL[1]].map(i64::from);
        image::imageops::replace(&mut sheet, &sample.image, corner[0], corner[1]);
    }
    let out = arguments.get(2).map_or("sheet.png", String::as_str);
    sheet.save(out)?;

    const TIMED: u64 = 300;
    let start = Instant::now();
    let pixels: u64 = (0..TIMED).map(|index| u64::from(augmenter.sample(index).image.get_pixel(9, 9)[0])).sum();
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.0} samples/s on one thread (checksum {pixels}), sheet in {out}", TIMED as f64 / seconds);
    Ok(())
}

fn mark(sample: &mut Sample) {
    let image = &mut sample.image;
    for object in &sample.objects {
        if let Some(outline) = &object.outline {
            outline.edges().for_each(|(a, b)| line(image, a, b, Rgb([255, 230, 0])));
        }
        let corners = object.bbox.corners();
        (0..4).for_each(|i| line(image, corners[i], corners[(i + 1) % 4], Rgb([0, 255, 80])));
        let last = object.keypoints.len().max(2) - 1;
        for (i, keypoint) in object.keypoints.iter().enumerate() {
            let t = (255 * i / last) as u8;
            let size = if keypoint.visibility == Visibility::Visible { 1.5 } else { 0.5 };
            for dy in [-size, 0.0, size] {
                for dx in [-size, 0.0, size] {
                    dot(image, keypoint.x + dx, keypoint.y + dy, Rgb([t, 0, 255 - t]));
                }
            }
        }
    }
}

fn dot(image: &mut RgbImage, x: f64, y: f64, color: Rgb<u8>) {
    if x >= 0.0 && y >= 0.0 && x < f64::from(image.width()) && y < f64::from(image.height()) {
        image.put_pixel(x as u32, y as u32, color);
    }
}

fn line(image: &mut RgbImage, a: Point2<f64>, b: Point2<f64>, color: Rgb<u8>) {
    let steps = (b - a).norm().ceil().max(1.0);
    for step in 0..=steps as u32 {
        let p = a + (b - a) * (f64::from(step) / steps);
        dot(image, p.x, p.y, color);
    }
}

/// A lever with an eye at one end on a speckled table.
fn drawn_part() -> Demonstration {
    let outline: Vec<Point2<f64>> = [
        (220.0, 200.0),
        (250.0, 180.0),
        (290.0, 190.0),
        (310.0, 215.0),
        (430.0, 235.0),
        (440.0, 290.0),
        (415.0, 295.0),
        (405.0, 262.0),
        (305.0, 248.0),
        (280.0, 272.0),
        (245.0, 275.0),
        (218.0, 245.0),
    ]
    .map(|(x, y)| Point2::new(x, y))
    .to_vec();
    let outline = Polygon { vertices: outline };
    let image = RgbImage::from_fn(640, 480, |x, y| {
        let p = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let speckle = (x.wrapping_mul(7919) ^ y.wrapping_mul(104_729)) % 23;
        let edge = outline.distance_to_edge(&p);
        if outline.contains(&p) {
            let eye = (p - Point2::new(262.0, 228.0)).norm();
            let shade = if eye < 18.0 { 40.0 } else { 110.0 + edge.min(12.0) * 8.0 };
            Rgb([shade as u8, shade as u8, (shade * 1.1) as u8 + (speckle / 4) as u8])
        } else {
            let shade = if edge < 8.0 { 60.0 + edge * 6.0 } else { 118.0 } + f64::from(speckle);
            Rgb([(shade * 1.1) as u8, shade as u8, (shade * 0.8) as u8])
        }
    });
    let grasp = GraspLine::new(Point2::new(325.0, 233.0), Point2::new(400.0, 248.0));
    let annotation = Annotation {
        label: "lever".into(),
        bbox: outline.bounds(),
        grasp: Some(grasp),
        jaw_width: None,
        outline: Some(outline),
    };
    Demonstration { image, annotation }
}
