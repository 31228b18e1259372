//! A simple client of the robot's protocol, for tests of faults.

use std::io::Write;
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::time::Duration;

use sdg_fci::read_message;
use sdg_fci::server::Server;
use sdg_fci::wire::{
    ControllerMode, Deviation, HeaderKind, MotionCommand, MotionGeneratorMode, MoveRequest, Request, Response,
    RobotCommand, RobotMode, RobotState, STATE_SIZE_V5, Status, Version,
};

/// Speed of joint 1, rad/s, when a fault occurs.
pub const SPEED: f64 = 0.5;
/// Joint velocities, rad/s, at a time of a motion: joint 1 accelerates to [`SPEED`] in 0.2 s.
pub fn velocity_after(ms: u64) -> [f64; 7] {
    let ramp = (ms as f64 / 200.0).min(1.0);
    [SPEED * 0.5 * (1.0 - (std::f64::consts::PI * ramp).cos()), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// A client of bare sockets, which can be disconnected at any moment.
pub struct BareClient {
    stream: TcpStream,
    udp: UdpSocket,
}

impl BareClient {
    pub fn connect(server: &Server, version: u16) -> (Self, Response) {
        let stream = TcpStream::connect(server.robot_address()).unwrap();
        let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
        udp.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let mut client = Self { stream, udp };
        let udp_port = client.udp.local_addr().unwrap().port();
        let response = client.execute(&Request::Connect { version, udp_port });
        (client, response)
    }

    fn execute(&mut self, request: &Request) -> Response {
        self.stream.write_all(&request.encode(7, Version::V5).unwrap()).unwrap();
        let (header, payload) = read_message(&mut self.stream, HeaderKind::Robot).unwrap().unwrap();
        assert_eq!(header.command_id, 7);
        Response::decode(&payload, request.command(), Version::V5).unwrap()
    }

    fn state(&self) -> (RobotState, SocketAddr) {
        let mut buffer = [0; STATE_SIZE_V5];
        let (length, from) = self.udp.recv_from(&mut buffer).unwrap();
        (RobotState::decode(&buffer[..length], Version::V5).unwrap(), from)
    }

    /// Starts a joint velocity motion and answers `num_states` of its states.
    pub fn turn(&mut self, num_states: u64) {
        let any = Deviation { translation: 1.0, rotation: 1.0, elbow: 1.0 };
        let response = self.execute(&Request::Move(MoveRequest {
            controller: ControllerMode::JointImpedance,
            generator: MotionGeneratorMode::JointVelocity,
            max_path_deviation: any,
            max_goal_deviation: any,
        }));
        assert_eq!(response.status, Status::MotionStarted);
        let mut answered = 0;
        while answered < num_states {
            let (state, from) = self.state();
            if state.robot_mode == RobotMode::Move {
                let motion = MotionCommand { dq: velocity_after(answered), ..MotionCommand::default() };
                let command = RobotCommand { message_id: state.message_id, motion, ..RobotCommand::default() };
                self.udp.send_to(&command.encode(Version::V5), from).unwrap();
                answered += 1;
            }
        }
    }
}
