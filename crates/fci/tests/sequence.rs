//! Checks of the order and origin of messages by client and server, over TCP and UDP on this computer.

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, SMatrix};
use sdg_fci::client::{InternalController, Robot, RobotConfig};
use sdg_fci::server::{Jacobian, JointVector, Observation, Pace, Plant, Server, ServerConfig};
use sdg_fci::wire::{
    ControllerMode, Deviation, Header, HeaderKind, MotionCommand, MotionGeneratorMode, MoveRequest, Request,
    RobotCommand, RobotMode, RobotState, STATE_SIZE_V5, Version,
};
use sdg_fci::{FciError, RobotError, RobotErrors, read_message};

const TIMEOUT: Duration = Duration::from_millis(300);

/// Acts as a robot that accepts one client and answers with the request's number plus `beside`. Returns the stream and
/// the address for states.
fn welcome(listener: &TcpListener, beside: u32) -> (TcpStream, SocketAddr) {
    let (mut stream, client) = listener.accept().unwrap();
    let (header, payload) = read_message(&mut stream, HeaderKind::Robot).unwrap().unwrap();
    let Ok(Request::Connect { udp_port, .. }) = Request::decode(&header, &payload, Version::V5) else {
        panic!("{header:?}")
    };
    let answer = Header::message(HeaderKind::Robot, header.command, header.command_id + beside, &[0, 5, 0]);
    stream.write_all(&answer).unwrap();
    (stream, SocketAddr::new(client.ip(), udp_port))
}

fn state(message_id: u64) -> Vec<u8> {
    RobotState { message_id, ..RobotState::default() }.encode(Version::V5)
}

fn connect(listener: &TcpListener) -> Result<Robot, FciError> {
    let config = RobotConfig { version: Some(Version::V5), timeout: TIMEOUT, ..RobotConfig::default() };
    Robot::connect(&listener.local_addr().unwrap().to_string(), &config)
}

/// Reads a state while a test robot sends state `first`, and then repeatedly the states `numbers` from the address
/// `from`.
fn read_while_sent(first: u64, numbers: &'static [u64], from: Ipv4Addr) -> Result<u64, FciError> {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let is_done = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&is_done);
    let played = listener.try_clone().unwrap();
    let robot = thread::spawn(move || {
        let (_stream, client) = welcome(&played, 0);
        let own = UdpSocket::bind("127.0.0.1:0").unwrap();
        let other = UdpSocket::bind((from, 0)).unwrap();
        own.send_to(&state(first), client).unwrap();
        // The client receives the first state before the others.
        thread::sleep(Duration::from_millis(100));
        for number in numbers.iter().cycle() {
            if is_over.load(Ordering::SeqCst) {
                break;
            }
            other.send_to(&state(*number), client).unwrap();
            thread::sleep(Duration::from_millis(5));
        }
    });
    let read = connect(&listener).and_then(|mut robot| Ok(robot.read_state()?.message_id));
    is_done.store(true, Ordering::SeqCst);
    robot.join().unwrap();
    read
}

