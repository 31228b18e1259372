//! Serves a simulated Panda on the network, without `sdg`, until standard input ends: `fci_server IP [lockstep]`.

use std::io::Read;

use sdg_fci::server::{Pace, Server, ServerConfig};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{PandaPlant, WorkcellConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ip = std::env::args().nth(1).ok_or("usage: fci_server IP [lockstep]")?.parse()?;
    let pace = if std::env::args().nth(2).is_some() { Pace::LOCKSTEP } else { Pace::RealTime };
    let plant = PandaPlant::new(&WorkcellConfig::new(SceneVariation::nominal(None)))?;
    let server = Server::start(plant, &ServerConfig { ip, pace, ..ServerConfig::default() })?;
    println!("{} {}", server.robot_address(), server.hand_address());
    std::io::stdin().read_to_end(&mut Vec::new())?;
    println!("{:?}", server.statistics());
    server.stop()?;
    Ok(())
}
