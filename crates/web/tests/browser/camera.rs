//! Tests the camera with Chromium's fake device, which plays the demonstration's photo.

use crate::taught::{Made, demonstration};
use crate::{assert_quiet, complaint, open_model, open_page, screenshots, site};

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_grasp_is_found_in_the_camera_s_frames() {
    let made = Made::new();
    let model = made.model("S");
    let film = made.path("camera.mjpeg");
    // Motion JPEG: concatenated JPEGs, played in a loop.
    let jpeg = made.path("frame.jpg");
    image::open(demonstration()).unwrap().to_rgb8().save(&jpeg).unwrap();
    let frame = std::fs::read(&jpeg).unwrap();
    std::fs::write(&film, frame.repeat(3)).unwrap();

    let site = site();
    let film = format!("--use-file-for-fake-video-capture={}", film.display());
    let flags = ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream", &film];
    let browser = open_page(&site, &flags);
    browser.find("#camera").unwrap().click().unwrap();
    assert!(complaint(&browser).contains("Open a grasp model first"));
    open_model(&browser, &model);
    browser.find("#camera").unwrap().click().unwrap();
    let status = "const s = document.getElementById('status').textContent; return /ms a frame/.test(s) ? s : ''";
    let status = browser.wait_for("a frame to be looked at", status).unwrap();
    assert!(status.as_str().unwrap().starts_with("One grasp"), "{status}");
    browser.screenshot(&screenshots().join("web-camera.png")).unwrap();
    browser.find("#camera").unwrap().click().unwrap();
    let pressed = browser.run("return document.getElementById('camera').getAttribute('aria-pressed')", &[]).unwrap();
    assert_eq!(pressed, "false");
    assert_quiet(&browser);
}
