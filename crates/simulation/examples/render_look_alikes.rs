//! Creates the look-alikes of every shipped part: a folder for each look-alike, and one sheet that shows all of them
//! beside their part.
//!
//! `cargo run --release -p sdg-simulation --example render_look_alikes [FOLDER [PART …]]`
//!
//! FOLDER (`look_alikes` by default) gets `PART/KIND/` with files for `ObjectSpec::from_folder`, and `look_alikes.png`
//! with a row per part: from left to right the part, its mirror image (empty if it hardly differs from the part), three
//! look-alikes with a moved feature, and the sizes 0.8, 0.9, 1.1 and 1.25.

use std::path::PathBuf;

use image::imageops::{FilterType, crop_imm, overlay, resize};
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use sdg_simulation::objects::{LookAlikeKind, ObjectSpec};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::views::base_from_look_camera;
use sdg_simulation::{RenderConfig, Workcell, WorkcellConfig};

/// Side of a picture on the sheet in pixels.
const SIDE: u32 = 250;

/// Position of the parts: x, y in metres, yaw in radians.
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
        let scale = scale_m(&spec);
        let y = i64::from(SIDE) * row as i64;
        overlay(&mut sheet, &picture(&spec, scale)?, 0, y);
        let kinds = spec.look_alike_kinds()?;
        println!("{part}: differs from its mirror image by {:.1} %", 100.0 * spec.mirror_difference()?);
        for (column, &(kind, seed)) in columns.iter().enumerate().filter(|(_, (kind, _))| kinds.contains(kind)) {
            let look_alike = spec.look_alike(kind, seed)?;
            println!("  {kind}: {}", look_alike.description);
            let name = kind.to_string().replace(' ', "_");
            let name = if kind == LookAlikeKind::FeatureMoved { format!("{name}_{seed}") } else { name };
            look_alike.spec.write_folder(&folder.join(part).join(name))?;
            overlay(&mut sheet, &picture(&look_alike.spec, scale)?, i64::from(SIDE) * (column as i64 + 1), y);
        }
    }
    std::fs::create_dir_all(&folder)?;
    sheet.save(folder.join("look_alikes.png"))?;
    println!("{}", folder.join("look_alikes.png").display());
    Ok(())
}

/// The part alone in even light, seen by the wrist camera at high resolution and cropped; `scale_m` is the side of the
/// crop.
fn picture(spec: &ObjectSpec, scale_m: f64) -> Result<RgbImage, Box<dyn std::error::Error>> {
    let (x, y, yaw_rad) = PLACE;
    let scene = SceneVariation::nominal(Some((spec, spec.base_from_object(x, y, yaw_rad))));
    let wrist_render = RenderConfig { width: 1600, height: 1200, ..RenderConfig::default() };
    let mut cell = Workcell::new(&WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) })?;
    let view = cell.view_from(&base_from_look_camera())?;
    let ends = |k: usize| {
        let along = spec.footprint.iter().map(|corner| corner[k]);
        along.clone().fold(f64::INFINITY, f64::min) + along.fold(f64::NEG_INFINITY, f64::max)
    };
    let middle = spec.base_from_object(x, y, yaw_rad) * Point3::new(0.5 * ends(0), 0.5 * ends(1), 0.0);
    let at = view.camera.project(&middle).ok_or("the camera looks away")?;
    let metres_per_pixel = view.camera.metres_per_pixel(&at, 0.0).ok_or("the camera looks away")?;
    let half = 0.5 * scale_m / metres_per_pixel;
    let (left, top) = ((at.x - half).max(0.0) as u32, (at.y - half).max(0.0) as u32);
    let cut = crop_imm(&view.image, left, top, (2.0 * half) as u32, (2.0 * half) as u32).to_image();
    Ok(resize(&cut, SIDE, SIDE, FilterType::CatmullRom))
}

/// Side of a part's pictures, in metres; the largest look-alike fits into it.
fn scale_m(spec: &ObjectSpec) -> f64 {
    let distances = spec.footprint.iter().flat_map(|a| spec.footprint.iter().map(move |b| (a - b).norm()));
    1.3 * distances.fold(0.0, f64::max)
}
