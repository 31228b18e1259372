//! `sdg detect --from … --draw PORT`: live pictures with detections drawn on them.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use sdg_webdriver::{Browser, BrowserOptions};
use serde_json::json;

use super::page::{assert_accessible, repository, shipped_photo};

/// A process that is killed when dropped.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_drawn_picture_fills_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, marks) = (shipped_photo(), shipped_photo().with_file_name("annotation.json"));
    let sdg = || {
        let mut sdg = Command::new(env!("CARGO_BIN_EXE_sdg"));
        sdg.current_dir(folder.path());
        sdg
    };
    let demo = format!("{}:{}", photo.display(), marks.display());
    let taught = sdg().args(["teach", "--model", "S", "--demo", &demo, "--out", "part.sdg"]).output().unwrap();
    assert!(taught.status.success(), "{}", String::from_utf8_lossy(&taught.stderr));
    let from = format!("file:{}?loop&fps=5", photo.display());
    let arguments = ["detect", "--grasp-model", "part.sdg", "--from", &from, "--draw", "0"];
    let mut child = Ended(sdg().args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
    let mut first = String::new();
    BufReader::new(child.0.stderr.take().unwrap()).read_line(&mut first).unwrap();
    let url = first.trim().strip_prefix("pictures at ").unwrap_or_else(|| panic!("{first}"));

    let browser = Browser::start(&BrowserOptions::default()).unwrap();
    for (width, height) in [(1280, 800), (390, 800)] {
        browser.emulate(width, height, false).unwrap();
        browser.open(url).unwrap();
        browser.wait_for("the picture", "return document.querySelector('img').naturalWidth === 640").unwrap();
        let script = "const r = document.querySelector('img').getBoundingClientRect();
            return [r.left, r.top, r.width - innerWidth, r.height - innerHeight]";
        assert_eq!(browser.run(script, &[]).unwrap(), json!([0, 0, 0, 0]), "at {width} px");
        browser.screenshot(&repository().join(format!("target/browser-test/drawn-{width}.png"))).unwrap();
        assert_accessible(&browser, "live pictures with what was found");
    }
}
