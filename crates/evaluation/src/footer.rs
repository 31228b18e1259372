//! The footer of the pages.

/// The footer of every page.
pub const FOOTER: &str = "Made by sdg. This page is one file: it fetches nothing and runs no script.";
