//! Makes the look-alikes of every shipped part: a folder each, and one sheet that shows all of them beside their part.
//!
//! `cargo run --release -p sdg-simulation --example render_look_alikes [FOLDER [PART …]]`
//!
//! FOLDER (`look_alikes` by default) gets `PART/KIND/` with what `ObjectSpec::from_folder` reads, and `look_alikes.png`: a
//! row a part; from left to right the part, its mirror image (empty where that equals the part), three with a feature
//! moved, and the sizes 0.8, 0.9, 1.1 and 1.25.

use std::path::PathBuf;

use image::imageops::{crop_imm, overlay};
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use sdg_simulation::objects::{LookAlikeKind, ObjectSpec};
use sdg_simulation::scene::{SceneVariation, test_view};

/// Side of a picture on the sheet in pixels.
const SIDE: u32 = 250;

/// Where the parts lie: x, y in metres, yaw in radians.
const PLACE: (f64, f64, f64) = (0.48, 0.0, 0.6);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map_or_else(|| PathBuf::from("look_alikes"), PathBuf::from);
    let mut parts: Vec<String> = arguments.collect();
    if parts.is_empty() {
        parts = ObjectSpec::names().map(str::to_owned).collect();
    }
    let columns: Vec<(LookAlikeKind, u64)> = LookAlikeKind::ALL
        .into_iter()
        .flat_map(|kind| (0..if kind == LookAlikeKind::FeatureMoved { 3 } else { 1 }).map(move |seed| (kind, seed)))
        .collect();
    let width = SIDE * (columns.len() as u32 + 1);
    let mut sheet = RgbImage::from_pixel(width, SIDE * parts.len() as u32, Rgb([255; 3]));
    for (row, part) in parts.iter().enumerate() {
        let spec = ObjectSpec::by_name(part)?;
        let y = i64::from(SIDE) * row as i64;
        overlay(&mut sheet, &picture(&spec)?, 0, y);
        let kinds = spec.look_alike_kinds()?;
        println!("{part}: differs from its mirror image by {:.1} %", 100.0 * spec.mirror_difference()?);
        for (column, &(kind, seed)) in columns.iter().enumerate().filter(|(_, (kind, _))| kinds.contains(kind)) {
            let look_alike = spec.look_alike(kind, seed)?;
            println!("  {kind}: {}", look_alike.description);
            let name = kind.to_string().replace(' ', "_");
            let name = if kind == LookAlikeKind::FeatureMoved { format!("{name}_{seed}") } else { name };
            look_alike.spec.write_folder(&folder.join(part).join(name))?;
            overlay(&mut sheet, &picture(&look_alike.spec)?, i64::from(SIDE) * (column as i64 + 1), y);
        }
    }
    std::fs::create_dir_all(&folder)?;
    sheet.save(folder.join("look_alikes.png"))?;
    println!("{}", folder.join("look_alikes.png").display());
    Ok(())
}

/// The part alone in even light, seen by the wrist camera.
fn picture(spec: &ObjectSpec) -> Result<RgbImage, Box<dyn std::error::Error>> {
    let (x, y, yaw_rad) = PLACE;
    let shown = test_view(SceneVariation::nominal(Some((spec, spec.base_from_object(x, y, yaw_rad)))))?;
    let middle = shown.view.camera.project(&Point3::new(x, y, 0.0)).ok_or("the camera looks away")?;
    let half = f64::from(SIDE) / 2.0;
    let (left, top) = ((middle.x - half).max(0.0) as u32, (middle.y - half).max(0.0) as u32);
    Ok(crop_imm(&shown.view.image, left, top, SIDE, SIDE).to_image())
}
