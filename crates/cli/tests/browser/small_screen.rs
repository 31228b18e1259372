//! A phone's width, and the dark colour scheme.

use serde_json::json;

use super::page::{HOLD, Page};
use super::photo_to_grasp::patiently;
use super::tried::{add, photo, taught};

const STEPS: [&str; 4] = ["mark", "samples", "teach", "try"];

/// Buttons and labels that overlap the button with which their mark is cleared.
const OVERLAPS: &str = "const items = [...document.querySelectorAll('.todo li')].flatMap((li) =>
    [...li.querySelectorAll('button, label')].filter((e) => e.checkVisibility()).map((e) => [li, e]));
    const meets = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    const rect = (e) => e.getBoundingClientRect();
    return items.filter(([, e]) => e.matches('[data-clear]')).flatMap(([li, e]) => items
        .filter(([of, other]) => of === li && other !== e && meets(rect(e), rect(other)))
        .map(([, other]) => `${e.innerText} ${other.innerText}`))";

/// Pairs of controls that Tab reaches in another order than the visible one: from top to bottom, then from left to
/// right. The marks on the photo are left out.
const OUT_OF_ORDER: &str = "const all = document.querySelectorAll(arguments[0]);
    const controls = [...all].flatMap((e) => [...e.querySelectorAll('button, input, select, summary, [tabindex]')])
        .filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex >= 0)
        .filter((e) => !e.closest('#overlay, #toasts, dialog'));
    const name = (e) => e.id || e.innerText;
    const ahead = controls.filter((e) => e.tabIndex > 0).map(name);
    const isInRow = (a, b) => Math.abs(a.top + a.bottom - b.top - b.bottom) < 8;
    const isAbove = (a, b) => isInRow(a, b) ? a.left < b.left : a.bottom <= b.top + 1;
    const rect = (e) => e.getBoundingClientRect();
    const pairs = controls.slice(1).map((e, i) => [controls[i], e]);
    const wrong = pairs.filter(([a, b]) => isAbove(rect(b), rect(a))).map(([a, b]) => `${name(a)}, ${name(b)}`);
    return [controls.length > 1, ahead.concat(wrong)]";

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn tab_follows_the_order_that_is_seen() {
    let page = taught();
    add(&page, &[("other.png".to_owned(), photo())]);
    patiently(&page, "a detection", "return document.querySelector('#found .found') !== null");
    // In higher windows than these, the button that starts the teaching sticks to the lower edge.
    for (width, height, within) in [(390, 700, "body"), (1280, 700, ".top"), (1280, 700, ".panel"), (390, 700, "body")]
    {
        page.browser.emulate(width, height, false).unwrap();
        for step in STEPS {
            page.click(&format!("#tab-{step}"));
            page.settle_frames();
            let order = page.browser.run(OUT_OF_ORDER, &[json!(within)]).unwrap();
            assert_eq!(order[1], json!([]), "{step}, {within} at {width} px");
            assert_eq!(order[0], json!(true), "{step}, {within} at {width} px: there are controls");
        }
    }
    page.assert_accessible("the order on a phone");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn stroke_tools_are_at_the_photo_and_no_button_covers_another() {
    let page = Page::open();
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.browser.drag(&[page.on_screen(HOLD)]).unwrap();
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    for (width, is_in_tools) in [(1280, false), (390, true), (360, true), (1280, false)] {
        page.browser.emulate(width, 844, false).unwrap();
        page.browser.run("scrollTo(0, 0)", &[]).unwrap();
        page.settle_frames();
        let placed = "return document.querySelector('#tools #in-out') !== null";
        assert_eq!(page.browser.run(placed, &[]).unwrap(), json!(is_in_tools), "at {width} px");
        assert_eq!(page.browser.run(OVERLAPS, &[]).unwrap(), json!([]), "at {width} px");
        if is_in_tools {
            let in_sight = "const r = document.querySelector('[data-tool=in]').getBoundingClientRect();
                const stage = document.getElementById('stage').getBoundingClientRect();
                return r.height >= 44 && r.bottom <= stage.top && stage.bottom <= innerHeight";
            assert_eq!(page.browser.run(in_sight, &[]).unwrap(), json!(true), "at {width} px");
            page.assert_accessible(&format!("stroke tools at {width} px"));
        }
    }
    // The stroke tools are shown in the first step only.
    page.browser.emulate(390, 844, false).unwrap();
    page.click("#tab-try");
    page.settle_frames();
    let hidden = "return !document.getElementById('in-out').checkVisibility()";
    assert_eq!(page.browser.run(hidden, &[]).unwrap(), json!(true));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn every_step_fits_a_small_screen_in_light_and_dark() {
    let page = Page::open();
    page.browser.emulate(360, 740, false).unwrap();
    page.browser.open(&page.url).unwrap();
    page.wait_for("the photo", "return document.getElementById('photo').naturalWidth");
    page.draw_box();
    page.settle();
    page.browser.drag(&[page.on_screen(HOLD)]).unwrap();
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    for (width, height) in [(360, 740), (1280, 800)] {
        for (dark, scheme) in [(false, "light"), (true, "dark")] {
            page.browser.emulate(width, height, dark).unwrap();
            for step in STEPS {
                page.click(&format!("#tab-{step}"));
                page.browser.run("scrollTo(0, 0)", &[]).unwrap();
                let sticks_out = "return document.documentElement.scrollWidth - document.documentElement.clientWidth";
                assert_eq!(page.browser.run(sticks_out, &[]).unwrap(), json!(0), "{step} at {width} px");
                page.assert_accessible(&format!("{step} at {width} px, {scheme}"));
                page.screenshot(&format!("{step}-{width}-{scheme}"));
            }
        }
    }
    // The only action is visible without scrolling.
    page.click("#tab-teach");
    for (width, height) in [(390, 800), (1280, 800)] {
        page.browser.emulate(width, height, false).unwrap();
        page.browser.run("scrollTo(0, 0); document.querySelector('.panel').scrollTop = 0", &[]).unwrap();
        page.settle_frames();
        let in_sight = "const r = document.getElementById('teach-start').getBoundingClientRect();
            return r.top > 0 && r.bottom <= innerHeight && !document.getElementById('teach-start').disabled";
        page.screenshot(&format!("teach-{width}"));
        assert_eq!(page.browser.run(in_sight, &[]).unwrap(), json!(true), "at {width} px");
    }
    page.assert_quiet();
}
