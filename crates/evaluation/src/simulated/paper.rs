//! The paper's figures.

use sdg_grasp::ModelKind;

/// A row of the paper's Table II, and of its text where the table leaves it out.
pub struct PaperRow {
    pub samples: &'static str,
    /// From samples to model, on a GTX 1080 Ti, minutes and seconds.
    pub teaching: &'static str,
    /// Files of weights, in megabytes.
    pub size: &'static str,
    /// Images a second, on a GTX 1080 Ti.
    pub frames_per_second: &'static str,
    /// Attempts that succeeded, of 80 in simulation.
    pub success_percent: f64,
}

/// Speed of model C on a CPU, as its implementation in OpenDR reports it, in images a second.
pub const CPU_FRAMES_PER_SECOND: f64 = 0.4;

/// The row of a model; `None` for one that the paper does not have.
///
/// # Source
/// Table II; success with a decimal as its section VI gives it. For A both networks' samples, times and sizes.
pub fn row(model: ModelKind) -> Option<PaperRow> {
    Some(match model {
        ModelKind::A => PaperRow {
            samples: "1500 + 5000",
            teaching: "14:00 + 2:00",
            size: "300 + 8",
            frames_per_second: "–",
            success_percent: 91.3,
        },
        ModelKind::B => {
            PaperRow { samples: "1500", teaching: "7:30", size: "450", frames_per_second: "20", success_percent: 82.5 }
        }
        ModelKind::C => {
            PaperRow { samples: "1500", teaching: "7:00", size: "450", frames_per_second: "20", success_percent: 93.5 }
        }
        ModelKind::D => {
            PaperRow { samples: "1500", teaching: "6:30", size: "330", frames_per_second: "–", success_percent: 78.0 }
        }
        ModelKind::S => return None,
    })
}
