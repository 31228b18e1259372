//! Marks made and corrected with keys.

use serde_json::json;

use super::page::Page;

const ENTER: &str = "\u{e007}";
const ESCAPE: &str = "\u{e00c}";
const DELETE: &str = "\u{e017}";
const SHIFT: &str = "\u{e008}";
const LEFT: &str = "\u{e012}";
const DOWN: &str = "\u{e015}";

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn all_marks_are_made_and_corrected_by_keys() {
    let page = Page::open();
    let browser = &page.browser;
    let press = |keys: &[&str]| browser.press(keys).unwrap();

    // A box in the centre, of which one corner is moved.
    press(&["b"]);
    press(&[ENTER]);
    let start = page.saved().bbox;
    browser.run("document.querySelector(\"[data-edge='se']\").focus()", &[]).unwrap();
    press(&[SHIFT, DOWN]);
    press(&[LEFT]);
    let corner = page.saved().bbox;
    assert_eq!([corner.x2 - start.x2, corner.y2 - start.y2, corner.x1 - start.x1], [-1.0, 10.0, 0.0]);

    // The page may have found an outline in this box; the outline is removed.
    if page.saved().outline.is_some() {
        page.click("[data-clear=outline]");
    }
    // A button that was pressed earlier has the focus; the key of a mark moves the focus to the photo.
    browser.run("document.getElementById('undo').focus()", &[]).unwrap();
    press(&["g"]);
    press(&[ENTER]);
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    let placed = page.saved();
    for _ in 0..5 {
        press(&["]"]);
    }
    press(&["."]);
    press(&[LEFT]);
    let moved = page.saved();
    let (a, b) = (placed.grasp.unwrap(), moved.grasp.unwrap());
    assert!((b.angle().degrees() - a.angle().degrees() - 5.0).abs() < 0.1, "{a:?} → {b:?}");
    assert!((moved.jaw_width.unwrap() - placed.jaw_width.unwrap() - 1.0).abs() < 0.02);
    assert!((b.center().x - a.center().x + 1.0).abs() < 0.02 && (b.center().y - a.center().y).abs() < 0.02);

    // Numbers can also be typed.
    page.fill("#grasp-width", "44");
    assert_eq!(page.saved().jaw_width, Some(44.0));

    // The gripper is deleted and restored.
    browser.run("document.querySelector('[data-body]').focus()", &[]).unwrap();
    press(&[DELETE]);
    page.wait_for("no gripper", "return document.querySelector('#do-grasp.done') === null");
    assert!(page.saved().grasp.is_none());
    press(&["\u{e009}", "z"]);
    page.wait_for("the gripper again", "return document.querySelector('#do-grasp.done') !== null");
    assert_eq!(page.saved().jaw_width, Some(44.0));

    // The help opens by key, lists the keys, and closes.
    press(&["?"]);
    assert!(page.text("#help").contains("Turn the gripper"));
    page.screenshot("help");
    page.assert_accessible("help");
    press(&[ESCAPE]);
    assert_eq!(browser.run("return document.getElementById('help').open", &[]).unwrap(), json!(false));
    page.assert_quiet();
}
