//! Tests that errors are shown on the page with the texts of the command line, and not in the
//! browser's console.

use std::path::PathBuf;

use serde_json::json;

use crate::taught::{Made, demonstration};
use crate::{assert_quiet, choose, complaint, open_model, open_page, screenshots, site};

/// The header of a PNG of this size, without any data.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend(width.to_be_bytes());
    png.extend(height.to_be_bytes());
    png.extend([8, 2, 0, 0, 0]);
    png.extend([0; 4]);
    png
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn wrong_files_are_told_apart() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = open_page(&site, &[]);

    let newer = made.path("newer.sdg");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let mut bytes = std::fs::read(&model).unwrap();
    let version = br#""format_version":"3""#;
    let at = bytes.windows(version.len()).position(|window| window == version).unwrap() + version.len() - 2;
    bytes[at] = b'9';
    assert!(text(&bytes).contains(r#""format_version":"9""#));
    std::fs::write(&newer, &bytes).unwrap();
    choose(&browser, "#model-file", &[newer]);
    let text = complaint(&browser);
    assert!(text.contains("newer.sdg: expected a grasp model of format version 3, found version 9"), "{text}");

    choose(&browser, "#model-file", &[demonstration()]);
    let wait = "return document.getElementById('alert').textContent.startsWith('image.png')";
    browser.wait_for("the next complaint", wait).unwrap();
    let text = complaint(&browser);
    assert_eq!(text, "image.png: expected a grasp model file of this project, found a PNG image");

    open_model(&browser, &model);
    let enormous = made.path("enormous.png");
    std::fs::write(&enormous, png_header(10_000, 10_000)).unwrap();
    let cut = made.path("cut.png");
    std::fs::write(&cut, &std::fs::read(demonstration()).unwrap()[..5000]).unwrap();
    let empty = made.path("empty.jpg");
    std::fs::write(&empty, b"").unwrap();
    let pictures: [PathBuf; 4] = [enormous, cut, empty, demonstration()];
    choose(&browser, "#image-files", &pictures);
    let done = "const texts = [...document.querySelectorAll('#pictures small')].map((small) => small.textContent);
        return texts.length === 4 && texts[3] === 'One grasp' ? texts : false";
    let text = browser.wait_for("the last picture to be looked at", done).unwrap();
    for (idx, part) in [(0, "10000"), (1, "PNG"), (2, "an empty file")] {
        assert!(text[idx].as_str().unwrap().contains(part), "{text}");
    }
    let stage = browser.run("return document.getElementById('empty').textContent", &[]).unwrap();
    assert_eq!(stage, text[0], "expected the error of the chosen picture on the stage");
    assert_quiet(&browser);
}

/// A BMP file of 24 bits per pixel; its rows need no padding if the width is a multiple of four.
fn bmp(picture: &image::RgbImage) -> Vec<u8> {
    let (width, height) = picture.dimensions();
    let num_bytes = 3 * width * height;
    let mut file = b"BM".to_vec();
    for number in [54 + num_bytes, 0, 54, 40, width, height] {
        file.extend(number.to_le_bytes());
    }
    file.extend([1, 0, 24, 0]);
    for number in [0, num_bytes, 0, 0, 0, 0] {
        file.extend(number.to_le_bytes());
    }
    for y in (0..height).rev() {
        for x in 0..width {
            let [red, green, blue] = picture.get_pixel(x, y).0;
            file.extend([blue, green, red]);
        }
    }
    file
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_picture_is_searched_if_the_browser_or_the_module_decodes_it() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = open_page(&site, &[]);
    open_model(&browser, &model);
    let photo = image::open(demonstration()).unwrap().to_rgb8();
    let (width, height) = photo.dimensions();
    let ppm = [format!("P6\n{width} {height}\n255\n").into_bytes(), photo.as_raw().clone()].concat();
    let heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic".to_vec();
    let write = |(name, content): (&str, Vec<u8>)| {
        let path = made.path(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let pictures = [("phone.heic", heic), ("photo.bmp", bmp(&photo)), ("photo.ppm", ppm)].map(write);
    choose(&browser, "#image-files", &pictures);
    let done = "const texts = [...document.querySelectorAll('#pictures small')].map((small) => small.textContent);
        return texts.length === 3 && texts.slice(1).every((text) => text === 'One grasp') && texts";
    let texts = browser.wait_for("the last picture to be looked at", done).unwrap();
    assert!(texts[0].as_str().unwrap().contains("Most Compatible"), "{texts}");
    // Chromium draws no PPM: nothing of the picture before is shown, and its grasp is listed.
    browser.find("#pictures li:last-child button").unwrap().click().unwrap();
    let shown =
        "const [status, empty, grasps] = ['status', 'empty', 'grasps'].map((id) => document.getElementById(id));
        const [isFound, rows] = [status.textContent.startsWith('One grasp'), grasps.tBodies[0].rows];
        return [isFound, empty.textContent, grasps.hidden, rows.length]";
    let shown = browser.run(shown, &[]).unwrap();
    assert_eq!(shown, json!([true, "This browser cannot show this picture.", false, 1]));
    assert_quiet(&browser);
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn the_error_of_a_model_stays_when_pictures_are_dropped_with_it() {
    let site = site();
    let browser = open_page(&site, &[]);
    let drop = "const dropped = new DataTransfer();
        dropped.items.add(new File(['no model'], 'bad.sdg'));
        dropped.items.add(new File(['no picture'], 'bad.png'));
        dispatchEvent(new DragEvent('drop', { dataTransfer: dropped, cancelable: true }))";
    browser.run(drop, &[]).unwrap();
    browser.wait_for("the picture", "return document.querySelector('#pictures small') !== null").unwrap();
    let text = complaint(&browser);
    assert!(text.starts_with("bad.sdg: expected a grasp model file"), "{text}");
    assert_quiet(&browser);
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_browser_without_vectors_is_told_so() {
    let site = site();
    // V8 provides WebAssembly SIMD only on processors with SSE 4.1.
    let browser = open_page(&site, &["--js-flags=--no-enable-sse4-1"]);
    let text = complaint(&browser);
    assert!(text.contains("not its SIMD instructions"), "{text}");
    let enabled = browser.run("return document.querySelectorAll('input:enabled, button:enabled').length", &[]).unwrap();
    assert_eq!(enabled, 0);
    browser.screenshot(&screenshots().join("web-no-simd.png")).unwrap();
    assert_quiet(&browser);
}
