//! Arms for commands: selection, simulated scenes, dry runs, confirmation, and records after an error.

mod confirm;
mod dry_run;
#[cfg(feature = "simulation")]
mod simulated_scene;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::Result;
use sdg_robot::{Pace, RobotAddress, Scheduling, StopReason, Watch};

use crate::exit::Usage;
use crate::interrupt::Interrupt;
use crate::paint::{Paint, Tone};

pub(crate) use confirm::{Consent, confirm};
#[cfg(not(feature = "simulation"))]
pub(crate) use dry_run::draw_dry_run;
pub(crate) use dry_run::print_plan;
#[cfg(feature = "simulation")]
pub(crate) use sdg_evaluation::draw_dry_run;
#[cfg(feature = "simulation")]
pub(crate) use simulated_scene::{check_simulated, simulated_scene};

/// `--robot`: an address, or the simulated arm in this program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RobotChoice {
    /// An arm in MuJoCo that exists as long as the command runs.
    Sim,
    /// A Franka on the network.
    Network(RobotAddress),
}

impl FromStr for RobotChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "sim" => Ok(Self::Sim),
            address => Ok(Self::Network(address.parse()?)),
        }
    }
}

impl RobotChoice {
    /// The arm given on the command line, or else in the workcell file.
    ///
    /// # Errors
    /// [`Usage`] if neither names one.
    pub(crate) fn named(option: Option<&Self>, of_workcell: Option<&str>) -> Result<Self> {
        match (option, of_workcell) {
            (Some(choice), _) => Ok(choice.clone()),
            (None, Some(address)) => Ok(Self::Network(address.parse().map_err(Usage)?)),
            (None, None) => {
                Err(Usage("expected --robot ADDRESS, or a workcell file with address under [robot]".to_owned()).into())
            }
        }
    }
}

/// The camera file given on the command line, or else in the workcell file at `workcell`.
///
/// # Errors
/// [`Usage`] if neither names one.
pub(crate) fn camera_file(
    option: Option<&Path>,
    of_workcell: Option<PathBuf>,
    workcell: &Path,
) -> Result<PathBuf, Usage> {
    option
        .map(Path::to_path_buf)
        .or(of_workcell)
        .ok_or_else(|| Usage(format!("expected --camera FILE, or a file under [camera] in {}", workcell.display())))
}

/// Scheduling of the control loop of a real arm.
pub(crate) fn scheduling(no_realtime: bool) -> Scheduling {
    if no_realtime { Scheduling::Ordinary } else { Scheduling::RealTime }
}

/// The pace from `--speed`.
///
/// # Errors
/// [`Usage`] for a value out of range.
pub(crate) fn pace(speed: f64) -> Result<Pace> {
    Pace::at_speed(speed).map_err(|error| Usage(format!("--{error}")).into())
}

/// Creates a watch that stops the arm on Ctrl-C.
pub(crate) fn watch(interrupt: &Interrupt) -> Watch {
    let interrupt = interrupt.clone();
    Watch::new(Box::new(move || interrupt.is_requested().then_some(StopReason::Interrupted)))
}

/// Checks, before anything moves, that [`write_states`] can write its file.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn check_states(path: &Path) -> Result<()> {
    Ok(sdg_files::check_replaceable(path, None, b"time_secs")?)
}

/// Writes the arm's last second of states after an error and prints the file's path. Does nothing if no state was
/// received. A file that cannot be written is a warning, which does not replace the arm's error.
pub(crate) fn write_states(path: &Path, watch: &Watch) {
    if watch.states().len() == 0 {
        return;
    }
    match sdg_files::write(path, watch.states_csv().as_bytes()) {
        Ok(()) => eprintln!("the arm's last second: {}", path.display()),
        Err(error) => eprintln!("{} {error}", Paint::stderr().text(Tone::Doubtful, "warning:")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_simulated_or_on_the_network() {
        assert_eq!("sim".parse(), Ok(RobotChoice::Sim));
        let named = RobotChoice::named(None, Some("172.16.0.2")).unwrap();
        assert_eq!(named, "172.16.0.2".parse().unwrap());
        let error = RobotChoice::named(None, None).unwrap_err();
        assert!(error.is::<Usage>() && error.to_string().contains("--robot ADDRESS"), "{error}");
        assert!("tcp://x".parse::<RobotChoice>().is_err());
    }
}
