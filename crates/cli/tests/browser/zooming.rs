//! The visible region of the photo: zooming to a part, a window of another size, and two fingers; and another photo.

use serde_json::json;

use super::page::{HOLD, Page};
use super::project::open;

/// The shown zoom, in percent.
fn zoom(page: &Page) -> f64 {
    page.settle_frames();
    page.text("#zoom").trim_end_matches(" %").parse().unwrap()
}

/// Whether the first of these marks that is drawn lies inside the stage.
fn is_in_view(page: &Page, kinds: &[&str]) -> bool {
    let script = "const drawn = arguments[0].map((kind) => document.querySelector(`#overlay .${kind} .line`));
        const mark = drawn.find(Boolean).getBoundingClientRect();
        const stage = document.getElementById('stage').getBoundingClientRect();
        return mark.left >= stage.left && mark.right <= stage.right
            && mark.top >= stage.top && mark.bottom <= stage.bottom";
    page.settle_frames();
    page.browser.run(script, &[json!(kinds)]).unwrap() == json!(true)
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn zooming_to_a_part_never_shrinks_the_photo_and_follows_the_window() {
    // Boxes that fill nearly all, almost half, and a small share of the photo.
    let boxes = [[10.0, 10.0, 630.0, 470.0], [100.0, 80.0, 520.0, 400.0], [255.0, 164.0, 392.0, 282.0]];
    for [x1, y1, x2, y2] in boxes {
        let page = Page::open();
        let whole = zoom(&page);
        let corners = [[x1, y1], [0.5 * (x1 + x2), 0.5 * (y1 + y2)], [x2, y2]].map(|place| page.on_screen(place));
        page.browser.drag(&corners).unwrap();
        page.wait_for("the box", "return document.querySelector('#do-box.done') !== null");
        page.settle();
        let near = zoom(&page);
        assert!(near >= whole && is_in_view(&page, &["box"]), "{whole} → {near} %");
        if x2 - x1 < 500.0 {
            assert!(near > whole, "{whole} → {near} %");
        }
        // The key shows the whole photo and the part in turn.
        page.browser.run("document.getElementById('overlay').focus()", &[]).unwrap();
        for _ in 0..2 {
            page.browser.press(&["f"]).unwrap();
            assert!(zoom(&page) >= whole && is_in_view(&page, &["outline", "box"]));
        }
        // In a window of another size, the part is still in view.
        for (width, height) in [(390, 844), (844, 390), (1280, 800)] {
            page.browser.emulate(width, height, false).unwrap();
            assert!(is_in_view(&page, &["outline", "box"]), "at {width} × {height}");
        }
        page.assert_quiet();
    }
}

/// Two fingers touch these places and both move by `[dx, dy]`.
fn move_two_fingers(page: &Page, places: [[f64; 2]; 2], [dx, dy]: [f64; 2]) {
    let finger = |(id, [x, y]): (usize, [f64; 2])| {
        let to = |x: f64, y: f64| json!({"type": "pointerMove", "duration": 20, "x": x.round(), "y": y.round()});
        let (down, up) = (json!({"type": "pointerDown", "button": 0}), json!({"type": "pointerUp", "button": 0}));
        let actions = [to(x, y), down, to(x + dx / 2.0, y + dy / 2.0), to(x + dx, y + dy), up];
        let parameters = json!({"pointerType": "touch"});
        json!({"type": "pointer", "id": format!("finger {id}"), "parameters": parameters, "actions": actions})
    };
    let fingers: Vec<_> = places.into_iter().enumerate().map(finger).collect();
    page.browser.perform(&json!(fingers)).unwrap();
    page.settle_frames();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_photo_follows_two_fingers_while_an_outline_is_drawn() {
    let page = Page::open();
    page.click("[data-draw=outline]");
    for place in [[260.0, 170.0], [385.0, 170.0], [385.0, 275.0]] {
        page.browser.drag(&[page.on_screen(place)]).unwrap();
    }
    let points = "return import('/page/store.js').then(({ state }) => state.draft?.points.length ?? 0)";
    assert_eq!(page.browser.run(points, &[]).unwrap(), json!(3));
    let (before, scale) = (page.on_screen(HOLD), zoom(&page));
    move_two_fingers(&page, [[220.0, 240.0], [420.0, 240.0]].map(|place| page.on_screen(place)), [60.0, 20.0]);
    let after = page.on_screen(HOLD);
    let moved = [after[0] - before[0], after[1] - before[1]];
    assert!((moved[0] - 60.0).abs() < 2.0 && (moved[1] - 20.0).abs() < 2.0, "{moved:?}");
    assert_eq!(zoom(&page), scale);
    assert_eq!(page.browser.run(points, &[]).unwrap(), json!(3), "the points are kept");
    page.browser.press(&["\u{e00c}"]).unwrap();
    page.settle_frames();
    assert_eq!(page.browser.run(points, &[]).unwrap(), json!(0), "Esc deletes them");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_photo_before_is_not_shown_under_the_marks_of_the_next_one() {
    let page = open(&[], &["a", "b"]);
    let open_next = "return import('/page/strip.js').then(({ openImage }) => {
            openImage(1);
            return document.getElementById('photo').style.visibility;
        })";
    assert_eq!(page.browser.run(open_next, &[]).unwrap(), json!("hidden"));
    page.wait_for("the next photo", "return document.getElementById('photo').style.visibility === ''");
    page.assert_quiet();
}
