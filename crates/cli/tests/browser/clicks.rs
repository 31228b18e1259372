//! Clicks on marks.

use serde_json::json;

use super::page::{Page, repository, shipped_photo};

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_click_on_a_handle_changes_nothing_although_the_file_has_more_digits() {
    let folder = tempfile::tempdir().unwrap();
    let marks = std::fs::read_to_string(repository().join("datasets/demonstrations/pendulum/annotation.json")).unwrap();
    std::fs::copy(shipped_photo(), folder.path().join("photo.png")).unwrap();
    std::fs::write(folder.path().join("photo.json"), marks.replacen("338.3", "338.33333", 1)).unwrap();
    let page = Page::open_in(folder, &["photo.png"]);
    page.wait_for("the marks", "return document.querySelectorAll('.todo li.done').length === 3");
    page.browser.drag(&[page.handle("[data-edge='se'] .knob")]).unwrap();
    page.settle();
    assert_eq!(page.browser.run("return document.getElementById('undo').disabled", &[]).unwrap(), json!(true));
    assert_eq!(page.text("#saved"), "Saved in photo.json");
    assert!(!page.folder.path().join("photo.coco.json").exists());
    page.assert_quiet();
}
