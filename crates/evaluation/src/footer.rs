//! What all pages end with.

/// The end of every page.
pub const FOOTER: &str = "Made by sdg. This page is one file: it fetches nothing and runs no script.";
