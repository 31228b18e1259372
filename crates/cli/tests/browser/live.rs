//! A photo is taken with a camera, marked and taught, and the model is tried on pictures of that camera.

use std::path::Path;

use image::RgbImage;
use serde_json::json;

use super::page::{BOX, HOLD, Page, shipped_photo};
use super::photo_to_grasp::patiently;
use super::project::free_port;

/// The wrist camera in the pose of the shipped photos: straight down from 0.58 m; right in the picture is -y of the
/// base frame.
const CAMERA: &str = include_str!("../wrist.yaml");

fn picture() -> RgbImage {
    image::open(shipped_photo()).unwrap().into_rgb8()
}

/// Replaces the picture of the `dir:` camera.
fn show(table: &Path, name: &str, picture: &RgbImage) {
    let before: Vec<_> = std::fs::read_dir(table).unwrap().map(|entry| entry.unwrap().path()).collect();
    // The file has a hidden name until it is complete; other programs write pictures in the same way.
    let hidden = table.join(format!(".{name}"));
    picture.save(&hidden).unwrap();
    std::fs::rename(hidden, table.join(name)).unwrap();
    before.into_iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

fn open(further: &[&str]) -> Page {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table");
    std::fs::create_dir(&table).unwrap();
    std::fs::write(folder.path().join("wrist.yaml"), CAMERA).unwrap();
    show(&table, "a.png", &picture());
    let page = Page::open_in(folder, &[&["--from", "dir:table?fps=10&loop"], further].concat());
    page.wait_for("the live picture", "return document.getElementById('photo').naturalWidth === 640");
    wait_for_state(&page, "Live");
    page
}

fn wait_for_state(page: &Page, word: &str) {
    page.wait_for(word, &format!("return document.getElementById('live-word').innerText === '{word}'"));
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_photo_from_the_camera_is_marked_taught_and_tried_live() {
    let page = open(&[]);
    let table = page.folder.path().join("table");
    assert!(page.text("#shoot-where").contains("photo.png"), "{}", page.text("#shoot-where"));
    page.screenshot("live-1-shoot");
    page.assert_accessible("before the first photo");
    for step in ["samples", "teach"] {
        page.click(&format!("#tab-{step}"));
        page.settle_frames();
        assert!(page.text(&format!("#panel-{step}")).contains("ake a photo"), "{step}");
    }
    page.click("#tab-mark");

    take_and_mark(&page);
    page.screenshot("live-2-marked");
    teach(&page);

    // The part is now rotated by 180°, at another position.
    show(&table, "b.png", &image::imageops::rotate180(&picture()));
    page.click("#go-try");
    found_at(&page, [640.0 - HOLD[0], 480.0 - HOLD[1]]);
    assert!(page.text("#live-time").contains(" ms"), "{}", page.text("#live-time"));
    page.screenshot("live-3-tried");
    page.assert_accessible("tried live");
    // The part is back, and the drawing follows.
    show(&table, "c.png", &picture());
    found_at(&page, HOLD);

    pause_and_keep(&page, &table);
    lose_the_camera(&page, &table);
    take_another(&page);
    page.assert_quiet();
}

fn take_and_mark(page: &Page) {
    page.browser.press(&["t"]).unwrap();
    page.wait_for("the photo", "return document.getElementById('photo').alt === 'Photo photo.png'");
    let taken = image::open(page.folder.path().join("photo.png")).unwrap().into_rgb8();
    assert_eq!(taken, picture(), "the photo is what the camera showed");
    page.wait_for("its pixels", "const p = document.getElementById('photo'); return p.complete && p.naturalWidth");
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();
    page.browser.drag(&[page.on_screen(HOLD)]).unwrap();
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    let saved = page.saved();
    assert!((saved.bbox.x1 - BOX[0]).abs() < 1.5 && saved.grasp.is_some(), "{saved:?}");
}

fn teach(page: &Page) {
    page.click("#tab-teach");
    page.choose_model("S");
    page.click("#teach-start");
    patiently(page, "a model", "return document.getElementById('teach-outcome').innerText.includes('Written to')");
}

/// Waits until a grasp is drawn at this position of the live picture.
fn found_at(page: &Page, place: [f64; 2]) {
    const MAX_DISTANCE_PX: f64 = 12.0;
    let drawn = format!(
        "const p = document.getElementById('photo').getBoundingClientRect(), k = p.width / 640;
        const jaws = [...document.querySelectorAll('#overlay .grasp .jaw')].map((jaw) => jaw.getBoundingClientRect());
        if (jaws.length !== 2) return false;
        const mean = (low, high) => jaws.reduce((sum, r) => sum + (r[low] + r[high]) / 4, 0);
        const [x, y] = [(mean('left', 'right') - p.left) / k, (mean('top', 'bottom') - p.top) / k];
        return Math.hypot(x - {}, y - {}) < {MAX_DISTANCE_PX}
            && document.getElementById('live-found').innerText.includes('Found the part')",
        place[0], place[1]
    );
    // Text and drawing are of the same frame; a new frame might change both between two queries.
    patiently(page, "the grasp where the part is, and the words", &drawn);
}

fn pause_and_keep(page: &Page, table: &Path) {
    page.browser.press(&["l"]).unwrap();
    wait_for_state(page, "Paused");
    show(table, "d.png", &RgbImage::from_pixel(640, 480, image::Rgb([150, 150, 150])));
    page.browser.press(&["k"]).unwrap();
    page.wait_for("the kept picture", "return document.querySelectorAll('#strip button').length === 1");
    page.wait_for("its grasp", "return document.getElementById('strip').innerText.includes('1 found')");
    page.browser.press(&["l"]).unwrap();
    page.wait_for("nothing", "return document.getElementById('live-found').innerText.includes('nothing to grasp')");
    // The kept picture can be viewed, and then the camera is shown again.
    page.click("#strip button");
    page.wait_for("the kept picture", "return document.getElementById('photo').alt.startsWith('Photo live-')");
    page.wait_for("its grasp", "return document.getElementById('found').innerText.includes('Found the part')");
    page.screenshot("live-4-kept");
    page.click("#live-toggle");
    wait_for_state(page, "Live");
}

/// Detections in an old picture are neither drawn nor reported.
fn lose_the_camera(page: &Page, table: &Path) {
    show(table, "e.png", &picture());
    found_at(page, HOLD);
    let away = table.with_file_name("away");
    std::fs::rename(table, &away).unwrap();
    wait_for_state(page, "Camera gone");
    page.settle_frames();
    let left = "return document.querySelectorAll('#overlay .jaw, #live-found > *').length";
    assert_eq!(page.browser.run(left, &[]).unwrap(), json!(0));
    page.screenshot("live-5-lost");
    std::fs::rename(&away, table).unwrap();
    found_at(page, HOLD);
}

fn take_another(page: &Page) {
    page.click("#tab-mark");
    page.browser.press(&["c"]).unwrap();
    page.wait_for("the camera", "return !document.getElementById('shoot').hidden");
    page.wait_for("its name", "return document.getElementById('shoot-where').innerText.includes('photo-2.png')");
    page.assert_accessible("before a further photo");
    page.click("#take");
    page.wait_for("the photo", "return document.getElementById('photo').alt === 'Photo photo-2.png'");
    assert!(page.folder.path().join("photo-2.png").exists());
    page.wait_for("both in the row", "return document.querySelectorAll('#strip button').length === 2");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn with_a_calibrated_camera_the_grasp_is_told_in_millimetres() {
    let page = open(&["--camera", "wrist.yaml", "--mark-height-mm", "16", "--grasp-height-mm", "9"]);
    take_and_mark(&page);
    let marked = page.saved().grasp.unwrap().center();
    teach(&page);
    page.click("#go-try");
    found_at(&page, HOLD);
    let told = page.text("#live-found .pose");
    // Calculated by hand from the marks on the photo, which is vertical: focal length 550 pixels, 0.564 m above the
    // marks.
    let (in_picture, told) = told.split_once('\n').unwrap();
    assert!(in_picture.contains(" px, ") && in_picture.contains('°'), "{in_picture}");
    let number = |name: &str| -> f64 {
        let rest = told.split(name).nth(1).unwrap();
        rest.split([',', ' ']).next().unwrap().parse().unwrap()
    };
    let expected = [480.0 - (marked.y - 240.0) * 564.0 / 550.0, -(marked.x - 320.0) * 564.0 / 550.0];
    assert!((number("x ") - expected[0]).hypot(number("y ") - expected[1]) < 2.0, "{told}, expected {expected:?}");
    assert!(told.contains("frame: base") && told.contains("z 9.0 mm"), "{told}");
    page.screenshot("live-calibrated");
    page.assert_accessible("with a calibrated camera");

    // Pictures of another size are not from this camera.
    show(&page.folder.path().join("table"), "b.png", &image::imageops::thumbnail(&picture(), 320, 240));
    wait_for_state(&page, "Another size");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_photo_that_another_page_took_is_shown_and_its_project_is_known() {
    let page = open(&[]);
    let take = "return import('/page/store.js')
        .then(({ state }) => fetch(`/api/live/${state.live.number}/photo`, { method: 'POST' }))
        .then((answer) => { dispatchEvent(new Event('focus')); return answer.ok; })";
    assert_eq!(page.browser.run(take, &[]).unwrap(), json!(true));
    page.wait_for("the photo", "return document.getElementById('photo').alt === 'Photo photo.png'");
    let known = "return import('/page/store.js').then(({ state }) => [state.project !== null, state.tool])";
    assert_eq!(page.browser.run(known, &[]).unwrap(), json!([true, "box"]));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_kept_frame_whose_search_failed_is_searched_again() {
    let page = open(&[]);
    take_and_mark(&page);
    teach(&page);
    let fail = "const send = window.fetch;
        window.fetch = async (path, options) => (/live.*detect/.test(path)
            ? new Response('{\"error\": \"too dark\"}', { status: 422 }) : send(path, options))";
    page.browser.run(fail, &[]).unwrap();
    page.click("#go-try");
    page.wait_for("the failure", "return document.getElementById('live-error').innerText === 'too dark'");
    page.browser.press(&["k"]).unwrap();
    patiently(&page, "its grasp", "return document.getElementById('strip').innerText.includes('1 found')");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_camera_that_goes_away_is_told_and_comes_back() {
    let page = open(&[]);
    let (table, away) = (page.folder.path().join("table"), page.folder.path().join("away"));
    std::fs::rename(&table, &away).unwrap();
    wait_for_state(&page, "Camera gone");
    page.wait_for("no photo to be taken", "return document.getElementById('take').disabled");
    page.browser.press(&["t"]).unwrap();
    page.screenshot("live-gone");
    page.assert_accessible("without its camera");
    std::fs::rename(&away, &table).unwrap();
    wait_for_state(&page, "Live");
    page.wait_for("photos again", "return !document.getElementById('take').disabled");
    assert!(!page.folder.path().join("photo.png").exists(), "the key took no photo of an old picture");

    show(&table, "b.png", &RgbImage::new(640, 480));
    wait_for_state(&page, "Black picture");
    show(&table, "c.png", &picture());
    wait_for_state(&page, "Live");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_camera_fits_a_small_screen_in_light_and_dark() {
    let page = open(&[]);
    for (width, height) in [(360, 740), (1280, 800)] {
        for (dark, scheme) in [(false, "light"), (true, "dark")] {
            page.browser.emulate(width, height, dark).unwrap();
            for step in ["mark", "try"] {
                page.click(&format!("#tab-{step}"));
                page.browser.run("scrollTo(0, 0)", &[]).unwrap();
                page.settle_frames();
                let sticks_out = "return document.documentElement.scrollWidth - document.documentElement.clientWidth";
                assert_eq!(page.browser.run(sticks_out, &[]).unwrap(), json!(0), "{step} at {width} px");
                page.assert_accessible(&format!("{step} with a camera at {width} px, {scheme}"));
                page.screenshot(&format!("live-{step}-{width}-{scheme}"));
            }
        }
    }
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn after_a_start_with_another_camera_the_page_shows_that_one() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"]);
    let other = page.folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    show(&other, "a.png", &picture());
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.arguments[1] = "dir:other?fps=10&loop".to_owned();
    page.start_server();
    page.wait_for("its address", "return document.getElementById('live-why').innerText.includes('other')");
}
