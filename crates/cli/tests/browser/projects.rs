//! The project of the page: a photo's own project, a chosen one, or a new folder for a photo.

use serde_json::json;

use super::page::{Page, repository, shipped_photo};
use super::photo_to_grasp::patiently;

fn theme(page: &Page, name: &str) {
    for (width, height) in [(390, 800), (1280, 800)] {
        for (dark, scheme) in [(false, "light"), (true, "dark")] {
            page.browser.emulate(width, height, dark).unwrap();
            page.settle_frames();
            let sticks_out = "return document.documentElement.scrollWidth - document.documentElement.clientWidth";
            assert_eq!(page.browser.run(sticks_out, &[]).unwrap(), json!(0), "{name} at {width} px");
            page.assert_accessible(&format!("{name} at {width} px, {scheme}"));
            page.screenshot(&format!("projects-{name}-{width}-{scheme}"));
        }
    }
    page.browser.emulate(1280, 800, false).unwrap();
}

/// Presses the control that opens the folder, and waits until its pictures are listed.
fn open_folder(page: &Page, css: &str) {
    page.browser.run("document.getElementById('folder-list').replaceChildren()", &[]).unwrap();
    page.click(css);
    page.wait_for(
        "the folder",
        "return document.getElementById('folder').open && document.querySelectorAll('#folder-list img').length > 0",
    );
}

