//! Versions of the model: the choice of the next one, a turned hand is a change, pictures without the part, warnings of
//! a worse version, comparisons, and the page says that a model is being taught.

use serde_json::json;

use super::photo_to_grasp::patiently;
use super::tried::{add, marked, photo, taught};

const LEARNT: &str =
    "const text = document.getElementById('learnt').innerText; return text.startsWith('The new model finds') && text";

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_hand_turned_by_half_a_turn_is_a_change() {
    let page = taught();
    add(&page, &[("other.png".to_owned(), photo())]);
    patiently(&page, "a grasp", "return document.getElementById('found').innerText.includes('Found the part')");
    page.click("#tab-mark");
    page.click("#turn-around");
    page.settle();
    page.click("#tab-teach");
    page.wait_for("the old result", "return !document.getElementById('teach-old').hidden");
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 2");
    page.click("#tab-try");
    page.settle_frames();
    let learnt = patiently(&page, "the change", LEARNT);
    assert!(learnt.as_str().unwrap().ends_with("In 1 picture the hand is turned: other.png."), "{learnt}");
    let is_warning = "return document.getElementById('learnt').className === 'warning'";
    assert_eq!(page.browser.run(is_warning, &[]).unwrap(), json!(true));
    page.screenshot("versions-1-turned");
    page.assert_accessible("a turned hand");

    page.click("#tab-teach");
    for number in [1, 2] {
        page.click(&format!("#version-list li:nth-child({number}) input"));
        page.settle_frames();
    }
    // Another choice before the answer does not change the names in the table.
    let compare = "document.querySelector('#version-list li:nth-child(2) button').click();
        document.querySelector('#version-list input').click()";
    page.browser.run(compare, &[]).unwrap();
    patiently(&page, "the table", "return document.querySelector('#compared table') !== null");
    let compared = page.text("#compared");
    assert!(compared.starts_with("In 1 picture the hand is turned: other.png."), "{compared}");
    assert!(compared.contains("Picture\tModel 1\tModel 2"), "{compared}");
    assert!(compared.contains("≠ hand turned") && !compared.contains('✓'), "{compared}");
    page.screenshot("versions-2-compared");
    page.assert_accessible("versions that differ");

    // For a part that looks the same after half a turn, it is the same grasp.
    page.click("#tab-mark");
    page.click("#turn-around");
    page.settle();
    page.click("#tab-teach");
    page.browser.run("document.querySelector('[name=symmetry][value=\"2\"]').click()", &[]).unwrap();
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 3");
    page.click("#tab-try");
    page.settle_frames();
    let learnt = patiently(&page, "no change", LEARNT);
    assert!(learnt.as_str().unwrap().ends_with("No picture has changed."), "{learnt}");
    // After loading the page again, the symmetry of the model in use is chosen.
    page.browser.run("window.isOld = true; location.reload()", &[]).unwrap();
    page.wait_for("the page again", "return !window.isOld && document.querySelectorAll('.todo li.done').length === 3");
    page.click("#tab-teach");
    page.wait_for("its symmetry", "return document.querySelector('[name=symmetry]:checked').value === '2'");
    page.browser.run("document.querySelector('[name=symmetry][value=\"1\"]').click()", &[]).unwrap();
    page.wait_for("the old result", "return !document.getElementById('teach-old').hidden");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn an_answer_of_the_model_before_is_discarded_and_the_picture_searched_again() {
    let page = taught();
    // The first answer is withheld until `window.answer` is called.
    let withhold = "const send = window.fetch; window.answers = 0;
        window.fetch = async (path, options) => {
            const response = await send(path, options);
            const isFirst = path.endsWith('/detect') && (window.answers += 1) === 1;
            if (isFirst) await new Promise((done) => { window.answer = done; });
            return response;
        }";
    page.browser.run(withhold, &[]).unwrap();
    add(&page, &[("other.png".to_owned(), photo())]);
    patiently(&page, "the first answer", "return window.answers === 1");
    page.click("#tab-teach");
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 2");
    page.click("#tab-try");
    page.browser.run("window.answer()", &[]).unwrap();
    patiently(&page, "another search", "return window.answers === 2");
    patiently(&page, "a grasp", "return document.getElementById('found').innerText.includes('Found the part')");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_model_that_another_page_taught_is_adopted() {
    let page = marked();
    let teach =
        "return fetch('/api/teaching', { method: 'POST', body: '{\"model\": \"S\"}' }).then((answer) => answer.ok)";
    assert_eq!(page.browser.run(teach, &[]).unwrap(), json!(true));
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 1");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn pictures_that_cannot_be_compared_are_counted_and_not_called_unchanged() {
    let page = taught();
    add(&page, &["cut.png", "whole.png"].map(|name| (name.to_owned(), photo())));
    patiently(&page, "both", "return document.getElementById('strip').innerText.split('1 found').length === 3");
    page.click("#tab-teach");
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 2");
    for number in [1, 2] {
        page.click(&format!("#version-list li:nth-child({number}) input"));
        page.settle_frames();
    }
    // A compared picture has three cells, another one two.
    for (name, cells, told) in
        [("cut.png", 5, "No picture has changed. 1 picture could not be compared."), ("whole.png", 4, "")]
    {
        std::fs::write(page.folder.path().join(name), "no picture").unwrap();
        page.click("#version-list li:nth-child(2) button");
        let compared = format!("return document.querySelectorAll('#compared td').length === {cells}");
        patiently(&page, "the table", &compared);
        assert_eq!(page.text("#compared p"), told);
    }
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_version_and_a_region_that_another_page_chose_are_adopted() {
    let page = taught();
    page.click("#tab-teach");
    page.click("#teach-start");
    patiently(&page, "a version", "return document.querySelectorAll('#version-list li').length === 2");
    page.click("#tab-try");
    add(&page, &[("other.png".to_owned(), photo())]);
    let is_found = "return document.getElementById('found').innerText.includes('Found the part')";
    let region = r#"{"x":0,"y":0,"width":600,"height":440,"picture":[640,480]}"#;
    for (path, body, is_adopted) in [
        ("/api/models/0/current", "", "state.models[0].is_current"),
        ("/api/region", region, "state.region?.width === 600"),
    ] {
        patiently(&page, "a grasp", is_found);
        let choose = "return import('/page/store.js').then(({ state }) => {
                window.before = state.generation;
                return fetch(arguments[0], { method: 'PUT', body: arguments[1] });
            }).then((answer) => { dispatchEvent(new Event('focus')); return answer.ok; })";
        assert_eq!(page.browser.run(choose, &[json!(path), json!(body)]).unwrap(), json!(true));
        let again = format!(
            "return import('/page/store.js').then(({{ state }}) => {is_adopted} && state.generation > window.before)"
        );
        page.wait_for("another search", &again);
    }
    patiently(&page, "a grasp", is_found);
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_worse_version_and_photos_that_contradict_each_other_are_warned_of() {
    let page = taught();
    // The results of a second version are invented; they are inserted after the page has asked for the versions.
    let worse = "return new Promise((done) => setTimeout(done, 500)).then(() => import('/page/store.js')).then(({ state, changed }) => {
        const [model] = state.models;
        Object.assign(model.summary.figures, { found: [19, 19], wrong: 0, false_alarms: [0, 5] });
        const worse = structuredClone({ ...model, id: 1 });
        Object.assign(worse.summary.figures, { found: [14, 19], wrong: 5, false_alarms: [1, 5], turned_photos: [2] });
        state.models = [{ ...model, is_current: false }, worse];
        changed();
    })";
    page.browser.run(worse, &[]).unwrap();
    page.wait_for("the warning", "return !document.querySelector('#panel-try .worse').hidden");
    let told = page.text("#panel-try .worse");
    assert!(told.starts_with("The grasp in marked photo 2 points in another direction than that in photo 1"), "{told}");
    assert!(told.contains("Model 2 is worse on new samples than Model 1: 14 of 19 found, 5 wrong"), "{told}");
    page.screenshot("versions-3-worse");
    page.assert_accessible("a worse version");
    page.click("#panel-try .worse button");
    page.wait_for("no warning", "return document.querySelector('#panel-try .worse').hidden");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn while_the_first_model_is_taught_the_last_step_says_so() {
    let page = marked();
    page.unfold("#more");
    page.fill("#steps", "100000");
    page.click("#teach-start");
    page.click("#tab-try");
    add(&page, &[("other.png".to_owned(), photo())]);
    patiently(&page, "a step", "return /\\(Step \\d+ of 100000/.test(document.getElementById('try-intro').innerText)");
    let intro = page.text("#try-intro");
    assert!(intro.starts_with("A model is being taught (") && intro.contains("can be added already"), "{intro}");
    assert!(!page.text("#panel-try").contains("learns from your answers"), "{}", page.text("#panel-try"));
    page.unfold("#region-fold");
    assert!(page.text("#region-text").starts_with("A model is being taught"), "{}", page.text("#region-text"));
    let off = "return [...document.getElementById('region-form').elements].every((control) => control.disabled)";
    assert_eq!(page.browser.run(off, &[]).unwrap(), json!(true));
    page.screenshot("versions-4-teaching");
    page.assert_accessible("trying while a model is taught");
    page.click("#tab-teach");
    page.click("#teach-stop");
    patiently(&page, "the end", "return !document.getElementById('teach-form').hidden");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_chosen_model_stays_chosen_although_the_outline_that_it_needs_is_missing_for_a_while() {
    let page = marked();
    page.choose_model("D");
    page.click("#tab-mark");
    page.click("[data-clear=outline]");
    page.settle();
    page.click("#tab-teach");
    let is_off = "return document.querySelector('[name=model][value=D]').disabled";
    page.wait_for("the reason", is_off);
    let chosen = "return document.querySelector('[name=model]:checked').value";
    assert_eq!(page.browser.run(chosen, &[]).unwrap(), json!("D"));
    page.click("#teach-start");
    page.wait_for("the refusal", "return document.getElementById('teach-error').innerText.includes('outline')");
    page.click("#tab-mark");
    page.click("#undo");
    page.settle();
    page.click("#tab-teach");
    page.wait_for("the outline", &is_off.replace("return ", "return !"));
    assert_eq!(page.browser.run(chosen, &[]).unwrap(), json!("D"));
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn in_pictures_without_the_part_less_is_better() {
    let page = taught();
    add(&page, &["there.png", "empty.png"].map(|name| (name.to_owned(), photo())));
    patiently(&page, "both", "return document.getElementById('strip').innerText.split('1 found').length === 3");
    // The results of another version are invented.
    let invent = "return import('/page/store.js').then(({ changed, state }) => {
            const [empty, there] = state.trialPictures;
            there.before = there.detections;
            const [before, detections] = arguments[0] ? [there.detections, []] : [[], there.detections];
            Object.assign(empty, { is_absent: true, before, detections });
            changed();
        })";
    for (was_found, change, class) in [(true, "less", "learnt"), (false, "more", "warning")] {
        page.browser.run(invent, &[json!(was_found)]).unwrap();
        page.settle_frames();
        let told = format!(
            "The new model finds the part in 1 of 1 pictures; the one before: in 1. \
             In 1 picture {change} is wrongly found: empty.png."
        );
        assert_eq!(page.text("#learnt"), told);
        let class_name = page.browser.run("return document.getElementById('learnt').className", &[]).unwrap();
        assert_eq!(class_name, json!(class));
    }
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_comparison_does_not_delay_detections() {
    let page = taught();
    add(&page, &[("other.png".to_owned(), photo())]);
    patiently(&page, "a grasp", "return document.getElementById('found').innerText.includes('Found the part')");
    // The comparison gets no answer.
    let detect = "const send = window.fetch;
        window.fetch = (path, options) => path.includes('/compare/') ? new Promise(() => {}) : send(path, options);
        return import('/page/api.js').then(({ api }) => {
            api.compareModels(0, 0);
            return api.detect(0);
        }).then(({ detections }) => detections.length > 0)";
    assert_eq!(page.browser.run(detect, &[]).unwrap(), json!(true));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_new_version_is_compared_with_the_one_that_was_in_use_and_searched_with() {
    let page = taught();
    // Three versions are invented; the page learns of the third one while the first is in use.
    let invent = "return new Promise((done) => setTimeout(done, 500)).then(() => import('/page/store.js'))
        .then(({ adoptModels, changed, state }) => {
            const [model] = state.models;
            const version = (id, found, is_current) => {
                const made = structuredClone({ ...model, id, is_current, file: `${id}.sdg` });
                Object.assign(made.summary.figures, { found: [found, 19], wrong: 0, false_alarms: [0, 5] });
                return made;
            };
            const { region } = state;
            adoptModels({ models: [version(0, 19, true), version(1, 10, false)], region });
            const { generation } = state;
            adoptModels({ models: [version(0, 19, false), version(1, 10, false), version(2, 14, true)], region });
            changed();
            return state.generation > generation;
        })";
    assert_eq!(page.browser.run(invent, &[]).unwrap(), json!(true));
    page.settle_frames();
    let told = page.text("#panel-try .worse");
    assert!(told.contains("Model 3 is worse on new samples than Model 1: 14 of 19 found"), "{told}");
}
