//! Tests the camera with Chromium's fake device, which plays the demonstration's photo.

use sdg_webdriver::{Browser, Site};

use crate::taught::{Made, demonstration};
use crate::{
    FOUND, SOFTWARE_CARD, assert_no_complaint, assert_quiet, choose, complaint, open_model, open_page, screenshots,
    site,
};

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
    // The last frame is searched again with other settings.
    let watch = "window.said = [];
        const status = document.getElementById('status');
        new MutationObserver(() => window.said.push(status.textContent)).observe(status, { childList: true })";
    browser.run(watch, &[]).unwrap();
    browser.find("#verify").unwrap().click().unwrap();
    let said = browser.wait_for("another search", "return window.said.length > 1 && window.said").unwrap();
    assert_eq!(said[0], "Looking…");
    assert!(said[1].as_str().unwrap().contains("ms a frame"), "{said}");
    assert_quiet(&browser);
}

/// Keeps the streams of the camera, and holds back each until `consent` is called, like a question of the browser.
const HOLD_BACK: &str = "const devices = navigator.mediaDevices;
    const open = devices.getUserMedia.bind(devices);
    window.streams = [];
    devices.getUserMedia = async (wanted) => {
        const stream = await open(wanted);
        window.streams.push(stream);
        await new Promise((resolve) => (window.consent = resolve));
        return stream;
    }";

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_camera_that_is_stopped_while_it_starts_or_is_unplugged_is_switched_off() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = with_camera(&site, &made, &[]);
    open_model(&browser, &model);
    browser.run(HOLD_BACK, &[]).unwrap();
    let click = || browser.find("#camera").unwrap().click().unwrap();
    let start = |count: usize| {
        click();
        browser.wait_for("the camera's stream", &format!("return window.streams.length === {count}")).unwrap();
    };
    let consent = || browser.run("window.consent()", &[]).unwrap();
    let assert_switched_off = || {
        let ended = "return window.streams.at(-1).getTracks().every(({ readyState }) => readyState === 'ended')
            && document.getElementById('camera').getAttribute('aria-pressed') === 'false'";
        browser.wait_for("the camera to be switched off", ended).unwrap();
    };
    // Stopped by another click.
    start(1);
    click();
    consent();
    assert_switched_off();
    assert_no_complaint(&browser);
    // Stopped by a picture, which stays chosen.
    start(2);
    choose(&browser, "#image-files", &[demonstration()]);
    browser.wait_for("the picture to be looked at", FOUND).unwrap();
    consent();
    assert_switched_off();
    assert_no_complaint(&browser);
    // Unplugged: the tracks end without `stop` of the page.
    start(3);
    browser.run("document.getElementById('status').textContent = ''", &[]).unwrap();
    consent();
    let status = "return /ms a frame/.test(document.getElementById('status').textContent)";
    browser.wait_for("a frame to be looked at", status).unwrap();
    browser.run("window.streams.at(-1).getTracks().forEach((track) => track.stop())", &[]).unwrap();
    assert!(complaint(&browser).contains("the camera was unplugged"));
    assert_switched_off();
    assert_quiet(&browser);
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn the_end_of_a_search_by_the_graphics_card_is_no_error() {
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
    assert_no_complaint(&browser);
    assert_quiet(&browser);
}
