//! The visible region of the photo: zooming to a part, and a window of another size.

use serde_json::json;

use super::page::Page;

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
