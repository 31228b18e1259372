//! A simulated Panda on a free port of this computer, in lockstep, and a client of it.

use std::net::SocketAddr;

use sdg_fci::Limits;
use sdg_fci::client::{Hand, HandConfig, Robot, RobotConfig};
use sdg_fci::server::{Pace, Server, ServerConfig};
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{PandaPlant, WorkcellConfig};

/// Serves a Panda at an empty table.
pub fn serve(pace: Pace, limits: Limits) -> Server {
    let plant = PandaPlant::new(&WorkcellConfig::new(SceneVariation::nominal(None))).unwrap();
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace, limits, ..ServerConfig::default() };
    Server::start(plant, &config).unwrap()
}

/// Serves a Panda with a Panda's limits in lockstep, and connects a client.
pub fn serve_panda() -> (Server, Robot) {
    let server = serve(Pace::LOCKSTEP, Limits::PANDA);
    let robot = connect(&server);
    (server, robot)
}

/// Connects a client to a server.
pub fn connect(server: &Server) -> Robot {
    let address: SocketAddr = server.robot_address();
    Robot::connect(&address.to_string(), &RobotConfig::default()).unwrap()
}

/// Connects a client to a server's hand.
pub fn connect_hand(server: &Server) -> Hand {
    Hand::connect(&server.hand_address().to_string(), &HandConfig::default()).unwrap()
}
