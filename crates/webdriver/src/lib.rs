//! Headless Chromium for tests of this project's pages: input by mouse, keyboard and files, and the visible result.
//!
//! ```text
//! Browser ─ HTTP and JSON (W3C WebDriver) ─ chromedriver ─ chromium --headless
//! ```
//!
//! Both programs are from Debian (packages chromium and chromium-driver); `make test-browser` installs them. A browser
//! has its own profile, which is deleted with it, and sends no network requests by itself.
//!
//! Deliberately absent: other browsers, windows and frames, waiting in the driver ([`Browser::wait_for`] polls the
//! page), and any use outside tests.
//!
//! ```no_run
//! use sdg_webdriver::{Browser, BrowserOptions, serve_folder};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let site = serve_folder("target/web".into())?;
//! let browser = Browser::start(&BrowserOptions::default())?;
//! browser.open(&site.url("index.html"))?;
//! browser.find("#model-file")?.type_text("/tmp/pendulum.sdg")?;
//! browser.wait_for("the model's name", "return document.querySelector('#model-facts dd') !== null")?;
//! assert!(browser.console_errors()?.is_empty());
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod browser;
mod error;
mod http;
mod site;

pub use browser::{Browser, BrowserOptions, Element};
pub use error::{Result, WebDriverError};
pub use site::{Site, serve_folder};
