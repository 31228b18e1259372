//! The height of a part, measured from two pictures of a camera that moved sideways between them.
//!
//! ```text
//! Sighting, Sighting ─ triangulate ─ MeasuredHeight ─┐
//! --mark-height-mm ─ GivenHeight ─────────────────────┴─ settle ─ the more certain of both; an error if they contradict each other
//! ```
//! **Frames.** Unless stated otherwise, a height is z of the plane of the marks in the robot's base frame. A picture
//! shows a part in an assumed plane; for another plane, position, size and jaw width of the part scale about the point
//! vertically below the camera.
//!
//! `sequence/measure.rs` moves the camera and takes the pictures.

mod settle;
mod sighting;
mod triangulation;

pub use settle::{GivenHeight, HeightSource, SettledHeight, settle};
pub use sighting::Sighting;
pub use triangulation::{HeightError, MIN_BASELINE_M, MeasuredHeight, RELIEF_M, triangulate, triangulate_nearest};

/// How the height of a part is measured before the approach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightMeasurement {
    /// Height of the camera above the table for both pictures, m.
    pub camera_height_m: f64,
    /// Sideways distance of the camera between the two pictures, m.
    pub baseline_m: f64,
    /// Height of the marks above the surface under the part, m.
    pub mark_height_m: f64,
    /// Height of the grasp above the surface under the part, m.
    pub grasp_height_m: f64,
    /// Standard deviation of the height of the visible edges above the marks, m.
    pub relief_m: f64,
    /// The given height of the marks, z of the base frame.
    pub told: Option<GivenHeight>,
}

impl HeightMeasurement {
    /// Largest height of the camera above the table for both pictures, m.
    pub const MAX_CAMERA_HEIGHT_M: f64 = 0.30;

    /// A measurement with two pictures from 0.3 m above the table, 0.12 m apart. `mark_height_m` and `grasp_height_m`
    /// are above the surface under the part.
    pub fn new(mark_height_m: f64, grasp_height_m: f64) -> Self {
        Self {
            camera_height_m: Self::MAX_CAMERA_HEIGHT_M,
            baseline_m: 0.12,
            mark_height_m,
            grasp_height_m,
            relief_m: RELIEF_M,
            told: None,
        }
    }

    /// Combines the height of the marks from the lines of sight to the part with the height from the surface beside it.
    /// If they contradict each other, the height from the part is used.
    pub fn combined(&self, by_part: &MeasuredHeight, surface: &MeasuredHeight) -> MeasuredHeight {
        let on_surface = MeasuredHeight { height_m: surface.height_m + self.mark_height_m, ..*surface };
        on_surface.mean(by_part).unwrap_or(*by_part)
    }

    /// Distance of the grasp below the marks, m.
    pub fn marks_over_grasp_m(&self) -> f64 {
        self.mark_height_m - self.grasp_height_m
    }
}

/// The result of a height measurement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeightReport {
    /// The height that the grasp uses.
    pub settled: Option<SettledHeight>,
    /// The measured height: from the lines of sight to the part, and from the surface beside it if that was measured.
    pub measured: Option<MeasuredHeight>,
    /// The height from the lines of sight alone.
    pub by_part: Option<MeasuredHeight>,
    /// The reason why nothing was triangulated.
    pub why_not: Option<String>,
    /// The part in the pictures, in the order of the pictures.
    pub sightings: Vec<Sighting>,
}

impl HeightReport {
    /// Whether the grasp uses the measured height.
    pub(crate) fn is_measured(&self) -> bool {
        self.settled.is_some_and(|settled| settled.source == HeightSource::Measured)
    }
}
