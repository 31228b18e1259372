//! Draws contact sheets for inspection: parts, scenes, look-alikes beside their part.
//!
//! Usage: `cargo run --release -p sdg-part-generator --example contact_sheet FOLDER [SEED [ZOOM]]`
//!
//! Writes `parts_N.png` (100 parts, a photo of each with marks and outline), `scenes_N.png` (a scene of each of these
//! parts) and `look_alikes.png` (each row shows a part, its mirror image, two copies with a moved feature, and two
//! copies of other sizes) into FOLDER.

use std::path::{Path, PathBuf};

use image::{GenericImage, Rgb, RgbImage};
use nalgebra::Point2;
use rayon::prelude::*;
use sdg_geometry::GraspLine;
use sdg_part_generator::{DemonstrationPhoto, LookAlike, Part, PhotoConfig, SceneConfig, Scenes, demonstration};

/// Number of full-size pictures in a row, and of rows on a sheet.
const SHEET: [u32; 2] = [4, 5];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = PathBuf::from(arguments.first().ok_or("usage: contact_sheet FOLDER [SEED [ZOOM]]")?);
    let seed: u64 = arguments.get(1).map_or(Ok(0), |seed| seed.parse())?;
    let zoom: u32 = arguments.get(2).map_or(Ok(1), |zoom| zoom.parse())?;
    std::fs::create_dir_all(&folder)?;
    let parts: Vec<Part> = (0..100).into_par_iter().map(|k| Part::generate(seed + k)).collect();

    let photos: Vec<RgbImage> = parts
        .par_iter()
        .map(|part| {
            let taken = demonstration(part, &PhotoConfig::default(), seed);
            let mut image = taken.image;
            if let Some(outline) = &taken.annotation.outline {
                for (a, b) in outline.edges() {
                    line(&mut image, a, b, Rgb([255, 220, 0]));
                }
            }
            if let Some(grasp) = &taken.annotation.grasp {
                mark(&mut image, grasp);
            }
            image
        })
        .collect();
    write_sheets(&folder, "parts", &photos, zoom)?;

    let scenes = Scenes::new(&parts, SceneConfig::default(), seed)?;
    let pictures: Vec<RgbImage> = (0..100u64)
        .into_par_iter()
        .map(|k| {
            let sample = scenes.sample(k);
            let mut image = sample.image;
            for instance in &sample.instances {
                mark(&mut image, &instance.grasp);
            }
            image
        })
        .collect();
    write_sheets(&folder, "scenes", &pictures, zoom)?;

    let rows: Vec<RgbImage> = parts
        .par_iter()
        .take(12)
        .map(|part| {
            let photo = PhotoConfig { width: 200, height: 160, fill: [0.7, 0.7] };
            let kinds = [
                None,
                Some((LookAlike::Mirrored, 0)),
                Some((LookAlike::FeatureMoved, 1)),
                Some((LookAlike::FeatureMoved, 2)),
                Some((LookAlike::Scaled(0.8), 0)),
                Some((LookAlike::Scaled(1.25), 0)),
            ];
            let mut row = RgbImage::new(200 * kinds.len() as u32, 160);
            for (k, kind) in (0..).zip(kinds) {
                let other = match kind {
                    None => Some(part.clone()),
                    Some((kind, seed)) => part.look_alike(kind, seed),
                };
                if let Some(other) = other {
                    // With equal `fill`, all would look equally large, so each part is drawn in proportion.
                    let fill = 0.6 * other.diagonal_mm() / part.diagonal_mm();
                    let config = PhotoConfig { fill: [fill, fill], ..photo };
                    let taken = DemonstrationPhoto::take(&other, &config, seed);
                    row.copy_from(&taken.demonstration.image, k * 200, 0).expect("the row has room");
                }
            }
            row
        })
        .collect();
    let mut sheet = RgbImage::new(1200, 160 * rows.len() as u32);
    for (k, row) in (0..).zip(&rows) {
        sheet.copy_from(row, 0, k * 160)?;
    }
    sheet.save(folder.join("look_alikes.png"))?;
    Ok(())
}

/// Writes pictures on sheets, each pixel `zoom` pixels wide.
fn write_sheets(folder: &Path, name: &str, pictures: &[RgbImage], zoom: u32) -> image::ImageResult<()> {
    let [columns, rows] = SHEET.map(|count| (count / zoom).max(1));
    for (idx, chunk) in pictures.chunks((columns * rows) as usize).enumerate() {
        let (width, height) = (chunk[0].width() * zoom, chunk[0].height() * zoom);
        let mut sheet = RgbImage::new(columns * width, rows * height);
        for (k, picture) in (0u32..).zip(chunk) {
            let picture = image::imageops::resize(picture, width, height, image::imageops::FilterType::Nearest);
            sheet.copy_from(&picture, k % columns * width, k / columns * height)?;
        }
        sheet.save(folder.join(format!("{name}_{idx:02}.png")))?;
    }
    Ok(())
}

fn mark(image: &mut RgbImage, grasp: &GraspLine) {
    line(image, grasp.start, grasp.end, Rgb([255, 0, 255]));
    for d in [-1.0, 0.0, 1.0] {
        let p = grasp.start;
        line(image, Point2::new(p.x - 1.0, p.y + d), Point2::new(p.x + 1.0, p.y + d), Rgb([0, 255, 255]));
    }
}

fn line(image: &mut RgbImage, a: Point2<f64>, b: Point2<f64>, color: Rgb<u8>) {
    let steps = (b - a).norm().ceil().max(1.0) as usize;
    for k in 0..=steps {
        let p = a + (b - a) * (k as f64 / steps as f64);
        if p.x >= 0.0 && p.y >= 0.0 && (p.x as u32) < image.width() && (p.y as u32) < image.height() {
            image.put_pixel(p.x as u32, p.y as u32, color);
        }
    }
}
