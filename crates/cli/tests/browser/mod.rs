//! The annotation page in headless Chromium, used as a new user would: from a photo to a taught model and back.
//!
//! Needs Chromium, and axe-core from npm in target/browser-test: `make test-browser` installs both. Screenshots are
//! kept in target/browser-test.

mod calibrating;
mod clicks;
mod corrections;
mod drawn;
mod film;
mod keyboard;
mod live;
mod other_pages;
pub(crate) mod page;
mod photo_to_grasp;
mod project;
mod projects;
mod region;
mod small_screen;
mod tried;
mod versions;
mod zooming;
