//! Compares whole grasps over TCP and UDP with the same attempts in one process, part by part.
//!
//! `cargo run --release -p sdg-simulation --example network_grasps [lockstep|realtime] [ATTEMPTS] [PART]…`
//!
//! In lockstep, ends with an error if an attempt holds the part over the network but not in one process, or the other
//! way round. In real time, ends with an error if fewer parts are held over the network than in one process, by more
//! than 5 per 240 attempts.

use sdg_fci::server::Pace;
use sdg_robot::{GraspConfig, GraspOutcome, Robot, Watch, grasp};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{AttemptConfig, RenderConfig, Workcell, WorkcellConfig};

#[path = "../tests/network/mod.rs"]
mod network;

fn cell(spec: &ObjectSpec, seed: u64) -> sdg_simulation::Result<Workcell> {
    let config = VariationConfig { appearance: false, ..VariationConfig::default() };
    let scene = SceneVariation::sample(Some(spec), &config, seed);
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    let mut cell = Workcell::new(&WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) })?;
    cell.reset_for_attempt(&GraspConfig::default(), seed)?;
    Ok(cell)
}

/// Runs an attempt over the network. Returns whether the hand's verdict is that the part is held, whether the part is
/// held in the simulation, and the reason for a failure.
fn over_network(cell: Workcell, pace: Pace) -> Result<(bool, bool, String), Box<dyn std::error::Error>> {
    let (server, positions) = network::serve(&cell, pace);
    let mount = cell.wrist_camera();
    let mut twin = network::Twin { cell, positions };
    let mut arm = network::connect(&server)?;
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let report = grasp(&mut robot, &mut twin, &mut (), mount, &GraspConfig::default());
    let (verdict, why) = match report {
        Ok(report) => match report.outcome {
            GraspOutcome::Held => (true, String::new()),
            GraspOutcome::Failed { step, why } => (false, format!("{step}: {why}")),
        },
        Err(error) => (false, error.to_string()),
    };
    drop(arm);
    let is_lifted = twin.is_lifted();
    server.stop()?;
    Ok((verdict, is_lifted, why))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let pace = match arguments.next().as_deref() {
        Some("realtime") => Pace::RealTime,
        None | Some("lockstep") => Pace::LOCKSTEP,
        Some(other) => return Err(format!("expected lockstep or realtime, found {other}").into()),
    };
    let num_attempts: u64 = arguments.next().map_or(Ok(20), |n| n.parse())?;
    let mut parts: Vec<String> = arguments.collect();
    if parts.is_empty() {
        parts = ObjectSpec::names().map(str::to_owned).collect();
    }
    let (mut num_held, mut num_fewer, mut num_differing, mut num_attempts_made) = (0, 0, 0, 0);
    for name in parts {
        let spec = ObjectSpec::by_name(&name)?;
        let (mut in_process, mut network, mut differing) = (0, 0, Vec::new());
        for seed in 0..num_attempts {
            let report = cell(&spec, seed)?.run_oracle_attempt(&AttemptConfig::default(), seed)?;
            let (verdict, is_lifted, why) = over_network(cell(&spec, seed)?, pace)?;
            if verdict != is_lifted {
                println!("{name} seed {seed}: the hand says {verdict}, the truth {is_lifted}: {why}");
            }
            let is_held = report.outcome.is_held();
            in_process += u64::from(is_held);
            network += u64::from(verdict && is_lifted);
            if is_held != (verdict && is_lifted) {
                differing.push(seed);
                println!("{name} seed {seed}: in one process {:?}, over the network {verdict} {why}", report.outcome);
            }
        }
        println!(
            "{name}: {in_process} in one process, {network} over the network, of {num_attempts}; other: {differing:?}"
        );
        num_attempts_made += num_attempts;
        num_differing += differing.len();
        num_held += network;
        num_fewer += in_process as i64 - network as i64;
    }
    println!("all: {num_held} of {num_attempts_made} over the network, {num_fewer} fewer than in one process");
    let is_as_expected = match pace {
        Pace::RealTime => num_fewer * 240 <= 5 * num_attempts_made as i64,
        Pace::Lockstep { .. } => num_differing == 0,
    };
    if is_as_expected { Ok(()) } else { Err("the network makes a difference".into()) }
}
