//! `sdg camera calibrate --from`: the page that shows the view that is needed next.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use sdg_webdriver::{Browser, BrowserOptions};
use serde_json::json;

use super::page::{assert_accessible, repository};
use crate::rendering::cameras::{CAMERAS, board, poses};
use crate::rendering::{Exposure, Random, render};

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
fn the_page_shows_the_board_and_what_is_lacking() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    std::fs::create_dir(&frames).unwrap();
    let camera = CAMERAS[0].1;
    for (k, pose) in poses(&camera).iter().take(5).enumerate() {
        let picture = render(&board(), &camera, pose, &Exposure::ORDINARY, &mut Random(k as u64));
        picture.save(frames.join(format!("{k}.png"))).unwrap();
    }
    // The frames repeat, so that there is always a picture.
    let from = format!("dir:{}?fps=4&loop", frames.display());
    let arguments = ["camera", "calibrate", "--from", &from, "--no-browser", "--out", "camera.yaml"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
    command.args(arguments).current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = Ended(command.spawn().unwrap());
    let mut told = BufReader::new(child.0.stderr.take().unwrap()).lines();
    let first = told.next().unwrap().unwrap();
    let url = first.strip_prefix("pictures at ").unwrap_or_else(|| panic!("{first}")).to_owned();
    for k in 0..5 {
        let line = told.next().unwrap().unwrap();
        assert!(line.starts_with(&format!("taken: calibration-pictures/00{k}.png")), "{line}");
    }
    let browser = Browser::start(&BrowserOptions::default()).unwrap();
    browser.emulate(1280, 800, false).unwrap();
    browser.open(&url).unwrap();
    browser.wait_for("the picture", "return document.querySelector('img').naturalWidth === 640").unwrap();
    browser.screenshot(&repository().join("target/browser-test/calibrating.png")).unwrap();
    assert_accessible(&browser, "the board in the live picture");
    let words = "return document.getElementById('words').textContent.startsWith('5 taken; ')";
    browser.wait_for("the same in words", words).unwrap();
    assert_eq!(browser.run("return document.getElementById('ended').hidden", &[]).unwrap(), json!(true));
    assert_eq!(count(&folder.path().join("calibration-pictures")), 5, "repeated views are not taken");
    drop(child);
    browser.wait_for("that it has ended", "return !document.getElementById('ended').hidden").unwrap();
    browser.screenshot(&repository().join("target/browser-test/calibrating-ended.png")).unwrap();
    assert_accessible(&browser, "the program has ended");
}

fn count(folder: &Path) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}
