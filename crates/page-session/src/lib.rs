//! A session of the annotation page with grasp models, for programs that serve the page: `annotate` depends on no grasp
//! model and opens no camera.
//!
//! ```text
//! photos, project, pictures to try ─ open_session: checked and locked ─ Session ─ sdg_annotate::Server
//! PageTeacher ─ teaches for the page, in the plan view of a calibrated camera ─ TaughtModel: detections with reasons
//! camera ─ PageTeacher::live ─ LiveOptions: frames of another size than the calibrated one are a fault
//! ```
//!
//! Not in this crate: the page and its server (crate `annotate`), command arguments, and opening a camera.
//!
//! ```no_run
//! use sdg_annotate::{Server, SessionOptions};
//! use sdg_grasp::Preset;
//! use sdg_page_session::{PageTeacher, open_session};
//!
//! # fn main() -> anyhow::Result<()> {
//! let teacher = PageTeacher { preset: Preset::default(), camera: None };
//! let options = SessionOptions { images: vec![("part.png".into(), None)], ..SessionOptions::default() };
//! let session = open_session(&teacher, options, None, || Ok(None), &mut |left_out| eprintln!("{left_out}"))?;
//! let server = Server::bind(session, 0)?;
//! println!("{}", server.url());
//! server.run(|| false)?;
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod model;
mod opening;
mod region;
mod teacher;

pub use opening::{open_chosen, open_session};
pub use teacher::PageTeacher;
