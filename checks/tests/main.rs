//! One test binary for all files of this folder, because each binary links the whole crate.
#![allow(clippy::unwrap_used)]

mod documents;
mod import_cycles;
mod scripts;
mod site;
mod tables;
