//! Takes the demonstration picture of each part and writes it with its annotation under `datasets/demonstrations`.
//!
//! `cargo run --release -p sdg-simulation --example render_demonstrations [FOLDER [CHECK_FOLDER]]`
//!
//! The pendulum is annotated in LabelMe's format, the other parts in COCO's, so that both formats are used. If a second
//! folder is given, it gets enlarged pictures with the annotations drawn on them, for inspection.

use std::fs;
use std::path::{Path, PathBuf};

use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{DemonstrationView, demonstration_view};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations");
    let folder = arguments.next().unwrap_or(default);
    let check_folder = arguments.next();
    for name in ObjectSpec::names() {
        let spec = ObjectSpec::by_name(name)?;
        let shown = demonstration_view(&spec)?;
        let annotation = if name == "pendulum" { labelme(name, &shown) } else { coco(name, &shown) };
        let folder = folder.join(name);
        fs::create_dir_all(&folder)?;
        shown.view.image.save(folder.join("image.png"))?;
        fs::write(folder.join("annotation.json"), format!("{annotation:#}\n"))?;
        if let Some(check_folder) = &check_folder {
            fs::create_dir_all(check_folder)?;
            drawn_over(&shown).save(check_folder.join(format!("{name}.png")))?;
        }
        let bounds = shown.outline.bounds();
        println!(
            "{name}: box {:.1} x {:.1} px, {} points, grasp at ({:.1}, {:.1}) px, {:.1} degrees, {:.1} px wide",
            bounds.x2 - bounds.x1,
            bounds.y2 - bounds.y1,
            shown.outline.vertices.len(),
            shown.truth.planar.x,
            shown.truth.planar.y,
            shown.truth.planar.angle.degrees(),
            shown.truth.planar.width,
        );
    }
    Ok(())
}

/// Rounds to a tenth of a pixel, as annotation tools do.
fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

fn pair(point: &Point2<f64>) -> Value {
    json!([tenth(point.x), tenth(point.y)])
}

fn labelme(name: &str, shown: &DemonstrationView) -> Value {
    let bounds = shown.outline.bounds();
    let shape = |label: &str, shape_type: &str, points: Vec<Value>| {
        json!({
            "label": label, "points": points, "group_id": 1, "description": "", "shape_type": shape_type, "flags": {},
        })
    };
    json!({
        "version": "5.4.1",
        "flags": {},
        "shapes": [
            shape(name, "rectangle", vec![
                pair(&Point2::new(bounds.x1, bounds.y1)),
                pair(&Point2::new(bounds.x2, bounds.y2)),
            ]),
            shape("grasp_start", "point", vec![pair(&shown.truth.line.start)]),
            shape("grasp_end", "point", vec![pair(&shown.truth.line.end)]),
            shape(name, "polygon", shown.outline.vertices.iter().map(pair).collect()),
        ],
        "imagePath": "image.png",
        "imageData": null,
        "imageHeight": shown.view.image.height(),
        "imageWidth": shown.view.image.width(),
    })
}

fn coco(name: &str, shown: &DemonstrationView) -> Value {
    let bounds = shown.outline.bounds();
    let line = shown.truth.line;
    let polygon: Vec<f64> = shown.outline.vertices.iter().flat_map(|p| [tenth(p.x), tenth(p.y)]).collect();
    json!({
        "info": {"description": format!("Demonstration of {name}"), "version": "1.0"},
        "images": [{
            "id": 1, "file_name": "image.png",
            "width": shown.view.image.width(), "height": shown.view.image.height(),
        }],
        "categories": [{
            "id": 1, "name": name, "keypoints": ["grasp_start", "grasp_end"], "skeleton": [[1, 2]],
        }],
        "annotations": [{
            "id": 1, "image_id": 1, "category_id": 1, "iscrowd": 0,
            "bbox": [
                tenth(bounds.x1), tenth(bounds.y1), tenth(bounds.x2 - bounds.x1), tenth(bounds.y2 - bounds.y1),
            ],
            "area": tenth(shown.outline.area().abs()),
            "segmentation": [polygon],
            "keypoints": [tenth(line.start.x), tenth(line.start.y), 2, tenth(line.end.x), tenth(line.end.y), 2],
            "num_keypoints": 2,
        }],
    })
}

/// The picture three times as large with outline, box, and the marked line from green to red.
fn drawn_over(shown: &DemonstrationView) -> RgbImage {
    const SCALE: u32 = 3;
    let image = &shown.view.image;
    let mut large = resize(image, image.width() * SCALE, image.height() * SCALE, FilterType::Nearest);
    let mut stroke = |a: Point2<f64>, b: Point2<f64>, color: Rgb<u8>| {
        let steps = ((b - a).norm() * f64::from(SCALE)).ceil().max(1.0);
        for step in 0..=steps as u32 {
            let at = (a + (b - a) * (f64::from(step) / steps)) * f64::from(SCALE);
            if at.x >= 0.0 && at.y >= 0.0 && (at.x as u32) < large.width() && (at.y as u32) < large.height() {
                large.put_pixel(at.x as u32, at.y as u32, color);
            }
        }
    };
    for (a, b) in shown.outline.edges() {
        stroke(a, b, Rgb([0, 255, 255]));
    }
    let bounds = shown.outline.bounds();
    for (a, b) in sdg_geometry::Polygon::from_box(&bounds).edges() {
        stroke(a, b, Rgb([255, 255, 0]));
    }
    let line = shown.truth.line;
    stroke(line.start, line.center(), Rgb([0, 255, 0]));
    stroke(line.center(), line.end, Rgb([255, 0, 0]));
    let across = nalgebra::Vector2::new(-(line.end - line.start).y, (line.end - line.start).x).normalize()
        * (shown.truth.planar.width / 2.0);
    stroke(line.center() - across, line.center() + across, Rgb([255, 0, 255]));
    large
}
