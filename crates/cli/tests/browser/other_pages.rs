//! Marks and pictures that another program or another page changes meanwhile, and marks that the server refuses.

use std::path::Path;

use serde_json::{Value, json};

use super::page::Page;
use super::project::{annotation, are_kept, free_port, open};

/// Waits until a note over the picture has this text.
fn wait_for_note(page: &Page, text: &str) {
    page.wait_for(text, &format!("return document.getElementById('toasts').innerText.includes({text:?})"));
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_that_another_program_changed_are_shown_and_not_written_over() {
    let page = open(&[], &["photo"]);
    let file = page.folder.path().join("project/photo.json");
    let before = move_left_edge(&file);
    page.browser.press(&["]"]).unwrap();
    wait_for_note(&page, "another program");
    page.settle();
    assert_eq!(page.text("#saved"), "Saved in photo.json");
    let saved = file.with_file_name("photo.coco.json");
    assert!(!saved.exists());
    page.browser.press(&["]"]).unwrap();
    page.wait_for("saved", "return document.getElementById('saved').innerText === 'Saved in photo.coco.json'");
    assert!((annotation(&saved).bbox.x1 - (before - 5.0)).abs() < 0.1);
    // The first change here is restored by two steps back.
    for _ in 0..2 {
        page.browser.press(&["\u{e009}", "z"]).unwrap();
    }
    page.settle();
    let [turned, original] = [&saved, &file].map(|path| annotation(path).grasp.unwrap().angle().degrees());
    let turn = turned - original;
    assert!((annotation(&saved).bbox.x1 - before).abs() < 0.1 && (turn - 1.0).abs() < 0.1, "{turn}°");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn refused_marks_are_kept_and_sent_again_but_invalid_ones_only_to_another_server() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["photo"]);
    let file = page.folder.path().join("project/photo.coco.json");
    // As if another process had locked the file of the marks.
    let refuse = "window.send = window.fetch; window.count = 0;
        window.fetch = async (path, options) => {
            if (options?.method !== 'PUT') return window.send(path, options);
            window.count += 1;
            if (!window.isLocked) return window.send(path, options);
            return new Response('{\"error\": \"locked\"}', { status: 409 });
        };
        window.isLocked = true";
    page.browser.run(refuse, &[]).unwrap();
    page.browser.press(&["]"]).unwrap();
    page.wait_for("the banner", "return document.getElementById('unsaved').innerText.includes('locked')");
    are_kept(&page);
    page.wait_for("another try", "return window.count > 1");
    page.browser.run("window.isLocked = false", &[]).unwrap();
    page.wait_for("saved", "return document.getElementById('saved').innerText === 'Saved in photo.coco.json'");
    page.wait_for("no banner", "return document.getElementById('unsaved').hidden");
    let before = annotation(&file).outline;

    let cross = "return Promise.all(['store', 'editing'].map((name) => import(`/page/${name}.js`)))
        .then(([{ marks }, { commit }]) => {
            window.count = 0;
            marks().outline = [[260, 170], [385, 275], [385, 170], [260, 275]];
            commit();
        })";
    page.browser.run(cross, &[]).unwrap();
    let refused = "return document.getElementById('saved').innerText.startsWith('Not saved')";
    page.wait_for("the refusal", refused);
    are_kept(&page);
    // Longer than the interval at which the page checks the server.
    let check = "return new Promise((done) => setTimeout(() => done(true), 3500))";
    page.wait_for("a check of the server", check);
    assert_eq!(page.browser.run("return window.count", &[]).unwrap(), json!(1));
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.start_server();
    page.wait_for("no banner", "return document.getElementById('lost').hidden");
    page.wait_for("a check of the server", check);
    assert!(page.text("#saved").starts_with("Not saved"), "{}", page.text("#saved"));
    assert_eq!(page.browser.run("return window.count", &[]).unwrap(), json!(2));
    assert_eq!(annotation(&file).outline, before);
}

