//! The results of the paper *SingleDemoGrasp*, whose models this project implements.

use sdg_grasp::ModelKind;

/// A row of the paper's Table II, completed from the paper's text.
pub struct PaperRow {
    pub samples: &'static str,
    /// Time from samples to model on a GTX 1080 Ti, in minutes and seconds.
    pub teaching: &'static str,
    /// Size of the files of weights, in megabytes.
    pub size: &'static str,
    /// Images per second, on a GTX 1080 Ti.
    pub frames_per_second: &'static str,
    /// Percentage of successful attempts, of 80 in simulation.
    pub success_percent: f64,
}

/// Speed of model C on a CPU, in images per second, as reported for its implementation in OpenDR.
pub const CPU_FRAMES_PER_SECOND: f64 = 0.4;

/// The row of a model; `None` for a model that is not in the paper.
///
/// # Source
/// Table II; the success is from section VI, with one decimal. For A: samples, times and sizes of both networks.
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
