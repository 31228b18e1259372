//! `sdg simulate --fci`: a simulated Panda in MuJoCo on the network, for any client of the Franka Control Interface.

use std::io::Write;
use std::net::IpAddr;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args as ClapArgs;
use sdg_fci::server::{Pace, Server, ServerConfig, ServerStatistics};
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{PandaPlant, WorkcellConfig};
use serde_json::json;

use crate::exit::Outcome;
use crate::interrupt::Interrupt;
use crate::parts::part_named;

/// Interval between checks of Ctrl-C and of the server.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// `sdg simulate`
#[derive(Debug, ClapArgs)]
pub struct SimulateArgs {
    /// Serve the Franka Control Interface (of the Panda, libfranka 0.9): robot on TCP port 1337, hand on 1338, states
    /// over UDP
    #[arg(long, required = true)]
    pub fci: bool,
    /// Wait for the client's answer in every millisecond of a motion: no packet is lost, and the result does not depend
    /// on the machine's speed
    #[arg(long)]
    pub lockstep: bool,
    /// A part on the table: one of the parts in datasets/
    #[arg(long, value_name = "NAME")]
    pub object: Option<String>,
    /// Seed of the part's pose
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Address to listen on; any program that reaches it can move the simulated robot
    #[arg(long, default_value = "127.0.0.1", value_name = "IP")]
    pub address: IpAddr,
    /// TCP port of the robot; the hand's is the next one
    #[arg(long, default_value_t = sdg_fci::wire::ROBOT_PORT, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=65534))]
    pub port: u16,
    /// Print the addresses and, at the end, the counters as JSON objects, one per line
    #[arg(long)]
    pub json: bool,
}

/// Serves until Ctrl-C.
pub fn run(args: &SimulateArgs) -> Result<Outcome> {
    let object = args.object.as_deref().map(|name| part_named("--object", name)).transpose()?;
    let variation = VariationConfig { appearance: false, distractors: 0..=0, ..VariationConfig::default() };
    let scene = SceneVariation::sample(object.as_ref(), &variation, args.seed);
    let plant = PandaPlant::new(&WorkcellConfig::new(scene))?;
    let config = ServerConfig {
        ip: args.address,
        robot_port: args.port,
        hand_port: args.port + 1,
        pace: if args.lockstep { Pace::LOCKSTEP } else { Pace::RealTime },
        ..ServerConfig::default()
    };
    let server = Server::start(plant, &config).context("sdg simulate")?;
    let (robot, hand) = (server.robot_address(), server.hand_address());
    // A program may send Ctrl-C as soon as it has read the addresses.
    let interrupt = Interrupt::watch();
    let mut stdout = std::io::stdout();
    if args.json {
        writeln!(stdout, "{}", json!({ "robot": robot, "hand": hand, "lockstep": args.lockstep }))?;
    } else {
        writeln!(stdout, "a simulated Panda: robot on {robot}, hand on {hand}; Ctrl-C ends it")?;
    }
    while !interrupt.is_requested() && server.is_running() {
        thread::sleep(POLL_INTERVAL);
    }
    let statistics = server.statistics();
    server.stop()?;
    report(&statistics, args.json, &mut stdout)?;
    Ok(Outcome::Done)
}

fn report(statistics: &ServerStatistics, as_json: bool, stdout: &mut impl Write) -> std::io::Result<()> {
    let ServerStatistics { num_motions, num_motion_cycles, num_commands, num_late, num_invalid, num_stalls, .. } =
        *statistics;
    let latest_ms = statistics.max_lateness.as_secs_f64() * 1e3;
    if as_json {
        let counted = json!({
            "motions": num_motions, "motion_cycles": num_motion_cycles, "commands_in_their_cycle": num_commands,
            "commands_late": num_late, "datagrams_invalid": num_invalid, "stalls_over_20_ms": num_stalls,
            "latest_cycle_ms": latest_ms,
        });
        return writeln!(stdout, "{counted}");
    }
    writeln!(
        stdout,
        "{num_motions} motions; {num_commands} of {num_motion_cycles} cycles answered in time, {num_late} commands late; \
         {num_stalls} stalls over 20 ms, the longest {latest_ms:.1} ms"
    )
}
