//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod folder;
mod helps;
mod live;
mod project;
mod refusals;
mod served;
mod session;
mod transport;
