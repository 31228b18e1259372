//! The annotation page: mark a grasp on a photo in the browser, see what a model will learn from it, teach, try.
//!
//! ```text
//! pictures ─ Session ─ marks ─┬─ advice (what they suffice for, what is odd)
//!    │          │             ├─ COCO beside the picture
//!    │          │             └─ samples
//!    │          └─ teaching ── GraspTeacher (the caller's) ── detections in other pictures ─ accepted: marks again
//!    └─ Server: 127.0.0.1 only, behind a Guard (token, Host, Origin) ─ routes ─ page/ (HTML, CSS, JavaScript)
//! ```
//!
//! Deliberately absent: grasp models and burn. The caller provides teaching and detection as [`GraspTeacher`] and live
//! pictures as [`LivePictures`] (of a camera: [`CameraPictures`]), so that this crate builds in seconds. No request
//! contains a path: pictures have numbers.
//!
//! ```no_run
//! use std::sync::Arc;
//! use sdg_annotate::{GraspTeacher, Server, Session, SessionOptions};
//!
//! # fn open(teacher: Arc<dyn GraspTeacher>) -> Result<(), sdg_annotate::Error> {
//! let options = SessionOptions { images: vec![("photo.png".into(), None)], ..SessionOptions::default() };
//! let server = Server::bind(Session::open(&options, teacher)?, 0)?;
//! println!("open {}", server.url());
//! server.run(|| false)
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod advice;
mod annotation_file;
mod camera_pictures;
mod desk;
mod error;
mod gripper;
mod guard;
mod http;
mod live;
mod marks;
mod model_versions;
mod names;
mod outline;
mod page;
mod picture;
mod preview;
mod project_file;
mod recent;
mod region;
mod routes;
mod server;
mod session;
mod session_state;
mod teacher;
mod teaching;
mod token_file;
mod views;

pub use advice::{Advice, Fix, ModelAdvice, Remark};
pub use camera_pictures::{CameraPictures, SizeCheck, paced};
pub use desk::{OpenProject, Start};
pub use error::{Error, Result, TeacherError};
pub use gripper::{Gripper, Reach};
pub use guard::new_token;
pub use live::{Live, LiveFault, LiveFaultKind, LiveFrame, LiveOptions, LivePictures};
pub use marks::{GraspMarks, Marks};
pub use project_file::project_of_photo;
pub use recent::{RecentProject, RecentProjects};
pub use region::{Region, Searched};
pub use sdg_demonstration::ModelKind;
pub use server::Server;
pub use session::{Session, SessionOptions};
pub use teacher::{
    Figures, FoundGrasp, GraspPose, GraspTeacher, NegativesRefused, Refusal, TaughtModel, TaughtSummary, TeachRequest,
    TeachingMaterial, TeachingStep,
};
pub use teaching::{News, Status};
pub use token_file::token_of_file;
pub use views::{ComparedPicture, ImageView, ModelView, OtherView, Saved, SessionView, TrialPictureView, VersionFound};
