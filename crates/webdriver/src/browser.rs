//! A browser with its page, and user input.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::Engine;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::error::{Result, WebDriverError};
use crate::http;

const DRIVER: &str = "chromedriver";
/// The specification's key of a reference to an element.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";
/// Flags that prevent Chromium from prompting, and allow it to run as root in a container.
const QUIET: [&str; 9] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
];

/// Options for starting a browser.
#[derive(Debug, Clone)]
pub struct BrowserOptions {
    /// Width and height of the window, in CSS pixels.
    pub window_px: [u32; 2],
    /// Additional flags of Chromium.
    pub flags: Vec<String>,
    /// Timeout of [`Browser::wait_for`].
    pub patience: Duration,
}

impl Default for BrowserOptions {
    fn default() -> Self {
        Self { window_px: [1280, 800], flags: Vec::new(), patience: Duration::from_secs(30) }
    }
}

/// A headless Chromium with its own profile; it is closed when dropped.
#[derive(Debug)]
pub struct Browser {
    driver: Child,
    address: SocketAddr,
    session: String,
    patience: Duration,
    profile: TempDir,
}

/// An element of the page.
#[derive(Debug)]
pub struct Element<'a> {
    browser: &'a Browser,
    id: String,
}

impl Browser {
    /// Starts ChromeDriver and a browser with an empty profile.
    ///
    /// # Errors
    /// One of the programs is missing or does not start.
    pub fn start(options: &BrowserOptions) -> Result<Self> {
        let address = free_address().map_err(WebDriverError::io("a free port"))?;
        let profile = tempfile::tempdir().map_err(WebDriverError::io("a folder for the browser's profile"))?;
        let driver = Command::new(DRIVER)
            .arg(format!("--port={}", address.port()))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|source| WebDriverError::NoDriver { program: DRIVER, source })?;
        let session = String::new();
        let mut browser = Self { driver, address, session, patience: options.patience, profile };
        browser.await_driver()?;
        browser.session = browser.new_session(options)?;
        Ok(browser)
    }

    fn await_driver(&mut self) -> Result<()> {
        let deadline = Instant::now() + Duration::from_secs(30);
        while let Err(source) = TcpStream::connect(self.address) {
            if Instant::now() > deadline {
                return Err(WebDriverError::NoDriver { program: DRIVER, source });
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    fn new_session(&self, options: &BrowserOptions) -> Result<String> {
        let [width, height] = options.window_px;
        let mut flags: Vec<String> = QUIET.map(str::to_owned).to_vec();
        flags.push(format!("--user-data-dir={}", self.profile.path().display()));
        flags.push(format!("--window-size={width},{height}"));
        flags.extend(options.flags.iter().cloned());
        let wanted = json!({"capabilities": {"alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": {"args": flags},
            "goog:loggingPrefs": {"browser": "ALL"},
            "timeouts": {"script": 300_000},
        }}});
        let session = self.send("POST", "/session", Some(&wanted))?;
        text(&session["sessionId"], "/session")
    }

    /// Opens an address and waits for the page's `load` event.
    ///
    /// # Errors
    /// The address cannot be opened.
    pub fn open(&self, url: &str) -> Result<()> {
        self.post("/url", &json!({"url": url})).map(drop)
    }

    /// Runs a script in the page: the body of a function with `arguments`, which may return a promise.
    ///
    /// # Errors
    /// The script threw.
    pub fn run(&self, script: &str, arguments: &[Value]) -> Result<Value> {
        self.post("/execute/sync", &json!({"script": script, "args": arguments}))
    }

    /// Repeats a script until its result is truthy, and returns the result.
    ///
    /// # Errors
    /// The script threw, or the timeout passed; the error after a timeout quotes the page's text.
    pub fn wait_for(&self, what: &str, script: &str) -> Result<Value> {
        let begun = Instant::now();
        while begun.elapsed() < self.patience {
            let found = self.run(script, &[])?;
            if !matches!(&found, Value::Null | Value::Bool(false)) && found != json!(0) && found != json!("") {
                return Ok(found);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let page = self.run("return document.body.innerText.slice(0, 600)", &[])?;
        let page = page.as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
        Err(WebDriverError::Timeout { what: what.to_owned(), seconds: self.patience.as_secs_f32(), page })
    }

    /// The first element that matches a CSS selector.
    ///
    /// # Errors
    /// No element matches.
    pub fn find(&self, selector: &str) -> Result<Element<'_>> {
        let found = self.post("/element", &json!({"using": "css selector", "value": selector}))?;
        Ok(Element { browser: self, id: text(&found[ELEMENT], "/element")? })
    }

    /// Performs input as in the specification's `actions`: sequences of pointer, key and wheel input.
    ///
    /// # Errors
    /// The sequence is invalid.
    pub fn perform(&self, sequences: &Value) -> Result<()> {
        self.post("/actions", &json!({"actions": sequences})).map(drop)
    }

    /// Presses the left mouse button at the first of these positions in the viewport, moves through the others, and
    /// releases it at the last.
    ///
    /// # Errors
    /// A position is outside the viewport.
    pub fn drag(&self, places: &[[f64; 2]]) -> Result<()> {
        let to = |[x, y]: &[f64; 2]| json!({"type": "pointerMove", "duration": 20, "x": x.round(), "y": y.round()});
        let mut actions: Vec<Value> = places.iter().map(to).collect();
        actions.insert(1.min(actions.len()), json!({"type": "pointerDown", "button": 0}));
        actions.push(json!({"type": "pointerUp", "button": 0}));
        let mouse =
            json!({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions});
        self.perform(&json!([mouse]))
    }

    /// Presses keys in order and holds all until the last one is pressed: `["\u{e009}", "z"]` is Control and z. Keys
    /// without a character have code points of WebDriver: U+E007 Enter, U+E00C Escape, U+E009 Control, U+E008 Shift.
    ///
    /// # Errors
    /// A key is invalid.
    pub fn press(&self, keys: &[&str]) -> Result<()> {
        let down = keys.iter().map(|key| json!({"type": "keyDown", "value": key}));
        let up = keys.iter().rev().map(|key| json!({"type": "keyUp", "value": key}));
        let actions: Vec<Value> = down.chain(up).collect();
        self.perform(&json!([{"type": "key", "id": "keyboard", "actions": actions}]))
    }

    /// Sets the window's size, in CSS pixels.
    ///
    /// # Errors
    /// The browser rejects the size.
    pub fn resize(&self, width: u32, height: u32) -> Result<()> {
        self.post("/window/rect", &json!({"width": width, "height": height})).map(drop)
    }

    /// Shows the page as on a screen of this size, however small, in the dark or the light scheme.
    ///
    /// # Errors
    /// The browser rejects the settings.
    pub fn emulate(&self, width: u32, height: u32, dark: bool) -> Result<()> {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.devtools("Emulation.setDeviceMetricsOverride", &size)?;
        let scheme = if dark { "dark" } else { "light" };
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.devtools("Emulation.setEmulatedMedia", &features)
    }

    /// A command of Chromium's DevTools protocol, for features that WebDriver lacks.
    fn devtools(&self, command: &str, parameters: &Value) -> Result<()> {
        self.post("/goog/cdp/execute", &json!({"cmd": command, "params": parameters})).map(drop)
    }

    /// Writes a screenshot to a PNG file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn screenshot(&self, path: &Path) -> Result<()> {
        let coded = text(&self.send("GET", &self.path("/screenshot"), None)?, "/screenshot")?;
        let png = base64::engine::general_purpose::STANDARD.decode(&coded).map_err(|error| {
            WebDriverError::Unexpected { command: "/screenshot".into(), expected: "base64", found: error.to_string() }
        })?;
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(WebDriverError::io(folder.display().to_string()))?;
        }
        std::fs::write(path, png).map_err(WebDriverError::io(path.display().to_string()))
    }

    /// New warnings and errors of the console, including network errors.
    ///
    /// # Errors
    /// The browser has no log.
    pub fn console_errors(&self) -> Result<Vec<String>> {
        let entries = self.post("/se/log", &json!({"type": "browser"}))?;
        let entries = entries.as_array().cloned().unwrap_or_default();
        let bad = entries.iter().filter(|entry| matches!(entry["level"].as_str(), Some("SEVERE" | "WARNING")));
        Ok(bad.map(|entry| entry["message"].as_str().unwrap_or_default().to_owned()).collect())
    }

    fn path(&self, command: &str) -> String {
        format!("/session/{}{command}", self.session)
    }

    fn post(&self, command: &str, body: &Value) -> Result<Value> {
        self.send("POST", &self.path(command), Some(body))
    }

    fn send(&self, method: &str, path: &str, body: Option<&Value>) -> Result<Value> {
        let body = body.map(Value::to_string);
        let (status, answer) =
            http::request(self.address, method, path, body.as_deref()).map_err(WebDriverError::io(path))?;
        let mut answer: Value = serde_json::from_str(&answer).map_err(|_| WebDriverError::Unexpected {
            command: path.to_owned(),
            expected: "JSON",
            found: answer.chars().take(80).collect(),
        })?;
        let value = answer["value"].take();
        if status == 200 {
            return Ok(value);
        }
        let message = |key: &str| value[key].as_str().unwrap_or_default().lines().next().unwrap_or_default().to_owned();
        Err(WebDriverError::Refused { command: path.to_owned(), error: message("error"), message: message("message") })
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The driver closes its browser with the session, and is then killed.
        let _ = self.send("DELETE", &self.path(""), None);
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

impl Element<'_> {
    /// Clicks in the middle of the element.
    ///
    /// # Errors
    /// The element is not visible, or is covered.
    pub fn click(&self) -> Result<()> {
        self.post("click", &json!({})).map(drop)
    }

    /// Types text into the element; for a file input, one path per line.
    ///
    /// # Errors
    /// The element accepts no keys, or a file does not exist.
    pub fn type_text(&self, text: &str) -> Result<()> {
        self.post("value", &json!({"text": text})).map(drop)
    }

    fn post(&self, command: &str, body: &Value) -> Result<Value> {
        self.browser.post(&format!("/element/{}/{command}", self.id), body)
    }
}

/// An address with a port that was free a moment ago.
fn free_address() -> io::Result<SocketAddr> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()
}

fn text(value: &Value, command: &str) -> Result<String> {
    value.as_str().map(str::to_owned).ok_or_else(|| WebDriverError::Unexpected {
        command: command.to_owned(),
        expected: "a text",
        found: value.to_string(),
    })
}
