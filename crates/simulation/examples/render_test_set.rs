//! Renders test images of a part with new poses, changed light, other tables and distractors, and scenes without the
//! part.
//!
//! `cargo run --release -p sdg-simulation --example render_test_set OBJECT COUNT SEED FOLDER`
//!
//! Writes `with_000.png …`, `without_000.png …` and `truth.json` into FOLDER. For each image, `truth.json` has its
//! file, table and distractors, and for images with the part the grasp in pixels and in the base frame.

use std::fs;
use std::path::PathBuf;

use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{GraspTruth, test_views};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, count, seed, folder] = arguments.as_slice() else {
        return Err("usage: render_test_set OBJECT COUNT SEED FOLDER".into());
    };
    let (spec, count, seed) = (ObjectSpec::by_name(name)?, count.parse::<usize>()?, seed.parse::<u64>()?);
    let folder = PathBuf::from(folder);
    fs::create_dir_all(&folder)?;
    let mut images = Vec::new();
    for (prefix, present) in [("with", true), ("without", false)] {
        for (idx, seen) in test_views(&spec, present, count, seed).enumerate() {
            let seen = seen?;
            let file = format!("{prefix}_{idx:03}.png");
            seen.view.image.save(folder.join(&file))?;
            let kinds: Vec<String> = seen.scene.distractors.iter().map(|other| format!("{:?}", other.kind)).collect();
            images.push(json!({
                "image": file,
                "table": format!("{:?}", seen.scene.table.surface),
                "distractors": kinds,
                "truth": seen.truth.as_ref().map(truth),
            }));
        }
    }
    let document = json!({"object": name, "mark_height_m": spec.mark_height_m, "images": images});
    fs::write(folder.join("truth.json"), format!("{document:#}\n"))?;
    println!("{} images in {}", 2 * count, folder.display());
    Ok(())
}

fn truth(truth: &GraspTruth) -> Value {
    json!({
        "grasp": {
            "x": truth.planar.x,
            "y": truth.planar.y,
            "angle_deg": truth.planar.angle.degrees(),
            "width_px": truth.planar.width,
        },
        "grasp_start": [truth.line.start.x, truth.line.start.y],
        "grasp_end": [truth.line.end.x, truth.line.end.y],
        "tcp_in_base_m": [truth.tcp.x, truth.tcp.y, truth.tcp.z],
        "direction_in_base_deg": truth.direction_rad.to_degrees(),
    })
}