#[test]
fn a_state_that_comes_late_or_again_is_none() {
    let here = Ipv4Addr::LOCALHOST;
    assert_eq!(read_while_sent(12, &[13], here).unwrap(), 13);
    for late in [[11].as_slice(), &[12], &[0, 11, 12]] {
        let error = read_while_sent(12, late, here).unwrap_err();
        assert!(matches!(error, FciError::Timeout { .. }), "{late:?}: {error}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_state_of_another_computer_is_none() {
    // All of 127.0.0.0/8 is this computer, but the addresses differ.
    let error = read_while_sent(12, &[13, 14, 15], Ipv4Addr::new(127, 0, 0, 2)).unwrap_err();
    assert!(matches!(error, FciError::Timeout { .. }), "{error}");
}

#[test]
fn an_answer_to_another_request_is_none() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let played = listener.try_clone().unwrap();
    let robot = thread::spawn(move || {
        let (stream, client) = welcome(&played, 1);
        UdpSocket::bind("127.0.0.1:0").unwrap().send_to(&state(1), client).unwrap();
        stream
    });
    let error = connect(&listener).unwrap_err();
    assert!(matches!(error, FciError::Timeout { what: "connect", .. }), "{error:?}");
    drop(robot.join().unwrap());
}

/// A client that waits for no answer stores a bounded number of answers; the others wait in the network.
#[test]
fn a_robot_that_floods_its_client_takes_no_memory() {
    const ANSWER_BYTES: usize = 64 << 10;
    // 16 stored answers and one that is being read are 1.1 MB; the buffers of a connection hold about 6 MB.
    const MAX_TAKEN: usize = 32 << 20;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let played = listener.try_clone().unwrap();
    let robot = thread::spawn(move || {
        let (mut stream, client) = welcome(&played, 0);
        UdpSocket::bind("127.0.0.1:0").unwrap().send_to(&state(1), client).unwrap();
        stream.set_write_timeout(Some(TIMEOUT)).unwrap();
        let answer = Header::message(HeaderKind::Robot, 0, 999, &[0; ANSWER_BYTES]);
        let mut num_sent = 0;
        // The loop ends when the client accepts no more data.
        while num_sent < 4 * MAX_TAKEN && stream.write_all(&answer).is_ok() {
            num_sent += answer.len();
        }
        num_sent
    });
    let client = connect(&listener).unwrap();
    let taken = robot.join().unwrap();
    assert!(taken < MAX_TAKEN, "{taken} bytes of at most {MAX_TAKEN}");
    // The client's reading thread waits for room in its queue, and must still end.
    drop(client);
}

#[test]
fn a_command_that_is_no_number_is_not_sent() {
    let server = serve();
    let config = RobotConfig { version: Some(Version::V5), timeout: 20 * TIMEOUT, ..RobotConfig::default() };
    let mut robot = Robot::connect(&server.robot_address().to_string(), &config).unwrap();
    for wrong in [f64::NAN, f64::INFINITY] {
        let answer = |_: &RobotState, _| ControlFlow::Continue([wrong; 7]);
        let error = robot.control_joint_positions(InternalController::JointImpedance, answer).unwrap_err();
        assert!(matches!(error, FciError::Command { .. }), "{error}");
        assert_eq!(server.statistics().num_commands, 0);
    }
}

/// An arm of inertia 1 without gravity.
struct FreeArm {
    q: JointVector,
    dq: JointVector,
}

impl Plant for FreeArm {
    fn observe(&mut self) -> Observation {
        let zero = JointVector::zeros();
        Observation {
            q: self.q,
            dq: self.dq,
            mass: SMatrix::identity(),
            gravity: zero,
            coriolis: zero,
            contact_torque: zero,
            self_collision: false,
        }
    }

    fn flange(&self, _: &JointVector) -> (Isometry3<f64>, Jacobian) {
        (Isometry3::identity(), Jacobian::zeros())
    }

    fn step(&mut self, torque: &JointVector) -> Result<(), String> {
        self.dq += torque * 1e-3;
        self.q += self.dq * 1e-3;
        Ok(())
    }

    fn move_hand(&mut self, _: f64, _: f64, _: f64) {}

    fn hand_width(&self) -> (f64, f64) {
        (0.04, 0.0)
    }
}

/// A client of bare sockets, in a motion of joint positions.
struct Client {
    /// Kept open, because otherwise the robot would stop.
    _stream: TcpStream,
    udp: UdpSocket,
}

const READY: [f64; 7] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];

