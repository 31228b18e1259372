//! One test binary for all files of this folder, because each binary links the whole crate.
#![allow(clippy::unwrap_used)]

mod folder;
mod helps;
mod live;
mod project;
mod refusals;
mod served;
mod session;
mod transport;
