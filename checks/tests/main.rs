//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod documents;
mod import_cycles;
mod site;
