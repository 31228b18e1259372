//! `sdg devices`: the devices available in this build and on this machine.

use std::io::Write;

use anyhow::{Context, Result};
use clap::Args as ClapArgs;
use sdg_grasp::{ComputeBackend, Device};
use serde_json::json;

use crate::exit::Outcome;
use crate::shared_args::ComputeArgs;

/// `sdg devices`
#[derive(Debug, ClapArgs)]
pub struct DevicesArgs {
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Opens the device of `--device`.
///
/// # Errors
/// The device is not in this build or not on this machine.
pub fn open(args: &ComputeArgs) -> Result<Device> {
    args.device.open().context("--device")
}

/// Prints one line per device, and the reason for each backend without devices.
pub fn run(args: &DevicesArgs) -> Result<Outcome> {
    let mut stdout = std::io::stdout().lock();
    let backends = ComputeBackend::ALL.map(|backend| (backend, backend.devices()));
    if args.json {
        let listed = backends.map(
            |(backend, devices)| json!({"backend": backend.name(), "built": backend.is_built(), "devices": devices}),
        );
        writeln!(stdout, "{}", json!({"default": ComputeBackend::default().name(), "backends": listed}))?;
        return Ok(Outcome::Done);
    }
    for (backend, devices) in backends {
        if !backend.is_built() {
            writeln!(stdout, "{backend:8} not in this build: build sdg-cli with --features {backend}")?;
        } else if devices.is_empty() {
            writeln!(stdout, "{backend:8} no device on this machine")?;
        }
        let default = if backend == ComputeBackend::default() { " (default)" } else { "" };
        for device in devices {
            writeln!(stdout, "{backend:8} {device}{default}")?;
        }
    }
    Ok(Outcome::Done)
}
