//! Exit codes, and the one-line form of errors.

use std::fmt;
use std::io;

use sdg_calibration::{CalibrationError, CameraFileError};
use sdg_cell::CellError;
use sdg_evaluation::EvaluationError;
use sdg_grasp::{GraspError, RegionError};
use sdg_inputs::ConfigError;
use sdg_robot::RobotError;

/// The result of a command that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 3: nothing was found, such as no grasp or no camera.
    NothingToGrasp,
    /// Exit code 4: the model was written, but fails on its held-out samples.
    ModelFails,
}

impl Outcome {
    /// The exit code.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::NothingToGrasp => 3,
            Self::ModelFails => 4,
        }
    }
}

/// Arguments that clap accepts but that are invalid: exit code 2, as for other wrong usage.
#[derive(Debug)]
pub struct Usage(pub String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// The error of a command that needs the simulator, in a build without it.
#[cfg(not(feature = "simulation"))]
pub fn without_simulator() -> anyhow::Error {
    let needs = "this sdg was built without the simulator, which demo, rehearse, simulate and evaluate (except for --pictures) \
                 need: expected a build with cargo's feature \"simulation\"";
    Usage(needs.to_owned()).into()
}

/// The error of `sdg ros2` in a build without ROS 2.
#[cfg(not(feature = "ros2"))]
pub fn without_ros2() -> anyhow::Error {
    Usage(
        "ros2: this sdg was built without ROS 2: expected a build with cargo's feature \"ros2\" (docs/ros2.md)"
            .to_owned(),
    )
    .into()
}

/// 2 for wrong usage, 1 for everything else.
pub fn code_of(error: &anyhow::Error) -> u8 {
    if error.is::<Usage>() { 2 } else { 1 }
}

/// Whether the reader of the output closed the pipe, as `head` does. This is not a failure. The connection to an arm can
/// end in the same way, but then the cause is in an error of another type.
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// The error and its causes on one line, followed by the option that corrects it.
pub fn one_line(error: &anyhow::Error) -> String {
    let line = sdg_inputs::one_line(error);
    match error.chain().find_map(remedy) {
        Some(remedy) => format!("{line}; {remedy}"),
        None => line,
    }
}

/// The option or command that corrects a library's error, since libraries know neither.
fn remedy(cause: &(dyn std::error::Error + 'static)) -> Option<String> {
    let of_model = |error: &GraspError| match error {
        GraspError::Region(RegionError::OtherPicture { .. }) => Some(
            "sdg detect --region X,Y,W,H searches another one, and --region all searches the whole picture".to_owned(),
        ),
        GraspError::NoLengths => Some("teach it again with --camera and --mark-height-mm".to_owned()),
        GraspError::BackendNotBuilt { asked, .. } => Some(format!("build sdg-cli with --features {asked}")),
        _ => None,
    };
    let of_camera = |error: &CameraFileError| {
        matches!(error, CameraFileError::NoPose).then(|| "sdg camera table measures it".to_owned())
    };
    if let Some(error) = cause.downcast_ref() {
        return of_model(error);
    }
    if let Some(error) = cause.downcast_ref() {
        return of_camera(error);
    }
    if let Some(error) = cause.downcast_ref() {
        return match error {
            EvaluationError::OtherSettings { .. } => {
                Some("give these settings, or another folder with --out".to_owned())
            }
            EvaluationError::UnitOfOtherSettings { .. } => Some("give another folder with --out".to_owned()),
            EvaluationError::SeveralLabels { .. } => Some("choose one with --label".to_owned()),
            _ => None,
        };
    }
    if let Some(error) = cause.downcast_ref() {
        return match error {
            CalibrationError::OtherCheckerboard { .. } => {
                Some("give its squares with --squares, or show the whole board".to_owned())
            }
            CalibrationError::NoBoardFile => Some("sdg camera board writes one".to_owned()),
            CalibrationError::BoardUnclear { .. } => Some("sdg camera board prints one with dots".to_owned()),
            CalibrationError::OtherBoard { .. } => Some("give its squares with --squares".to_owned()),
            CalibrationError::HandEyeDisagrees { is_other_mount: true, .. } => {
                Some("choose the other one with --mount".to_owned())
            }
            _ => None,
        };
    }
    #[cfg(feature = "annotate")]
    if let Some(sdg_annotate::Error::NoCamera) = cause.downcast_ref() {
        return Some("--from takes pictures with a camera".to_owned());
    }
    if let Some(ConfigError::BothHeads) = cause.downcast_ref() {
        return Some("describe it with --config".to_owned());
    }
    match cause.downcast_ref() {
        Some(CellError::Grasp(error)) => of_model(error),
        Some(CellError::Camera(error)) => of_camera(error),
        Some(CellError::NotOnHand) => Some("sdg camera hand-eye --mount hand measures it".to_owned()),
        Some(CellError::NotInBase) => {
            Some("sdg camera hand-eye --mount base or sdg camera table --sheet-in-base-mm measures it".to_owned())
        }
        _ => match cause.downcast_ref() {
            Some(RobotError::Latched(_)) => Some("sdg robot recover recovers it".to_owned()),
            Some(RobotError::NoRealTime { .. }) => Some("--no-realtime does without".to_owned()),
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_closed_output_is_no_failure() {
        let closed = || io::Error::from(io::ErrorKind::BrokenPipe);
        assert!(is_closed_pipe(&closed().into()));
        assert!(is_closed_pipe(&anyhow::Error::from(closed()).context("standard output")));
        let of_another_stream = sdg_camera::CameraError::Port { port: 0, source: closed() };
        assert!(!is_closed_pipe(&of_another_stream.into()));
    }
}
