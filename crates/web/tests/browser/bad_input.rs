//! Tests that errors are shown on the page with the texts of the command line, and not in the
//! browser's console.

use std::path::PathBuf;

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
