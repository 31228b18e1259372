//! Writes example pictures: `pictures FOLDER [SEED]`.
//!
//! `pretrain-N.png` are training pictures, with boxes and the ends of the grasp lines (start red, end green);
//! `trial-PART-*.png` are the photo and pictures of the first parts on which weights are compared.

use std::path::PathBuf;

use image::{Rgb, RgbImage};
use sdg_base_weights::compare::Trial;
use sdg_base_weights::pictures::{draw_parts, scene_config};
use sdg_part_generator::Scenes;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = PathBuf::from(arguments.first().ok_or("usage: pictures FOLDER [SEED]")?);
    let seed: u64 = arguments.get(1).map_or(Ok(1), |text| text.parse())?;
    std::fs::create_dir_all(&folder)?;
    let scenes = Scenes::new(&draw_parts(24, seed), scene_config(), seed)?;
    for index in 0..8 {
        let sample = scenes.mixed_sample(index);
        let mut image = sample.image;
        for mixed in &sample.instances {
            let bbox = mixed.instance.bbox;
            for [x, y] in border([bbox.x1, bbox.y1, bbox.x2, bbox.y2]) {
                paint(&mut image, [x, y], [255, 255, 0]);
            }
            let grasp = mixed.instance.grasp;
            for (end, color) in [(grasp.start, [255, 0, 0]), (grasp.end, [0, 255, 0])] {
                for [dx, dy] in [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
                    paint(&mut image, [end.x + dx, end.y + dy], color);
                }
            }
        }
        image.save(folder.join(format!("pretrain-{index}.png")))?;
    }
    for part in 9000..9008 {
        for (name, image) in Trial::new(part)?.pictures() {
            image.save(folder.join(format!("trial-{part}-{name}.png")))?;
        }
    }
    Ok(())
}

/// Points on the border of a box, one pixel apart.
fn border([x1, y1, x2, y2]: [f64; 4]) -> Vec<[f64; 2]> {
    let along = |from: f64, to: f64| (from as i64..=to as i64).map(|v| v as f64);
    let horizontal = along(x1, x2).flat_map(|x| [[x, y1], [x, y2]]);
    horizontal.chain(along(y1, y2).flat_map(|y| [[x1, y], [x2, y]])).collect()
}

fn paint(image: &mut RgbImage, [x, y]: [f64; 2], color: [u8; 3]) {
    if x >= 0.0 && y >= 0.0 && (x as u32) < image.width() && (y as u32) < image.height() {
        image.put_pixel(x as u32, y as u32, Rgb(color));
    }
}
