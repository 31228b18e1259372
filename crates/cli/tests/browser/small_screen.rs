//! A phone's width, and the dark colour scheme.

use serde_json::json;

use super::page::{HOLD, Page};

const STEPS: [&str; 4] = ["mark", "samples", "teach", "try"];

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
