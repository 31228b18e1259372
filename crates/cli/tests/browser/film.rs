//! The animation of the front page, from the photo to the detected part; `make film` writes it.

use std::process::Command;

use image::RgbImage;
use nalgebra::Point2;
use sdg_report::{Animation, AnimationOptions, Color, draw_label};

use super::page::{HOLD, Page, repository, shipped_photo};
use super::photo_to_grasp::patiently;

/// Time for which each picture is shown, in seconds; the last one is shown longer.
const STANDS: f64 = 1.8;
/// Seed of the held-out samples.
const SEED: &str = "3";
/// The searched sample: another table, with objects that resemble the part.
const SAMPLE: &str = "000003.png";

#[test]
#[ignore = "make film: writes datasets/pictures/page.gif"]
fn from_a_photo_to_the_found_part() {
    let page = Page::open();
    let mut frames = Vec::new();
    let mut film = |words: &str| frames.push(captioned(&page, words));
    film("1  A photo of the part");
    page.fill("#label", "pendulum");
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();
    film("2  A box around it: the outline is found");
    page.browser.drag(&[page.on_screen(HOLD)]).unwrap();
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    page.settle();
    film("3  A click where the gripper is to hold it");
    page.click("#tab-teach");
    page.choose_model("S");
    page.click("#teach-start");
    let is_taught = "return / of \\d+ found/.test(document.getElementById('version-list').innerText)";
    patiently(&page, "a model", is_taught);
    page.settle();
    film("4  Taught in seconds");

    let samples = page.folder.path().join("samples");
    let photo = shipped_photo();
    let marks = photo.with_file_name("annotation.json");
    let demo = format!("{}:{}", photo.display(), marks.display());
    let made = Command::new(env!("CARGO_BIN_EXE_sdg"))
        .args(["augment", "--held-back", "--demo", &demo, "--count", "4", "--seed", SEED, "--out"])
        .arg(&samples)
        .status()
        .unwrap();
    assert!(made.success());
    page.click("#tab-try");
    page.browser.find("#picture-input").unwrap().type_text(samples.join(SAMPLE).to_str().unwrap()).unwrap();
    patiently(&page, "a grasp", "return document.querySelector('.found') !== null");
    assert!(page.text(".found").contains("Found the part"), "{}", page.text("#found"));
    page.settle();
    film("5  Found in another picture, with the grasp");

    let options = AnimationOptions {
        source_fps: 1.0 / STANDS,
        fps: 1.0 / STANDS,
        max_width: 860,
        max_bytes: 1_200_000,
        hold_last_secs: 2.0 * STANDS,
        ..AnimationOptions::default()
    };
    let gif = Animation::encode(&frames, &options).unwrap();
    std::fs::write(repository().join("datasets/pictures/page.gif"), gif.gif()).unwrap();
}

/// A screenshot of the browser with a caption below it.
fn captioned(page: &Page, words: &str) -> RgbImage {
    page.settle_frames();
    let path = page.folder.path().join("shot.png");
    page.browser.screenshot(&path).unwrap();
    let shot = image::open(&path).unwrap().into_rgb8();
    let mut frame = RgbImage::from_pixel(shot.width(), shot.height() + 56, image::Rgb([250, 249, 247]));
    image::imageops::replace(&mut frame, &shot, 0, 56);
    draw_label(&mut frame, Point2::new(16.0, 48.0), words, Color::NEUTRAL, 26.0);
    frame
}
