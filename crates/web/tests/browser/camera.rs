//! Tests the camera with Chromium's fake device, which plays the demonstration's photo.

use sdg_webdriver::{Browser, Site};

use crate::taught::{Made, demonstration};
use crate::{SOFTWARE_CARD, assert_quiet, complaint, open_model, open_page, screenshots, site};

/// A page in a browser with a camera and these flags.
fn with_camera(site: &Site, made: &Made, further: &[&str]) -> Browser {
    let film = made.path("camera.mjpeg");
    // Motion JPEG: concatenated JPEGs, played in a loop.
    let jpeg = made.path("frame.jpg");
    image::open(demonstration()).unwrap().to_rgb8().save(&jpeg).unwrap();
    let frame = std::fs::read(&jpeg).unwrap();
    std::fs::write(&film, frame.repeat(3)).unwrap();
    let film = format!("--use-file-for-fake-video-capture={}", film.display());
    let flags = ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream", &film];
    open_page(site, &[&flags[..], further].concat())
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_grasp_is_found_in_the_camera_s_frames() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = with_camera(&site, &made, &[]);
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

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn the_end_of_a_search_by_another_device_is_no_error() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = with_camera(&site, &made, &SOFTWARE_CARD);
    open_model(&browser, &model);
    let switch = || {
        browser.run("document.querySelector('#model-facts dl').id = 'before'", &[]).unwrap();
        browser.find("#webgpu").unwrap().click().unwrap();
        let opened = "return document.querySelector('#model-facts dl').id === ''";
        browser.wait_for("the model on the other device", opened).unwrap();
    };
    switch();
    browser.find("#camera").unwrap().click().unwrap();
    let status = "return /ms a frame/.test(document.getElementById('status').textContent)";
    browser.wait_for("a frame to be looked at", status).unwrap();
    // Back to the processor, which ends the search of the current frame at once.
    switch();
    let complaint = browser.run("return document.getElementById('alert').textContent", &[]).unwrap();
    assert_eq!(complaint, "");
    assert_quiet(&browser);
}
