//! Reports of runs: pictures with marks, curves, tables and animations on one self-contained page.
//!
//! ```text
//! RgbImage ─ draw_demonstration, draw_detections ─ Figure ─┐
//! frames   ─ AnimationRecorder ─ Animation ────── Figure ──┤
//! numbers  ─ Chart, Matrix, ShareChart, Table, KeyFigure ──┼─ Section ─ Report ─ DIR/index.html
//! ```
//!
//! The page is one file that loads no other files and runs no script: pictures are embedded as base64, charts as inline
//! SVG. It follows the reader's light or dark theme, adapts to a phone's width, and can be printed.
//!
//! Not in this crate: grasp models, simulation and burn. The types are plain data, so that any crate can
//! use them.
//!
//! ```
//! use image::RgbImage;
//! use sdg_report::{Axis, Chart, Figure, KeyFigure, Report, Section, Series, Tone};
//!
//! # fn main() -> Result<(), sdg_report::ReportError> {
//! # let folder = std::env::temp_dir().join(format!("sdg-report-example-{}", std::process::id()));
//! let loss = Chart::new("Training loss", Axis::new("step"), Axis::new("loss").logarithmic())
//!     .series(Series::new("total", vec![(0.0, 4.2), (100.0, 0.9), (200.0, 0.4)]).noisy());
//! let path = Report::new("Pendulum, taught from one photo")
//!     .key_figure(KeyFigure::new("142", "s", "to teach"))
//!     .key_figure(KeyFigure::new("10", "of 10", "grasped").tone(Tone::Good))
//!     .section(Section::new("Demonstration").figure(Figure::photo(RgbImage::new(64, 48)).caption("As photographed.")))
//!     .section(Section::new("Teaching").charts(vec![loss]))
//!     .write(&folder)?;
//! assert!(path.ends_with("index.html"));
//! # std::fs::remove_dir_all(&folder).ok();
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod animation;
mod attempts;
mod chart;
mod draw;
mod error;
mod figure;
mod html;
#[cfg(test)]
mod html_checker;
mod page;
mod section;
mod table;

pub use animation::{Animation, AnimationOptions, AnimationRecorder};
pub use attempts::{AttemptSummary, DetectionError, attempts_table, outcome_matrix};
pub use chart::{Axis, Chart, Matrix, Scale, Series, ShareChart};
pub use draw::{
    Color, DetectionMark, Pen, Verdict, contact_sheet, draw_box, draw_demonstration, draw_detections, draw_grasp_jaws,
    draw_keypoints, draw_label, draw_line, draw_polygon, label_bounds, line_width, shade_polygon,
};
pub use error::ReportError;
pub use figure::Figure;
pub use html::{escape, format_number};
pub use page::{KeyFigure, Report};
pub use section::{GallerySize, Section};
pub use table::{Cell, Column, Table, Tone};
