//! `sdg annotate` on a folder that belongs to the test, opened in a browser.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use sdg_demonstration::{Annotation, ImageFacts};
use sdg_webdriver::{Browser, BrowserOptions};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::assert_fields_are_documented;

/// The pendulum's box on its photo: left, top, right, bottom.
pub const BOX: [f64; 4] = [255.0, 164.0, 392.0, 282.0];
/// The grasp point: the middle of the pendulum's handle.
pub const HOLD: [f64; 2] = [325.0, 225.0];

/// The page with its server and browser; both are stopped when it is dropped.
pub struct Page {
    pub browser: Browser,
    pub folder: TempDir,
    server: Child,
    /// Arguments of the next start of the server.
    pub arguments: Vec<String>,
    pub url: String,
}

pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_owned()
}

pub fn shipped_photo() -> PathBuf {
    repository().join("datasets/demonstrations/pendulum/image.png")
}

impl Page {
    /// Opens the page on a copy of the shipped pendulum's photo, without marks.
    pub fn open() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(shipped_photo(), folder.path().join("photo.png")).unwrap();
        let page = Self::open_in(folder, &["photo.png"]);
        page.wait_for("the photo", "const p = document.getElementById('photo'); return p.complete && p.naturalWidth");
        page
    }

    /// Opens the page with these arguments, which name files in the folder.
    pub fn open_in(folder: TempDir, arguments: &[&str]) -> Self {
        let arguments: Vec<String> = arguments.iter().map(|&argument| argument.to_owned()).collect();
        let (server, url) = serve(&folder, &arguments);
        let browser = Browser::start(&BrowserOptions::default()).unwrap();
        browser.emulate(1280, 800, false).unwrap();
        let page = Self { browser, folder, server, arguments, url };
        page.browser.open(&page.url).unwrap();
        page
    }

    /// Kills the server.
    pub fn stop_server(&mut self) {
        self.server.kill().unwrap();
        self.server.wait().unwrap();
    }

    /// Prevents writing files, as on a full disk, or allows it again.
    pub fn fill_disk(&self, is_full: bool) {
        let limit = if is_full { "--fsize=0:unlimited" } else { "--fsize=unlimited:unlimited" };
        let status = Command::new("prlimit").args(["--pid", &self.server.id().to_string(), limit]).status();
        assert!(status.unwrap().success(), "prlimit of Debian's util-linux");
    }

    /// Starts the server again with the same arguments.
    pub fn start_server(&mut self) {
        (self.server, self.url) = serve(&self.folder, &self.arguments);
    }

    pub fn wait_for(&self, what: &str, script: &str) -> Value {
        self.browser.wait_for(what, script).unwrap()
    }

    pub fn click(&self, css: &str) {
        // Scrolled first, because most of the page is below the photo on a narrow screen.
        let script = "document.querySelector(arguments[0]).scrollIntoView({block: 'center'})";
        self.browser.run(script, &[json!(css)]).unwrap();
        self.browser.find(css).unwrap().click().unwrap();
    }

    /// Opens a collapsed section.
    pub fn unfold(&self, css: &str) {
        if self.browser.run("return document.querySelector(arguments[0]).open", &[json!(css)]).unwrap() == json!(false)
        {
            self.click(&format!("{css} > summary"));
        }
    }

    /// Chooses the model to teach; all letters except C are in a collapsed section.
    pub fn choose_model(&self, letter: &str) {
        if letter != "C" {
            self.unfold("#other-models");
        }
        self.click(&format!("[name=model][value={letter}]"));
    }

    /// Replaces the text of a field with keys alone. The page may write to a field without focus at any time, and a
    /// hidden field cannot have the focus.
    pub fn fill(&self, css: &str, text: &str) {
        let shown = format!("return document.querySelector({css:?}).checkVisibility()");
        self.wait_for("a field that is shown", &shown);
        self.browser.find(css).unwrap().type_text(&format!("\u{e009}a\u{e000}{text}\u{e004}")).unwrap();
    }

    pub fn text(&self, css: &str) -> String {
        let text = self.browser.run("return document.querySelector(arguments[0]).innerText", &[json!(css)]).unwrap();
        text.as_str().unwrap_or_default().to_owned()
    }

    /// Position on the screen of a point of the photo.
    pub fn on_screen(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let script = "const p = document.getElementById('photo'), r = p.getBoundingClientRect();
            const k = r.width / p.naturalWidth; return [r.left + arguments[0] * k, r.top + arguments[1] * k]";
        numbers(&self.browser.run(script, &[json!(x), json!(y)]).unwrap())
    }

    /// The centre of a handle on the screen.
    pub fn handle(&self, css: &str) -> [f64; 2] {
        let script = "const r = document.querySelector(arguments[0]).getBoundingClientRect();
            return [r.left + r.width / 2, r.top + r.height / 2]";
        numbers(&self.browser.run(script, &[json!(css)]).unwrap())
    }

    pub fn draw_box(&self) {
        let corner = |x, y| self.on_screen([x, y]);
        let middle = corner(0.5 * (BOX[0] + BOX[2]), 0.5 * (BOX[1] + BOX[3]));
        self.browser.drag(&[corner(BOX[0], BOX[1]), middle, corner(BOX[2], BOX[3])]).unwrap();
    }

    /// Draws an outline by hand, which has these corners, in the step of the outline.
    pub fn draw_outline(&self, corners: &[[f64; 2]]) {
        self.browser.press(&["o"]).unwrap();
        for &corner in corners {
            self.browser.drag(&[self.on_screen(corner)]).unwrap();
        }
        self.browser.press(&["\u{e007}"]).unwrap();
        self.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    }

    /// Waits until the last action is shown, sent and answered.
    pub fn settle(&self) {
        let script = "return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(
            document.getElementById('propose').innerText !== 'Looking…' && document.getElementById('saved').innerText !== 'Saving…'))))";
        self.wait_for("the page to settle", script);
    }

    /// Waits until the last action is drawn.
    pub fn settle_frames(&self) {
        let script =
            "return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))";
        self.wait_for("the page to draw", script);
    }

    /// Waits until everything is saved, and reads the saved marks.
    pub fn saved(&self) -> Annotation {
        self.settle();
        self.wait_for(
            "everything to be saved",
            "return document.getElementById('saved').innerText.startsWith('Saved in')",
        );
        let bytes = std::fs::read(self.folder.path().join("photo.json")).unwrap();
        let facts = ImageFacts { width: 640, height: 480, file_name: Some("photo.png") };
        Annotation::read(&bytes, &facts).unwrap().remove(0)
    }

    pub fn screenshot(&self, name: &str) {
        self.browser.screenshot(&repository().join(format!("target/browser-test/annotate-{name}.png"))).unwrap();
    }

    pub fn assert_accessible(&self, about: &str) {
        assert_accessible(&self.browser, about);
    }

    pub fn assert_quiet(&self) {
        assert_eq!(self.browser.console_errors().unwrap(), [""; 0]);
    }
}