impl Client {
    fn in_motion(server: &Server) -> Self {
        let mut stream = TcpStream::connect(server.robot_address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
        udp.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let udp_port = udp.local_addr().unwrap().port();
        stream.write_all(&Request::Connect { version: 5, udp_port }.encode(1, Version::V5).unwrap()).unwrap();
        read_message(&mut stream, HeaderKind::Robot).unwrap().unwrap();
        let deviation = Deviation { translation: 10.0, rotation: 3.12, elbow: 6.0 };
        let start = Request::Move(MoveRequest {
            controller: ControllerMode::JointImpedance,
            generator: MotionGeneratorMode::JointPosition,
            max_path_deviation: deviation,
            max_goal_deviation: deviation,
        });
        stream.write_all(&start.encode(2, Version::V5).unwrap()).unwrap();
        read_message(&mut stream, HeaderKind::Robot).unwrap().unwrap();
        let client = Self { _stream: stream, udp };
        while client.state().0.robot_mode != RobotMode::Move {}
        client
    }

    /// Receives a state and the address of its sender.
    fn state(&self) -> (RobotState, SocketAddr) {
        let mut buffer = [0; STATE_SIZE_V5];
        let (_, from) = self.udp.recv_from(&mut buffer).unwrap();
        (RobotState::decode(&buffer, Version::V5).unwrap(), from)
    }

    fn command(message_id: u64, q: [f64; 7]) -> Vec<u8> {
        let motion = MotionCommand { q, ..MotionCommand::default() };
        RobotCommand { message_id, motion, ..RobotCommand::default() }.encode(Version::V5)
    }
}

fn serve() -> Server {
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace: Pace::LOCKSTEP, ..ServerConfig::default() };
    Server::start(FreeArm { q: READY.into(), dq: JointVector::zeros() }, &config).unwrap()
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < Duration::from_secs(20), "{what}");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_server_takes_the_answer_to_its_present_state_alone() {
    let server = serve();
    let client = Client::in_motion(&server);
    let (state, from) = client.state();
    client.udp.send_to(&Client::command(state.message_id - 1, READY), from).unwrap();
    wait_until("a late command is counted", || server.statistics().num_late > 0);
    assert_eq!(server.statistics().num_commands, 0);
    // Commands from another socket of this computer.
    let other = UdpSocket::bind("127.0.0.1:0").unwrap();
    for ahead in 0..20 {
        other.send_to(&Client::command(state.message_id + ahead, READY), from).unwrap();
    }
    thread::sleep(Duration::from_millis(100));
    assert_eq!(server.statistics().num_commands, 0);
}

#[test]
fn states_are_counted_only_while_a_client_is_connected() {
    let server = serve();
    // A hundred cycles.
    thread::sleep(Duration::from_millis(100));
    assert_eq!(server.statistics().num_states, 0);
    let client = Client::in_motion(&server);
    wait_until("a state is counted", || server.statistics().num_states > 0);
    drop(client);
    let num_states = || server.statistics().num_states;
    wait_until("the count stands still", || {
        let before = num_states();
        thread::sleep(Duration::from_millis(100));
        num_states() == before
    });
}

#[test]
fn a_position_that_is_no_number_stops_the_robot() {
    let server = serve();
    let client = Client::in_motion(&server);
    // States are answered until a command arrives in its own cycle, first with READY, then with NaN.
    for q in [READY, [f64::NAN; 7]] {
        let begin = server.statistics().num_commands;
        while server.statistics().num_commands == begin {
            let (state, from) = client.state();
            client.udp.send_to(&Client::command(state.message_id, q), from).unwrap();
            assert!(state.q_desired.iter().all(|q| q.is_finite()), "{:?}", state.q_desired);
            thread::sleep(Duration::from_millis(2));
        }
    }
    let reflex = (0..1000).map(|_| client.state().0).find(|state| state.robot_mode == RobotMode::Reflex);
    let reflex = reflex.expect("a robot in reflex");
    assert!(reflex.q_desired.iter().all(|q| q.is_finite()), "{:?}", reflex.q_desired);
    // There is no other error: if the NaN were processed further, other limits would be reported as well.
    assert_eq!(reflex.errors, RobotErrors::from(RobotError::JointMotionGeneratorPositionLimitsViolation));
    drop(client);
}
