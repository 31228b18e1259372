//! Clicks and small drags on marks, and a gripper that is placed before there is a box.

use serde_json::{Value, json};

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

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_drag_of_the_outline_s_line_adds_a_point_on_the_line_and_a_click_adds_none() {
    let page = Page::open();
    page.draw_outline(&[[200.0, 180.0], [320.0, 180.0], [420.0, 285.0], [200.0, 285.0]]);
    page.click("#do-outline h2");
    let before = page.saved().outline.unwrap();
    let [x, y] = page.on_screen([250.0, 285.0]);
    let scale = page.on_screen([251.0, 285.0])[0] - x;
    // The pointer is beside the line.
    page.browser.drag(&[[x, y + 6.0]]).unwrap();
    assert_eq!(page.saved().outline.unwrap(), before);
    let steps = "return import('/page/store.js').then(({ image }) => image().past.length)";
    assert_eq!(page.browser.run(steps, &[]).unwrap(), json!(1));
    page.browser.drag(&[6.0, 20.0, 36.0].map(|dy| [x, y + dy])).unwrap();
    let after = page.saved().outline.unwrap();
    let added: Vec<_> = after.vertices.iter().filter(|&point| !before.vertices.contains(point)).collect();
    assert_eq!((after.vertices.len(), added.len()), (5, 1), "{after:?}");
    let moved_px = scale * (added[0].y - before.vertices[2].y);
    assert!((moved_px - 30.0).abs() < 2.0, "{moved_px} px");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn without_a_box_a_gripper_is_placed_at_the_click() {
    let page = Page::open();
    page.browser.press(&["g"]).unwrap();
    page.browser.drag(&[page.on_screen([100.0, 100.0])]).unwrap();
    let placed = "return Promise.all(['store', 'geometry'].map((name) => import(`/page/${name}.js`)))
        .then(([{ marks }, { gripperOf }]) => marks().grasp && gripperOf(marks().grasp))";
    let placed = page.wait_for("a gripper", placed);
    let number = |value: &Value| value.as_f64().unwrap();
    let [x, y] = [0usize, 1].map(|axis| number(&placed["center"][axis]));
    assert!((x - 100.0).hypot(y - 100.0) < 2.0 && number(&placed["width"]) < 100.0, "{placed}");
    page.assert_quiet();
}
