//! Tests of workers that stop, that cannot be started, and that the browser does not have.

use std::path::Path;

use sdg_webdriver::serve_folder;
use serde_json::json;

use crate::{open_page, site};

/// A worker that stops at the request to open "stop", as after a panic of the module, and opens everything else.
const STOPPING: &str = "onmessage = ({ data: { id, open } }) =>
    postMessage(open === 'stop' ? { id, error: 'out of memory', stopped: true } : { id, summary: open });";

/// Opens two models one after the other: what each answers, at most after five seconds.
const OPEN_TWICE: &str = "return (async () => {
    const { Detector } = await import(new URL('./detector.js', location.href).href);
    const detector = new Detector();
    const told = [];
    for (const model of ['stop', 'a model']) {
        const late = new Promise((resolve) => setTimeout(() => resolve('no answer'), 5000));
        told.push(await Promise.race([detector.open(model).catch(({ message }) => message), late]));
    }
    return told;
})()";

#[test]
#[ignore = "needs Chromium: make test-web"]
fn every_request_is_answered_though_the_worker_stops_or_does_not_start() {
    let not_started = "the worker could not be started";
    for (worker, told) in [(Some(STOPPING), ["out of memory", "a model"]), (None, [not_started; 2])] {
        let folder = tempfile::tempdir().unwrap();
        let detector = Path::new(env!("CARGO_MANIFEST_DIR")).join("page/detector.js");
        std::fs::copy(detector, folder.path().join("detector.js")).unwrap();
        std::fs::write(folder.path().join("index.html"), "<!doctype html><title>Workers</title>").unwrap();
        if let Some(worker) = worker {
            std::fs::write(folder.path().join("worker.js"), worker).unwrap();
        }
        let site = serve_folder(folder.path().to_owned()).unwrap();
        let browser = open_page(&site, &[]);
        assert_eq!(browser.run(OPEN_TWICE, &[]).unwrap(), json!(told));
    }
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