/// Moves the left edge of the box in a file of LabelMe by 5 pixels; returns its earlier place.
fn move_left_edge(file: &Path) -> f64 {
    let mut marks: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let left = &mut marks["shapes"][0]["points"][0][0];
    let before = left.as_f64().unwrap();
    *left = json!(before - 5.0);
    std::fs::write(file, marks.to_string()).unwrap();
    before
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_that_another_program_changed_are_shown_after_a_change_of_the_name() {
    let page = open(&[], &["photo"]);
    let file = page.folder.path().join("project/photo.json");
    let before = move_left_edge(&file);
    page.fill("#label", "another name");
    page.wait_for("the change", "return !document.getElementById('undo').disabled");
    page.browser.press(&["]"]).unwrap();
    page.settle();
    let after = annotation(&file.with_file_name("photo.coco.json")).bbox.x1;
    assert!((after - (before - 5.0)).abs() < 0.1, "{before} {after}");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_made_without_a_server_do_not_replace_those_of_another_program() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["photo"]);
    let file = page.folder.path().join("project/photo.json");
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.browser.press(&["]"]).unwrap();
    are_kept(&page);
    move_left_edge(&file);
    page.start_server();
    wait_for_note(&page, "changed elsewhere");
    page.settle();
    assert_eq!(page.text("#saved"), "Saved in photo.json");
    assert!(!file.with_file_name("photo.coco.json").exists());
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn invalid_marks_that_another_page_undid_are_not_shown_any_more() {
    let page = open(&[], &["photo"]);
    let cross = "return Promise.all(['store', 'editing'].map((name) => import(`/page/${name}.js`)))
        .then(([{ image, marks }, { commit }]) => {
            window.before = image().sent;
            marks().outline = [[260, 170], [385, 275], [385, 170], [260, 275]];
            commit();
        })";
    page.browser.run(cross, &[]).unwrap();
    page.wait_for("the refusal", "return document.getElementById('saved').innerText.startsWith('Not saved')");
    let undo = "return fetch('/api/images/0/marks', { method: 'PUT', body: window.before })
        .then((answer) => { dispatchEvent(new Event('focus')); return answer.ok; })";
    assert_eq!(page.browser.run(undo, &[]).unwrap(), json!(true));
    page.wait_for("saved", "return document.getElementById('saved').innerText === 'Saved in photo.coco.json'");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_photo_that_another_page_removed_leaves_no_banner() {
    let page = open(&[], &["earlier", "photo"]);
    let take_out = "return fetch('/api/images/0', { method: 'DELETE' }).then((answer) => answer.ok)";
    assert_eq!(page.browser.run(take_out, &[]).unwrap(), json!(true));
    page.browser.press(&["]"]).unwrap();
    page.wait_for("the refusal", "return document.getElementById('saved').innerText.startsWith('Not saved')");
    page.settle_frames();
    assert_eq!(page.browser.run("return document.getElementById('unsaved').hidden", &[]).unwrap(), json!(true));
    page.browser.run("dispatchEvent(new Event('focus'))", &[]).unwrap();
    page.wait_for("the other photo", "return document.getElementById('photo').alt === 'Photo photo.png'");
    let count = "return import('/page/store.js').then(({ state }) => state.images.length)";
    assert_eq!(page.browser.run(count, &[]).unwrap(), json!(1));
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn pictures_that_another_page_added_are_shown_and_a_restored_photo_only_once() {
    let page = open(&[], &["earlier", "photo"]);
    // Requests of another page; then this one is used again.
    let ask = |script: &str| {
        let script =
            format!("return {script}.then((answer) => {{ dispatchEvent(new Event('focus')); return answer.ok; }})");
        assert_eq!(page.browser.run(&script, &[]).unwrap(), json!(true));
    };
    let row = "return [...document.querySelectorAll('#strip button')].map((b) => b.children[1].innerText).join()";
    ask("fetch('/api/images/0/picture').then((answer) => answer.blob())
        .then((body) => fetch('/api/trial-pictures?name=tried.png', { method: 'POST', body }))");
    page.click("#tab-try");
    page.wait_for("the picture to try", &format!("{row} === 'tried.png'"));
    page.click("#tab-mark");
    page.click("#remove-photo");
    page.wait_for("the other photo", "return document.getElementById('photo').alt === 'Photo photo.png'");
    wait_for_note(&page, "is removed");
    ask("fetch('/api/images/0/put-back', { method: 'POST' })");
    page.wait_for("the removed photo", &format!("{row} === 'photo.png,earlier.png'"));
    page.click("#toasts button");
    page.wait_for("it on the stage", "return document.getElementById('photo').alt === 'Photo earlier.png'");
    page.settle_frames();
    assert_eq!(page.browser.run(row, &[]).unwrap(), json!("photo.png,earlier.png"));
    page.assert_quiet();
}
