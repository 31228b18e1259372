//! Errors of the simulation.

use std::path::PathBuf;

use sdg_robot::RobotError;

/// An error of the simulation; a failed grasp is not one (see `sdg_robot::GraspOutcome`).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum SimulationError {
    /// libmujoco is missing, or its version differs from that of the bindings.
    #[error(transparent)]
    Library(#[from] sdg_mujoco_sys::LibraryError),

    /// MuJoCo rejected an MJCF model.
    #[error("MuJoCo could not load the model: {message}")]
    Model {
        /// MuJoCo's own message, with the line of the XML if it gives one.
        message: String,
    },

    /// A file of the model could not be passed to MuJoCo.
    #[error("asset {name:?} of the model: {reason}")]
    Asset {
        /// File name in the MJCF.
        name: String,
        /// The error.
        reason: String,
    },

    /// MuJoCo stopped during a computation.
    #[error("MuJoCo stopped in {call}: {message}")]
    MuJoCo {
        /// The function that was called.
        call: &'static str,
        message: String,
    },

    /// The simulation diverged (positions, velocities or accelerations are infinite, NaN or huge).
    #[error("the simulation became unstable at {time_secs:.3} s of simulated time: {message}")]
    Unstable {
        /// Simulated time before the failed step, in seconds.
        time_secs: f64,
        message: String,
    },

    /// MuJoCo's list of contacts or of constraints is full.
    #[error("too many contacts for this part or scene, at {time_secs:.3} s of simulated time")]
    TooManyContacts {
        /// Simulated time before the failed step, in seconds.
        time_secs: f64,
    },

    /// A name that does not exist among those of its kind.
    #[error("unknown {kind} {name:?}; known: {}", existing.join(", "))]
    UnknownName {
        /// The kind: an object of the model such as a body or a joint, a part, an axis, or an option.
        kind: &'static str,
        /// The requested name.
        name: String,
        existing: Vec<String>,
    },

    /// Rendering by OpenGL without a display failed.
    #[error("offscreen OpenGL through EGL failed: {reason}. On Debian 12: `apt-get install libegl1 libgl1-mesa-dri`")]
    Rendering {
        /// The step that failed and the message of EGL or MuJoCo.
        reason: String,
    },

    /// A file of a part could not be read or written, or has invalid content.
    #[error("{}: {reason}", path.display())]
    File {
        path: PathBuf,
        /// The error.
        reason: String,
    },

    /// A value of a configuration is invalid.
    #[error("{field}: expected {expected}, found {found}")]
    Configuration {
        /// Name of the configuration's field.
        field: &'static str,
        /// The allowed values.
        expected: String,
        /// The given value.
        found: String,
    },

    /// Perception itself failed; a picture without the part is not such an error.
    #[error("perception failed: {0}")]
    Perception(String),

    /// Another error of the arm or its hand, such as a stopped arm.
    #[error("{0}")]
    Robot(String),
}

impl From<RobotError> for SimulationError {
    fn from(error: RobotError) -> Self {
        match error {
            RobotError::Perception(why) => Self::Perception(why),
            RobotError::Device(device) => match device.downcast::<Self>() {
                Ok(own) => *own,
                Err(other) => Self::Robot(other.to_string()),
            },
            other => Self::Robot(other.to_string()),
        }
    }
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, SimulationError>;
