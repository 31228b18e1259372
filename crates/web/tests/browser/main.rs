//! Tests the page in headless Chromium: the same grasps as `sdg detect`, fast and without freezing, and with clear
//! errors.
//!
//! Needs the results of `make web` and `make build`, and Chromium: `make test-web` provides all of them.
//! Screenshots are kept in target/browser-test.
#![allow(clippy::unwrap_used)]

mod bad_input;
mod camera;
mod grasps;
mod models;
mod taught;
mod workers;

use std::path::{Path, PathBuf};
use std::time::Duration;

use sdg_webdriver::{Browser, BrowserOptions, Site, serve_folder};

/// Cargo's target folder: target/ of the workspace, or CARGO_TARGET_DIR.
fn target() -> PathBuf {
    // target/release/deps/browser-0123456789abcdef
    std::env::current_exe().unwrap().ancestors().nth(3).unwrap().to_owned()
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_owned()
}

fn screenshots() -> PathBuf {
    repository().join("target/browser-test")
}

/// The page on a static host.
fn site() -> Site {
    let folder = repository().join("target/web");
    assert!(folder.join("sdg_web_bg.wasm").is_file(), "make web writes {}", folder.display());
    serve_folder(folder).unwrap()
}

/// Makes Chromium provide a software graphics card.
const SOFTWARE_CARD: [&str; 3] =
    ["--enable-unsafe-webgpu", "--enable-features=WebGPU,Vulkan", "--use-webgpu-adapter=swiftshader"];

/// Whether the first picture of the list was searched and is shown with one grasp.
const FOUND: &str = "return document.querySelector('#pictures small').textContent === 'One grasp'
    && /ms a frame/.test(document.getElementById('status').textContent)";

/// Opens the page in a browser with these flags.
fn open_page(site: &Site, flags: &[&str]) -> Browser {
    let flags = flags.iter().map(|flag| (*flag).to_owned()).collect();
    // A software graphics card of Chromium is slow.
    let patience = Duration::from_secs(180);
    let browser = Browser::start(&BrowserOptions { flags, patience, ..BrowserOptions::default() }).unwrap();
    browser.open(&site.url("index.html")).unwrap();
    browser
}

/// Chooses files in a file input, as with its dialog.
fn choose(browser: &Browser, input: &str, files: &[PathBuf]) {
    let paths: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    browser.find(input).unwrap().type_text(&paths.join("\n")).unwrap();
}

fn open_model(browser: &Browser, file: &Path) {
    choose(browser, "#model-file", &[file.to_owned()]);
    browser.wait_for("the model's facts", "return document.querySelector('#model-facts dl') !== null").unwrap();
}

/// The text of the page's alert; waits for it.
fn complaint(browser: &Browser) -> String {
    let shown = "const a = document.getElementById('alert'); return a.hidden ? '' : a.textContent";
    browser.wait_for("a complaint", shown).unwrap().as_str().unwrap().to_owned()
}

fn assert_no_complaint(browser: &Browser) {
    assert_eq!(browser.run("return document.getElementById('alert').textContent", &[]).unwrap(), "");
}

fn assert_quiet(browser: &Browser) {
    assert_eq!(browser.console_errors().unwrap(), Vec::<String>::new());
}
