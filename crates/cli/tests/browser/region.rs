//! The searched region: drawn on a picture, given as numbers, on live pictures, and in the next model.

use serde_json::json;

use super::page::{HOLD, Page, shipped_photo};
use super::photo_to_grasp::patiently;

/// A region around the pendulum, and a region beside it.
const ON_IT: [f64; 4] = [220.0, 140.0, 200.0, 200.0];
const BESIDE_IT: [f64; 4] = [20.0, 20.0, 180.0, 160.0];

/// The page with the shipped photo and its marks, and a camera that shows the same picture.
fn open() -> Page {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table");
    std::fs::create_dir(&table).unwrap();
    std::fs::copy(shipped_photo(), table.join("a.png")).unwrap();
    std::fs::copy(shipped_photo(), folder.path().join("photo.png")).unwrap();
    let marks = shipped_photo().with_file_name("annotation.json");
    // The marks name their photo.
    let text = std::fs::read_to_string(marks).unwrap().replace("image.png", "photo.png");
    std::fs::write(folder.path().join("photo.json"), text).unwrap();
    let page = Page::open_in(folder, &["photo.png", "--from", "dir:table?fps=10&loop"]);
    page.wait_for("the marks", "return document.querySelectorAll('.todo li.done').length === 3");
    page
}

fn teach(page: &Page) {
    page.click("#tab-teach");
    page.choose_model("S");
    let before = page.browser.run("return document.querySelectorAll('#version-list li').length", &[]).unwrap();
    page.click("#teach-start");
    let one_more = format!("return document.querySelectorAll('#version-list li').length > {before}");
    patiently(page, "a model", &one_more);
}

fn drag(page: &Page, [x, y, width, height]: [f64; 4]) {
    page.unfold("#region-fold");
    page.click("#region-draw");
    page.settle_frames();
    let corners = [[x, y], [x + 0.5 * width, y + 0.5 * height], [x + width, y + height]];
    page.browser.drag(&corners.map(|corner| page.on_screen(corner))).unwrap();
}

fn found_is(page: &Page, words: &str) {
    patiently(page, words, &format!("return document.getElementById('found').innerText.includes({words:?})"));
}

fn live_found_is(page: &Page, words: &str) {
    patiently(page, words, &format!("return document.getElementById('live-found').innerText.includes({words:?})"));
}

fn region_of_file(page: &Page) -> Option<[u32; 4]> {
    let bytes = std::fs::read_dir(page.folder.path()).unwrap().find_map(|entry| {
        let path = entry.unwrap().path();
        (path.extension().is_some_and(|extension| extension == "sdg")).then(|| std::fs::read(path).unwrap())
    });
    let model = sdg_grasp::GraspModel::from_bytes(&bytes.unwrap(), &sdg_grasp::TeachOptions::new(0).device).unwrap();
    model.region().map(|region| [region.x, region.y, region.width, region.height])
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_region_is_drawn_and_typed_and_holds_live_and_in_the_next_model() {
    let page = open();
    teach(&page);
    assert_eq!(region_of_file(&page), None);
    page.click("#go-try");
    live_found_is(&page, "Found the part");
    page.unfold("#region-fold");
    assert!(page.text("#region-text").contains("The whole picture is searched"));

    // The region is drawn on the live picture, beside the part.
    drag(&page, BESIDE_IT);
    live_found_is(&page, "There is nothing to grasp");
    assert!(page.text("#region-text").contains("are in the frame"), "{}", page.text("#region-text"));
    page.wait_for("the frame", "return document.querySelector('#region-frame .line').getAttribute('d').length > 10");
    page.screenshot("region-1-live");
    page.assert_accessible("a region on the live picture");

    // On a picture, the region is given as numbers, around the part.
    let other = page.folder.path().join("other.png");
    std::fs::copy(shipped_photo(), &other).unwrap();
    page.browser.find("#picture-input").unwrap().type_text(other.to_str().unwrap()).unwrap();
    found_is(&page, "Nothing is accepted");
    let shown = |id: &str| page.browser.run("return document.getElementById(arguments[0]).valueAsNumber", &[json!(id)]);
    let drawn =
        ["region-x", "region-y", "region-width", "region-height"].map(|id| shown(id).unwrap().as_f64().unwrap());
    assert!(drawn.iter().zip(BESIDE_IT).all(|(drawn, meant)| (drawn - meant).abs() < 3.0), "{drawn:?}");
    for (id, value) in ["region-x", "region-y", "region-width", "region-height"].into_iter().zip(ON_IT) {
        page.fill(&format!("#{id}"), &value.to_string());
    }
    page.click("#region-set");
    found_is(&page, "Found the part");
    page.screenshot("region-2-typed");
    page.assert_accessible("a region by numbers");

    // A region that is too small for the part is rejected with a message, and the previous one is kept.
    drag(&page, [HOLD[0] - 20.0, HOLD[1] - 20.0, 40.0, 40.0]);
    page.wait_for(
        "the refusal",
        "return document.getElementById('region-error').innerText.includes('the part fits in')",
    );
    let told = page.browser.console_errors().unwrap();
    assert!(told.len() == 1 && told[0].contains("422"), "{told:?}");
    page.screenshot("region-3-refused");
    page.assert_accessible("a region that is refused");

    // The next model stores the region; after a reload it is shown again.
    teach(&page);
    assert_eq!(region_of_file(&page), Some(ON_IT.map(|side| side as u32)));
    // The page reports the effect of the new model. It does not report the effect of another region as that of a model.
    page.click("#tab-try");
    page.settle_frames();
    let learnt = "return document.getElementById('learnt').innerText.startsWith('The new model finds')";
    patiently(&page, "what was learnt", learnt);
    page.click("#region-set");
    page.wait_for("nothing learnt", "return document.getElementById('learnt').hidden");
    page.browser.run("window.isOld = true; location.reload()", &[]).unwrap();
    page.wait_for("the page again", "return !window.isOld && document.querySelectorAll('.todo li.done').length === 3");
    page.click("#tab-try");
    page.wait_for("the region", "return document.getElementById('region-width').valueAsNumber === 200");
    page.browser.emulate(390, 844, true).unwrap();
    page.settle_frames();
    page.screenshot("region-4-phone");
    page.assert_accessible("a region on a phone");
    page.click("#region-all");
    page.wait_for("all", "return document.getElementById('region-frame') === null");
    page.assert_quiet();
}