fn photo_of_page(page: &Page, name: &str) {
    let shown = format!(
        "const p = document.getElementById('photo'); return p.complete && p.naturalWidth && p.alt === 'Photo {name}'"
    );
    page.wait_for(name, &shown);
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn without_an_argument_a_photo_becomes_a_project_that_is_found_again() {
    let page = Page::open_in(tempfile::tempdir().unwrap(), &[]);
    page.wait_for("the start", "return !document.getElementById('start').hidden");
    assert!(page.text("#start").contains("Drop a photo of the part here"));
    theme(&page, "start");
    page.browser.find("#new-input").unwrap().type_text(shipped_photo().to_str().unwrap()).unwrap();
    page.wait_for("the form", "return !document.getElementById('new-part').hidden");
    page.fill("#new-name", "hanging pendulum");
    theme(&page, "new");
    page.click("#new-part .primary");
    photo_of_page(&page, "image.png");
    let folder = page.folder.path().join("hanging_pendulum");
    assert_eq!(std::fs::read(folder.join("image.png")).unwrap(), std::fs::read(shipped_photo()).unwrap());
    assert_eq!(
        page.browser.run("return document.getElementById('label').value", &[]).unwrap(),
        json!("hanging pendulum")
    );
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();

    page.click("#projects");
    page.wait_for("the list", "return document.querySelectorAll('#recent-list button').length === 1");
    let listed = page.text("#recent-list");
    assert!(listed.starts_with("hanging pendulum") && listed.contains("/hanging_pendulum"), "{listed}");
    theme(&page, "recent");
    // A name that already exists is reported, and no file is overwritten.
    page.browser.find("#new-input").unwrap().type_text(shipped_photo().to_str().unwrap()).unwrap();
    page.wait_for("the form", "return !document.getElementById('new-part').hidden");
    page.fill("#new-name", "hanging pendulum");
    page.click("#new-part .primary");
    page.wait_for("the reason", "return document.getElementById('start-error').innerText.includes('hanging_pendulum')");
    page.click("#recent-list button");
    photo_of_page(&page, "image.png");
    page.wait_for("its marks", "return document.querySelector('#do-outline.done') !== null");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_photo_is_opened_again_with_its_models_and_tried_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = repository().join("datasets/demonstrations/pendulum");
    std::fs::copy(shipped.join("image.png"), folder.path().join("lever arm.png")).unwrap();
    let marks = std::fs::read_to_string(shipped.join("annotation.json")).unwrap();
    std::fs::write(folder.path().join("lever arm.json"), marks.replace("image.png", "lever arm.png")).unwrap();
    std::fs::copy(shipped.join("image.png"), folder.path().join("IMG_1.png")).unwrap();
    let mut page = Page::open_in(folder, &["lever arm.png"]);
    photo_of_page(&page, "lever arm.png");
    page.click("#tab-teach");
    page.choose_model("S");
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 1");
    page.click("#tab-try");
    // No file of the folder is used until it is added.
    assert_eq!(page.text("#add-others"), "From this folder (1)…");
    open_folder(&page, "#add-others");
    page.wait_for("the folder", "return document.querySelectorAll('#folder-list img').length === 1");
    theme(&page, "folder");
    // Escape closes the dialog; keys do not act on the photo behind it.
    page.browser.press(&["?"]).unwrap();
    page.browser.press(&["\u{e00c}"]).unwrap();
    page.wait_for("no dialog", "return document.querySelector('dialog[open]') === null");
    open_folder(&page, "#add-others");
    page.click("#folder-list button");
    page.click("#folder form button");
    patiently(&page, "an answer", "return document.getElementById('found').innerText.includes('Found the part')");

    page.browser.open("about:blank").unwrap();
    page.stop_server();
    page.start_server();
    page.browser.open(&page.url.clone()).unwrap();
    photo_of_page(&page, "lever arm.png");
    page.click("#tab-teach");
    page.wait_for("the version", "return document.querySelectorAll('#version-list li').length === 1");
    page.click("#tab-try");
    patiently(&page, "the tried one", "return document.getElementById('found').innerText.includes('Found the part')");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_photo_that_was_opened_is_shown_first() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.png"] {
        std::fs::copy(shipped_photo(), folder.path().join(name)).unwrap();
    }
    let project = r#"{"format": 1, "photos": ["a.png", "b.png"], "tried": [], "removed": [], "models": []}"#;
    std::fs::write(folder.path().join("sdg-project.json"), project).unwrap();
    let page = Page::open_in(folder, &["b.png"]);
    photo_of_page(&page, "b.png");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn in_a_new_folder_the_photo_is_chosen_and_the_name_is_asked_for_once() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("lever");
    std::fs::create_dir(&project).unwrap();
    for name in ["IMG_1.png", "IMG_2.png", "IMG_3.png"] {
        std::fs::copy(shipped_photo(), project.join(name)).unwrap();
    }
    let mut page = Page::open_in(folder, &["lever"]);
    page.wait_for(
        "the choice",
        "return document.getElementById('folder').open && document.querySelectorAll('#folder-list img').length === 3",
    );
    theme(&page, "choose");
    page.click("#folder form button");
    assert!(page.text("#panel-mark").contains("Choose the photo of the part"), "{}", page.text("#panel-mark"));
    theme(&page, "no-photo");
    for step in ["samples", "teach", "try", "mark"] {
        page.click(&format!("#tab-{step}"));
        page.settle_frames();
    }
    open_folder(&page, "#choose-photo");
    page.click("#folder-list li:nth-child(2) button");
    photo_of_page(&page, "IMG_2.png");
    // The folder's name is proposed, because file names of cameras carry no meaning.
    assert_eq!(page.browser.run("return document.getElementById('label').value", &[]).unwrap(), json!("lever"));
    assert!(page.text("#naming").contains("Proposed name."));
    theme(&page, "named");
    page.click("#keep-name");
    page.wait_for("no question", "return document.getElementById('naming').hidden");
    // A second photo is added and removed again.
    open_folder(&page, "#add-photo");
    page.click("#folder-list li:nth-child(1) button");
    photo_of_page(&page, "IMG_1.png");
    page.click("#remove-photo");
    photo_of_page(&page, "IMG_2.png");

    page.browser.open("about:blank").unwrap();
    page.stop_server();
    page.start_server();
    page.browser.open(&page.url.clone()).unwrap();
    photo_of_page(&page, "IMG_2.png");
    page.wait_for(
        "its name",
        "return document.getElementById('label').value === 'lever' && document.getElementById('naming').hidden",
    );
    page.click("#tab-try");
    assert_eq!(page.text("#add-others"), "From this folder (2)…");
    open_folder(&page, "#add-others");
    page.click("#folder-all");
    page.wait_for("both", "return document.querySelectorAll('#strip button').length === 2");
    page.assert_quiet();
}
