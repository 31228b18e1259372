//! The pictures of the gallery and the tour, made with the program itself. `make film` writes them into
//! datasets/pictures.

use std::fs;
use std::path::{Path, PathBuf};

use image::imageops::FilterType;
use image::{Rgb, RgbImage};

use crate::support::{Folder, sdg, shipped, stdout};

const PARTS: [&str; 12] = [
    "pendulum",
    "fuel_line",
    "rod_end",
    "housing",
    "pneumatic_cylinder",
    "ball_bearing",
    "common_line",
    "cranfield_face",
    "key",
    "pliers",
    "circuit_board",
    "spring_clip",
];
/// Seed of the tour's six samples.
const SEED: &str = "3";
/// The sample in which many detections are refused.
const SAMPLE: &str = "000003.png";
/// Number of small pictures in a row of the sheet.
const COLUMNS: u32 = 4;
/// Width and height of a small picture, in pixels.
const SMALL: [u32; 2] = [240, 180];

fn pictures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/pictures")
}

/// Teaches model S of a shipped part, makes six held-out samples, and returns the folder with the detections drawn on
/// them.
fn drawn_samples(folder: &Folder, part: &str, arguments: &[&str]) -> PathBuf {
    let [photo, marks] = ["image.png", "annotation.json"].map(|name| shipped(part, name).display().to_string());
    let demo = format!("{photo}:{marks}");
    let [model, samples, drawn] = ["model.sdg", "samples", "drawn"].map(|name| folder.path(&format!("{part}-{name}")));
    stdout(&["teach", "--model", "S", "--demo", &demo, "--out", &model]);
    stdout(&["augment", "--held-back", "--demo", &demo, "--count", "6", "--seed", SEED, "--out", &samples]);
    stdout(&[&["detect", "--grasp-model", &model, "--draw", &drawn, &samples], arguments].concat());
    drawn.into()
}

#[test]
#[ignore = "make film: writes datasets/pictures"]
fn pictures_of_the_gallery() {
    let folder = Folder::new();
    let refused = image::open(drawn_samples(&folder, "pliers", &["--all"]).join(SAMPLE)).unwrap().into_rgb8();
    write_jpeg(&refused, "refused.jpg");

    let rows = PARTS.len() as u32 / COLUMNS;
    let mut sheet = RgbImage::from_pixel(COLUMNS * SMALL[0], rows * SMALL[1], Rgb([255, 255, 255]));
    for (idx, part) in (0..).zip(PARTS) {
        // In the second sample, all parts are found.
        let drawn = image::open(drawn_samples(&folder, part, &[]).join("000001.png")).unwrap().into_rgb8();
        let small = image::imageops::resize(&drawn, SMALL[0] - 4, SMALL[1] - 4, FilterType::Triangle);
        let [x, y] = [idx % COLUMNS * SMALL[0] + 2, idx / COLUMNS * SMALL[1] + 2];
        image::imageops::replace(&mut sheet, &small, x.into(), y.into());
    }
    write_jpeg(&sheet, "parts.jpg");

    let workcell = pictures().join("../workcell/workcell.toml").display().to_string();
    stdout(&["workcell", "show", &workcell, "--out", &pictures().join("workcell.png").display().to_string()]);
    let plan = folder.path("plan");
    let planned = sdg(&["plan", "--workcell", &workcell, "--goal", "500,-300,150", "--out", &plan]);
    assert!(planned.status.success(), "{}", String::from_utf8_lossy(&planned.stderr));
    fs::copy(Path::new(&plan).join("plan.gif"), pictures().join("plan.gif")).unwrap();
}

fn write_jpeg(picture: &RgbImage, name: &str) {
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 82);
    picture.write_with_encoder(encoder).unwrap();
    fs::write(pictures().join(name), bytes).unwrap();
}
