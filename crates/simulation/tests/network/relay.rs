//! A relay between a robot and its client that forwards everything except the states and commands that a test changes.
//! States of a standing arm arrive late, later than the robot's answers over TCP.

use std::collections::VecDeque;
use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::{Arc, Mutex};
use std::thread;

use sdg_fci::read_message;
use sdg_fci::server::Server;
use sdg_fci::wire::{HEADER_SIZE, Header, HeaderKind, Request, RobotMode, RobotState, STATE_SIZE_V5, Version};
use sdg_robot::{FrankaArm, RobotAddress, Scheduling};

/// Function from a state of a moving arm, and its index, to the datagrams that the relay sends instead.
pub type ChangeState = Box<dyn FnMut(u64, &RobotState) -> Vec<Vec<u8>> + Send>;
/// Function that gets the index of a command and decides whether the command is forwarded.
pub type PassCommand = Box<dyn FnMut(u64) -> bool + Send>;

/// Number of cycles by which the states of a standing arm are late.
const NUM_LATE: usize = 30;

/// The unchanged datagram of a state.
pub fn unchanged(state: &RobotState) -> Vec<u8> {
    state.encode(Version::V5)
}

/// Connects an arm to a server through a relay; the hand is reached directly.
pub fn connect(server: &Server, change: ChangeState, pass: PassCommand) -> sdg_robot::Result<FrankaArm> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    let robot = server.robot_address();
    thread::spawn(move || relay(&listener, robot, change, pass));
    let (host, hand_port) = (Ipv4Addr::LOCALHOST.to_string(), server.hand_address().port());
    FrankaArm::connect(&RobotAddress { host, port, hand_port }, Scheduling::Ordinary)
}

/// Serves one client. The threads of the TCP connections end with the connections, the threads of the UDP datagrams
/// with the test's process.
fn relay(listener: &TcpListener, robot: SocketAddr, change: ChangeState, pass: PassCommand) {
    let (mut client, _) = listener.accept().unwrap();
    let mut server = TcpStream::connect(robot).unwrap();
    client.set_nodelay(true).unwrap();
    server.set_nodelay(true).unwrap();
    let [to_client, to_server] = [(); 2].map(|()| Arc::new(UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap()));
    // The client's UDP port, and the robot's sending address.
    let (client_port, robot_udp) = (Arc::new(Mutex::new(0)), Arc::new(Mutex::new(None)));

    let (states, sends, port, source) = (to_server.clone(), to_client.clone(), client_port.clone(), robot_udp.clone());
    thread::spawn(move || pass_states(&states, &sends, &port, &source, change));
    let (commands, sends) = (to_client, to_server.clone());
    thread::spawn(move || pass_commands(&commands, &sends, &robot_udp, pass));
    let (mut answers, mut to) = (server.try_clone().unwrap(), client.try_clone().unwrap());
    thread::spawn(move || {
        let _ = std::io::copy(&mut answers, &mut to);
        let _ = to.shutdown(std::net::Shutdown::Both);
    });

    while let Ok(Ok((header, payload))) = read_message(&mut client, HeaderKind::Robot) {
        let message = match Request::decode(&header, &payload, Version::V5) {
            Ok(Request::Connect { version, udp_port }) => {
                *client_port.lock().unwrap() = udp_port;
                let udp_port = to_server.local_addr().unwrap().port();
                Request::Connect { version, udp_port }.encode(header.command_id, Version::V5).unwrap()
            }
            _ => Header::message(HeaderKind::Robot, header.command, header.command_id, &payload),
        };
        assert_eq!(message.len(), HEADER_SIZE + payload.len());
        if server.write_all(&message).is_err() {
            break;
        }
    }
    let _ = server.shutdown(std::net::Shutdown::Both);
}

fn pass_states(
    from: &UdpSocket,
    sends: &UdpSocket,
    client_port: &Mutex<u16>,
    source: &Mutex<Option<SocketAddr>>,
    mut change: ChangeState,
) {
    let (mut buffer, mut num_moving, mut late) = ([0; STATE_SIZE_V5], 0, VecDeque::new());
    while let Ok((length, robot)) = from.recv_from(&mut buffer) {
        *source.lock().unwrap() = Some(robot);
        let state = RobotState::decode(&buffer[..length], Version::V5).unwrap();
        let datagrams = match state.robot_mode {
            RobotMode::Move => {
                num_moving += 1;
                late.clear();
                change(num_moving, &state)
            }
            _ => {
                late.push_back(unchanged(&state));
                if late.len() > NUM_LATE { late.pop_front().into_iter().collect() } else { Vec::new() }
            }
        };
        let client = SocketAddr::from((Ipv4Addr::LOCALHOST, *client_port.lock().unwrap()));
        for datagram in datagrams {
            // An error means that the client is disconnected.
            let _ = sends.send_to(&datagram, client);
        }
    }
}

fn pass_commands(from: &UdpSocket, sends: &UdpSocket, robot: &Mutex<Option<SocketAddr>>, mut pass: PassCommand) {
    let (mut buffer, mut num_commands) = ([0; 1024], 0);
    while let Ok((length, _)) = from.recv_from(&mut buffer) {
        num_commands += 1;
        if let (true, Some(robot)) = (pass(num_commands), *robot.lock().unwrap()) {
            let _ = sends.send_to(&buffer[..length], robot);
        }
    }
}
