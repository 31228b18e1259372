//! Pictures of the repository, rotated, scaled and relit by a known amount.

use std::path::PathBuf;

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{Mask, PlanarSimilarity, Polygon};
use sdg_sift::{Plane, SiftConfig};

/// The default settings with a change.
pub fn with(change: impl FnOnce(&mut SiftConfig)) -> SiftConfig {
    let mut config = SiftConfig::default();
    change(&mut config);
    config
}

pub const PARTS: [&str; 3] = ["fuel_line", "pendulum", "rod_end"];

fn demonstration(part: &str, file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations").join(part).join(file)
}

pub fn picture(part: &str) -> RgbImage {
    image::open(demonstration(part, "image.png")).unwrap().into_rgb8()
}

/// The annotated outline of the part, from LabelMe or COCO.
pub fn outline(part: &str) -> Polygon {
    let text = std::fs::read_to_string(demonstration(part, "annotation.json")).unwrap();
    let annotation: serde_json::Value = serde_json::from_str(&text).unwrap();
    let numbers: Vec<f64> = match annotation["shapes"].as_array() {
        Some(shapes) => {
            let polygon = shapes.iter().find(|shape| shape["shape_type"] == "polygon").unwrap();
            let points = polygon["points"].as_array().unwrap().iter();
            points.flat_map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()]).collect()
        }
        None => serde_json::from_value(annotation["annotations"][0]["segmentation"][0].clone()).unwrap(),
    };
    Polygon::new(numbers.chunks_exact(2).map(|p| Point2::new(p[0], p[1])).collect()).unwrap()
}

pub fn mask(outline: &Polygon, like: &Plane) -> Mask {
    outline.rasterize(like.width() as u32, like.height() as u32)
}

/// The picture transformed by `image_from_source`; beyond its border it is mirrored.
pub fn warped(source: &Plane, image_from_source: &PlanarSimilarity, width: u32, height: u32) -> Plane {
    let back = image_from_source.inverse();
    Plane::from_fn(width, height, |x, y| {
        let at = back.apply(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        bicubic(source, at.x - 0.5, at.y - 0.5).clamp(0.0, 1.0)
    })
}

/// Interpolates by Keys' cubic convolution with a = -1/2.
fn bicubic(source: &Plane, x: f64, y: f64) -> f32 {
    let weights = |t: f64| {
        let near = |d: f64| 1.5 * d.powi(3) - 2.5 * d.powi(2) + 1.0;
        let far = |d: f64| -0.5 * d.powi(3) + 2.5 * d.powi(2) - 4.0 * d + 2.0;
        [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)]
    };
    let mirrored = |i: f64, n: usize| {
        let period = 2 * (n as i64 - 1);
        let i = (i as i64).rem_euclid(period);
        i.min(period - i) as usize
    };
    let (wx, wy) = (weights(x - x.floor()), weights(y - y.floor()));
    let mut sum = 0.0;
    for (j, wy) in wy.iter().enumerate() {
        let row = source.row(mirrored(y.floor() + j as f64 - 1.0, source.height()));
        for (i, wx) in wx.iter().enumerate() {
            sum += wx * wy * f64::from(row[mirrored(x.floor() + i as f64 - 1.0, source.width())]);
        }
    }
    sum as f32
}

/// Changes each intensity by `light(intensity, x, y)`, with x and y from 0 to 1.
pub fn relit(source: &Plane, light: impl Fn(f32, f32, f32) -> f32) -> Plane {
    let (width, height) = (source.width(), source.height());
    Plane::from_fn(width as u32, height as u32, |x, y| {
        let value = source.row(y as usize)[x as usize];
        light(value, x as f32 / width as f32, y as f32 / height as f32).clamp(0.0, 1.0)
    })
}
