//! Tests the site that `make site` built: every link and anchor has a target, a page loads nothing from other hosts and
//! runs no script, no page is large, every picture is shown, and axe-core finds no fault at the widths of a phone and a
//! desktop.
//!
//! Needs target/site, and for the last test Chromium and axe-core: `make test-site` provides all of them and runs these
//! tests. Screenshots are kept in target/site-test.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use sdg_webdriver::{Browser, BrowserOptions, serve_folder};

/// Maximum size of a page and its style sheet, in bytes, without its pictures.
const MAX_PAGE_BYTES: usize = 300_000;
/// Widths of the window in CSS pixels, and whether the dark scheme is on. Colours do not depend on the width.
const LOOKS: [(u32, bool); 3] = [(390, false), (1280, false), (1280, true)];

fn site() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../target/site")
        .canonicalize()
        .expect("target/site, which `make site` makes")
}

/// The book's pages by their path in the site; the detector's page (crates/web) has its own tests.
fn pages() -> BTreeMap<String, String> {
    fn collect(folder: &Path, pages: &mut BTreeMap<String, String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("site/detector") {
                collect(&path, pages);
            } else if path.extension().is_some_and(|extension| extension == "html") {
                let name = path.strip_prefix(site()).unwrap().to_str().unwrap().to_owned();
                pages.insert(name, fs::read_to_string(path).unwrap());
            }
        }
    }
    let mut pages = BTreeMap::new();
    collect(&site(), &mut pages);
    assert!(pages.len() > 40, "expected the site's pages, found {}", pages.len());
    pages
}

/// The values of an attribute, each with the text of its element before the attribute.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<(&'a str, &'a str)> {
    let start = format!(" {name}=\"");
    let mut found = Vec::new();
    for (idx, _) in page.match_indices(&start) {
        let element = page[..idx].rfind('<').map_or("", |open| &page[open + 1..idx]);
        let value = &page[idx + start.len()..];
        found.push((element, &value[..value.find('"').unwrap()]));
    }
    found
}

fn ids(page: &str) -> BTreeSet<&str> {
    attributes(page, "id").into_iter().map(|(_, id)| id).collect()
}

#[test]
#[ignore = "make site: reads target/site"]
fn links_of_the_built_site_lead_to_files_and_anchors() {
    let pages = pages();
    let mut faults = Vec::new();
    for (name, page) in &pages {
        for (element, link) in attributes(page, "href").into_iter().chain(attributes(page, "src")) {
            if link.contains("://") {
                if !element.starts_with("a ") && element != "a" {
                    faults.push(format!("{name}: {element} loads {link}"));
                }
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let path = if file.is_empty() { site().join(name) } else { site().join(name).parent().unwrap().join(file) };
            let Ok(path) = path.canonicalize() else {
                faults.push(format!("{name}: no file at {link}"));
                continue;
            };
            let Ok(target) = path.strip_prefix(site()) else {
                faults.push(format!("{name}: {link} leaves the site"));
                continue;
            };
            let target = pages.get(target.to_str().unwrap());
            if !anchor.is_empty() && !target.is_some_and(|target| ids(target).contains(anchor)) {
                faults.push(format!("{name}: no anchor at {link}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
#[ignore = "make site: reads target/site"]
fn pages_run_no_script_load_nothing_from_elsewhere_and_are_small() {
    let style = fs::read_to_string(site().join("site.css")).unwrap();
    assert!(!style.contains("url(") && !style.contains("@import"), "site.css loads something");
    let mut faults = Vec::new();
    for (name, page) in pages() {
        for element in ["<script", "<iframe", "<object", "<style", "@import"] {
            if page.contains(element) {
                faults.push(format!("{name}: {element}"));
            }
        }
        if page.len() + style.len() > MAX_PAGE_BYTES {
            faults.push(format!("{name}: {} bytes with its style, at most {MAX_PAGE_BYTES}", page.len() + style.len()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
#[ignore = "make site: needs Chromium and axe-core"]
fn pages_are_accessible_at_a_phone_s_width_and_on_a_desk() {
    let root = site().join("../..");
    let axe = fs::read_to_string(root.join("target/browser-test/npm/node_modules/axe-core/axe.min.js")).unwrap();
    let shots = root.join("target/site-test");
    fs::create_dir_all(&shots).unwrap();
    // The pages' policy forbids scripts; it does not apply to scripts that the WebDriver runs.
    let server = serve_folder(site()).unwrap();
    let browser = Browser::start(&BrowserOptions::default()).unwrap();
    let mut faults = Vec::new();
    for name in pages().keys() {
        for (width, is_dark) in LOOKS {
            browser.emulate(width, 900, is_dark).unwrap();
            browser.open(&server.url(name)).unwrap();
            browser.run(&format!("if (!window.axe) {{ {axe}\n }}"), &[]).unwrap();
            let script = "return axe.run(document).then((found) => found.violations.map((v) =>
                v.id + ': ' + v.nodes.slice(0, 3).map((n) => n.html.slice(0, 160)).join(' | ')))";
            let found = browser.run(script, &[]).unwrap();
            faults.extend(found.as_array().unwrap().iter().map(|fault| format!("{name} at {width} px: {fault}")));
            let unseen = "return [...document.images].filter((i) => !i.complete || !i.naturalWidth).map((i) => i.src)";
            let unseen = browser.run(unseen, &[]).unwrap();
            faults.extend(unseen.as_array().unwrap().iter().map(|picture| format!("{name}: not shown: {picture}")));
            let sticks_out = "return document.documentElement.scrollWidth - document.documentElement.clientWidth";
            let sticks_out = browser.run(sticks_out, &[]).unwrap();
            if sticks_out.as_f64() != Some(0.0) {
                faults.push(format!("{name} at {width} px: {sticks_out} px wider than the window"));
            }
            let scheme = if is_dark { "-dark" } else { "" };
            let file = format!("{}-{width}{scheme}.png", name.trim_end_matches(".html").replace('/', "-"));
            browser.screenshot(&shots.join(file)).unwrap();
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
