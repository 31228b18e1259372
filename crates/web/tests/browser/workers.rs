//! Tests of workers that stop, that cannot be loaded, and that the browser does not have.

use std::fs;
use std::path::Path;

use sdg_webdriver::serve_folder;
use serde_json::{Value, json};

use crate::{open_page, site};

/// Takes the place of sdg_web.js. A model or a picture whose first byte is 0 makes it panic as the real module does: in
/// a microtask, so that the promise is never settled.
const MODULE: &str = r#"
    const answer = (bytes, answered) => bytes[0] !== 0
        ? Promise.resolve(answered)
        : new Promise(() => queueMicrotask(() => { throw new WebAssembly.RuntimeError("unreachable"); }));
    export default async () => {};
    export class Model {
        static open(bytes) { return answer(bytes, new Model()); }
        summary() { return '"a model"'; }
        detectInFile(bytes) { return answer(bytes, '"a record"'); }
        free() {}
    }"#;

/// Sends requests at once, each the name of the detector's function and the first byte of a model or a picture. Returns
/// each answer or error, at most after five seconds.
const ASK: &str = "return (async (requests) => {
    const { Detector } = await import(new URL('./detector.js', location.href).href);
    const detector = (window.detector ??= new Detector());
    const ask = {
        open: (bytes) => detector.open(new Blob([bytes])),
        look: (bytes) => detector.look(new Blob([bytes]), true).then(({ record }) => record),
    };
    const late = new Promise((resolve) => setTimeout(() => resolve('no answer'), 5000));
    const told = ([name, byte]) =>
        Promise.race([ask[name](new Uint8Array([byte])).catch(({ message }) => message), late]);
    return Promise.all(requests.map(told));
})(arguments[0])";

const RESTARTED: &str = "the model ran out of memory or failed internally, and was restarted";

#[test]
#[ignore = "needs Chromium: make test-web"]
fn every_request_is_answered_though_a_worker_stops_or_does_not_start() {
    let folder = tempfile::tempdir().unwrap();
    let served = |name: &str| folder.path().join(name);
    let copy = |name: &str| {
        fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("page").join(name), served(name)).unwrap();
    };
    copy("detector.js");
    fs::write(served("index.html"), "<!doctype html><title>Workers</title>").unwrap();
    let site = serve_folder(folder.path().to_owned()).unwrap();
    let browser = open_page(&site, &[]);
    let told = |requests: Value| browser.run(ASK, &[requests]).unwrap();
    let open = json!([["open", 1]]);
    assert_eq!(told(open.clone()), json!(["the worker could not be started"]));
    // The next request loads it again.
    copy("worker.js");
    let missing = told(open.clone());
    assert!(missing[0].as_str().unwrap().contains("sdg_web.js"), "{missing}");
    fs::write(served("sdg_web.js"), MODULE).unwrap();
    fs::write(served("sdg_web_bg.wasm"), "").unwrap();
    assert_eq!(told(open), json!(["a model"]));
    // One picture stops the worker; the next worker opens the model again, and searches the others.
    let pictures = json!([["look", 1], ["look", 0], ["look", 1], ["look", 1]]);
    assert_eq!(told(pictures), json!(["a record", RESTARTED, "a record", "a record"]));
    // A model stops the worker; the one before stays open.
    assert_eq!(told(json!([["open", 0], ["look", 1], ["open", 1]])), json!([RESTARTED, "a record", "a model"]));
}

#[test]
#[ignore = "needs Chromium and target/web: make test-web"]
fn a_browser_whose_workers_are_no_modules_is_told_so() {
    let site = site();
    let browser = open_page(&site, &[]);
    // Such a browser does not read the option.
    let script = "return import(new URL('./wasm_support.js', location.href).href).then(({ missingSupport }) => {
        const before = missingSupport();
        window.Worker = class { terminate() {} };
        return [before, missingSupport()];
    })";
    let told = browser.run(script, &[]).unwrap();
    assert_eq!(told[0], json!(null));
    assert!(told[1].as_str().unwrap().contains("a module as a worker"), "{told}");
}
