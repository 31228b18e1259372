//! The paper's figures.

use sdg_grasp::ModelKind;

/// A row of the paper's Table II, completed from its text.
pub struct PaperRow {
    pub samples: &'static str,
    /// From samples to model, on a GTX 1080 Ti, minutes and seconds.
    pub teaching: &'static str,
    /// Size of the weights' files, in megabytes.
    pub size: &'static str,
    /// Images per second, on a GTX 1080 Ti.
    pub frames_per_second: &'static str,
    /// Share of successful attempts, of 80 in simulation.
    pub success_percent: f64,
}

/// Speed of model C on a CPU, as reported for its implementation in OpenDR, in images per second.
pub const CPU_FRAMES_PER_SECOND: f64 = 0.4;

/// The row of a model; `None` for a model that is not in the paper.
///
/// # Source
/// Table II; success with a decimal from section VI. For A, samples, times and sizes of both networks.
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
