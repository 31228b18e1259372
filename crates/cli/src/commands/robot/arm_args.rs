//! The arguments that select an arm, shared by all commands of `sdg robot`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use sdg_robot::{FrankaArm, RobotAddress, Scheduling};

use crate::exit::Usage;
use crate::robots::RobotChoice;

/// The arm.
#[derive(Debug, Args)]
pub struct ArmArgs {
    /// HOST or HOST:PORT; default: the address in the workcell file
    #[arg(long, value_name = "ADDRESS")]
    pub robot: Option<RobotChoice>,
    /// The workcell file
    #[arg(long, value_name = "FILE")]
    pub workcell: Option<PathBuf>,
}

impl ArmArgs {
    pub(super) fn address(&self) -> Result<RobotAddress> {
        let of_workcell = match &self.workcell {
            Some(path) => sdg_inputs::read_workcell(path)?.0.address,
            None => None,
        };
        match RobotChoice::named(self.robot.as_ref(), of_workcell.as_deref())? {
            RobotChoice::Network(address) => Ok(address),
            RobotChoice::Sim => Err(Usage(
                "--robot: expected the address of an arm; a simulated one exists only within sdg grasp, or within sdg \
                 simulate --fci, whose address is 127.0.0.1"
                    .to_owned(),
            )
            .into()),
        }
    }

    /// Connects without real-time scheduling: the commands that call this method have no control loop.
    pub(super) fn connect(&self) -> Result<(FrankaArm, RobotAddress)> {
        let address = self.address()?;
        Ok((FrankaArm::connect(&address, Scheduling::Ordinary)?, address))
    }
}
