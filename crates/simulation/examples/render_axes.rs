//! Renders pictures of all axes of some parts, with the ground truth marked, onto one sheet per part, for inspection.
//!
//! `cargo run --release -p sdg-simulation --example render_axes FOLDER [SEED [PART …]]`
//!
//! Writes `PART.png` into FOLDER, with a row per axis and its range from left to right, and prints each picture's
//! parameter, the visible fraction of each instance, and the rendering time.

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use image::imageops::{FilterType, overlay, resize};
use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{Axis, AxisView, PICTURES_PER_AXIS, axis_view};

/// Number of pictures of each axis on the sheet.
const COLUMNS: u64 = 5;
/// Width of a picture on the sheet, in pixels.
const WIDTH: u32 = 400;
const HEIGHT: u32 = 300;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("usage: render_axes FOLDER [SEED [PART …]]")?);
    let seed: u64 = arguments.next().map_or(Ok(1), |word| word.parse())?;
    let mut parts: Vec<String> = arguments.collect();
    if parts.is_empty() {
        parts = ObjectSpec::names().map(str::to_owned).collect();
    }
    fs::create_dir_all(&folder)?;
    for part in parts {
        let spec = ObjectSpec::by_name(&part)?;
        let mut sheet = RgbImage::new(WIDTH * COLUMNS as u32, HEIGHT * Axis::ALL.len() as u32);
        for (row, axis) in Axis::ALL.into_iter().enumerate() {
            let started = Instant::now();
            for column in 0..COLUMNS {
                // Both odd and even numbers are shown.
                let number = (column * (PICTURES_PER_AXIS - 1) / (COLUMNS - 1)).min(PICTURES_PER_AXIS - 1);
                let shown = axis_view(&spec, axis, (number, PICTURES_PER_AXIS), seed)?;
                let shares: Vec<String> =
                    shown.truths.iter().map(|truth| format!("{:.2}", truth.visible_share)).collect();
                println!("{part} {axis} {number}: {}; visible {}", shown.parameter.description, shares.join(" "));
                let small = resize(&drawn_on(&shown), WIDTH, HEIGHT, FilterType::Triangle);
                overlay(&mut sheet, &small, i64::from(WIDTH) * column as i64, i64::from(HEIGHT) * row as i64);
            }
            println!("{part} {axis}: {:.3} s a picture", started.elapsed().as_secs_f64() / COLUMNS as f64);
        }
        sheet.save(folder.join(format!("{part}.png")))?;
    }
    Ok(())
}

/// The picture with the marked line from green to red and the jaws' line across it.
fn drawn_on(shown: &AxisView) -> RgbImage {
    let mut image = shown.view.image.clone();
    for truth in &shown.truths {
        let line = truth.grasp.line;
        stroke(&mut image, line.start, line.center(), Rgb([0, 255, 0]));
        stroke(&mut image, line.center(), line.end, Rgb([255, 0, 0]));
        let along = line.end - line.start;
        let across = Vector2::new(-along.y, along.x).normalize() * (truth.grasp.planar.width / 2.0);
        stroke(&mut image, line.center() - across, line.center() + across, Rgb([255, 0, 255]));
    }
    image
}

fn stroke(image: &mut RgbImage, from: Point2<f64>, to: Point2<f64>, color: Rgb<u8>) {
    let steps = (to - from).norm().ceil().max(1.0) * 2.0;
    for step in 0..=steps as u32 {
        let at = from + (to - from) * (f64::from(step) / steps);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            let (x, y) = (at.x + dx, at.y + dy);
            if x >= 0.0 && y >= 0.0 && x < f64::from(image.width()) && y < f64::from(image.height()) {
                image.put_pixel(x as u32, y as u32, color);
            }
        }
    }
}
