//! Tests that results belong to the open model, and that a model stays open if the graphics card fails.

use sdg_webdriver::serve_folder;
use serde_json::json;

use crate::taught::{Made, demonstration};
use crate::{FOUND, SOFTWARE_CARD, assert_no_complaint, assert_quiet, choose, open_model, open_page, repository, site};

/// Clicks the box of the graphics card, and again when the model is being opened on the card.
const CLICK_TWICE: &str = "const [box, status] = ['webgpu', 'status'].map((id) => document.getElementById(id));
    new MutationObserver((_, observer) => {
        if (status.textContent.startsWith('Opening')) {
            observer.disconnect();
            box.click();
        }
    }).observe(status, { childList: true });
    box.click();";

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn results_of_the_model_before_are_discarded() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = open_page(&site, &[]);
    open_model(&browser, &model);
    choose(&browser, "#image-files", &[demonstration()]);
    browser.wait_for("the picture to be looked at", FOUND).unwrap();
    // What is shown and can be saved at each change of the word under the picture.
    let watch = "window.seen = [];
        const small = document.querySelector('#pictures small');
        new MutationObserver(() => window.seen.push([small.textContent, document.getElementById('status').textContent,
            document.getElementById('download').hidden])).observe(small, { childList: true })";
    browser.run(watch, &[]).unwrap();
    choose(&browser, "#model-file", &[model]);
    let seen = browser.wait_for("another search", "return window.seen.length > 1 && window.seen").unwrap();
    assert_eq!(seen[0], json!(["waiting", "Looking…", true]));
    browser.wait_for("its result", FOUND).unwrap();
    assert_quiet(&browser);
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_model_stays_open_on_a_host_without_the_module_of_the_card() {
    let made = Made::new();
    let model = made.model("S");
    // A host without the folder of the module for the graphics card.
    let folder = made.path("site");
    std::fs::create_dir(&folder).unwrap();
    for entry in std::fs::read_dir(repository().join("target/web")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
        }
    }
    let site = serve_folder(folder).unwrap();
    let browser = open_page(&site, &SOFTWARE_CARD);
    open_model(&browser, &model);
    browser.find("#webgpu").unwrap().click().unwrap();
    let told = "return document.getElementById('alert').textContent.startsWith('The graphics card cannot be used')";
    browser.wait_for("the card's failure", told).unwrap();
    choose(&browser, "#image-files", &[demonstration()]);
    browser.wait_for("the picture to be looked at", FOUND).unwrap();
    assert_eq!(browser.run("return document.getElementById('webgpu').checked", &[]).unwrap(), json!(false));
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_model_opens_on_the_processor_if_the_graphics_card_was_not_chosen_last() {
    let made = Made::new();
    let model = made.model("S");
    let site = site();
    let browser = open_page(&site, &SOFTWARE_CARD);
    open_model(&browser, &model);
    browser.run("document.querySelector('#model-facts dl').id = 'before'", &[]).unwrap();
    browser.run(CLICK_TWICE, &[]).unwrap();
    let opened = "return document.querySelector('#model-facts dl').id === ''";
    browser.wait_for("the model on the processor again", opened).unwrap();
    assert_no_complaint(&browser);
    assert_eq!(browser.run("return document.getElementById('webgpu').checked", &[]).unwrap(), json!(false));
    choose(&browser, "#image-files", &[demonstration()]);
    browser.wait_for("the picture to be looked at", FOUND).unwrap();
    assert_no_complaint(&browser);
}