/// Asserts that axe-core finds no violations on the current page.
pub fn assert_accessible(browser: &Browser, about: &str) {
    let path = repository().join("target/browser-test/npm/node_modules/axe-core/axe.min.js");
    let axe =
        std::fs::read_to_string(&path).unwrap_or_else(|_| panic!("make test-browser installs {}", path.display()));
    browser.run(&format!("if (!window.axe) {{ {axe}\n }}"), &[]).unwrap();
    let script = "return axe.run(document).then((found) => found.violations.map((v) =>
            `${v.id} (${v.help}): ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`))";
    let violations = browser.run(script, &[]).unwrap();
    assert_eq!(violations, json!([]), "{about}");
}

fn serve(folder: &TempDir, arguments: &[String]) -> (Child, String) {
    // With the signal XFSZ ignored, a file above the test's size limit is an error, as on a full disk, and does not end
    // the program.
    let mut server = Command::new("sh")
        .args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_sdg")])
        .args(["annotate", "--no-browser", "--json"])
        .args(arguments)
        .current_dir(folder.path())
        // The server is killed; its session files are deleted with the folder.
        .env("TMPDIR", folder.path())
        .env("XDG_STATE_HOME", folder.path().join("state"))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(server.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert_fields_are_documented(&["annotate", "--json"], line.as_bytes());
    let told: Value = serde_json::from_str(&line).unwrap();
    (server, told["url"].as_str().unwrap().to_owned())
}

fn numbers(value: &Value) -> [f64; 2] {
    [0usize, 1].map(|i| value[i].as_f64().unwrap())
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
