//! Headless Chromium for the tests of our pages: what a person does with mouse, keyboard and files, and what they see.
//!
//! ```text
//! Browser ─ HTTP and JSON (W3C WebDriver) ─ chromedriver ─ chromium --headless
//! ```
//!
//! Both programs are Debian's (packages chromium and chromium-driver); `make test-browser` installs them. A browser has
//! a profile of its own, which goes with it, and sends no request to the network by itself.
//!
//! Left out on purpose: other browsers, windows and frames, waiting in the driver ([`Browser::wait_for`] asks the page),
//! and any use outside tests.
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
