//! Tests the robot's client against peers with mistakes in half of their messages: the client returns errors, does not
//! panic, and does not exceed its own timeouts.
#![allow(clippy::unwrap_used)]

use std::io::Write;
use std::net::{TcpListener, UdpSocket};
use std::ops::ControlFlow;
use std::thread;
use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_fci::client::{Hand, HandConfig, InternalController, Robot, RobotConfig};
use sdg_fci::read_message;
use sdg_fci::wire::{
    ControllerMode, HandRequest, HandState, HandStatus, Header, HeaderKind, MotionGeneratorMode, Request, RobotMode,
    RobotState, Version,
};
use sdg_fuzz::make_mistakes;

const NUM_SESSIONS: usize = 150;
const TIMEOUT: Duration = Duration::from_millis(50);
/// Covers a connection, and the start, end and stop of a motion. Each wait has a limit; the stop has the longest one
/// (10 s), which a closed connection shortens.
const MAX_SESSION: Duration = Duration::from_secs(25);

/// Mutates half of the messages.
fn maybe_mutated(mut bytes: Vec<u8>, rng: &mut Pcg64Mcg) -> Vec<u8> {
    if rng.random_bool(0.5) {
        let other = bytes.clone();
        make_mistakes(&mut bytes, &other, &[], rng);
    }
    bytes
}

/// Accepts a client, answers each of its requests and then sends a few states; disconnects when the client is silent.
fn play_robot(listener: &TcpListener, rng: &mut Pcg64Mcg) -> std::io::Result<()> {
    let (mut stream, client) = listener.accept()?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    let udp = UdpSocket::bind("127.0.0.1:0")?;
    let (mut udp_port, mut message_id) = (0, 1);
    let mut state = RobotState::default();
    while let Ok(Ok((header, payload))) = read_message(&mut stream, HeaderKind::Robot) {
        let request = Request::decode(&header, &payload, Version::V5);
        let status: &[u8] = match request {
            Ok(Request::Connect { udp_port: port, .. }) => {
                udp_port = port;
                &[0, 5, 0]
            }
            Ok(Request::Move(_)) => {
                state.robot_mode = RobotMode::Move;
                state.controller_mode = ControllerMode::JointImpedance;
                state.motion_generator_mode = MotionGeneratorMode::JointPosition;
                &[1]
            }
            _ => &[0],
        };
        let answer = Header::message(HeaderKind::Robot, header.command, header.command_id, status);
        stream.write_all(&maybe_mutated(answer, rng))?;
        for _ in 0..5 {
            message_id += rng.random_range(0..3);
            let datagram = RobotState { message_id, ..state.clone() }.encode(Version::V5);
            udp.send_to(&maybe_mutated(datagram, rng), (client.ip(), udp_port))?;
        }
    }
    Ok(())
}

fn play_hand(listener: &TcpListener, rng: &mut Pcg64Mcg) -> std::io::Result<()> {
    let (mut stream, client) = listener.accept()?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    let udp = UdpSocket::bind("127.0.0.1:0")?;
    while let Ok(Ok((header, payload))) = read_message(&mut stream, HeaderKind::Hand) {
        let Ok(request) = HandRequest::decode(&header, &payload) else { continue };
        let answer = HandStatus::Success.encode(request.command(), header.command_id);
        stream.write_all(&maybe_mutated(answer, rng))?;
        if let HandRequest::Connect { udp_port, .. } = request {
            udp.send_to(&maybe_mutated(HandState::default().encode(), rng), (client.ip(), udp_port))?;
        }
    }
    Ok(())
}

#[test]
fn a_robot_that_makes_mistakes_is_an_error() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        let rng = &mut Pcg64Mcg::seed_from_u64(1);
        // Runs until the test's process ends; a client that disconnects first is an error of the stream.
        loop {
            let _ = play_robot(&listener, rng);
        }
    });
    let (mut num_connected, mut num_failed) = (0, 0);
    for _ in 0..NUM_SESSIONS {
        let begin = Instant::now();
        let config = RobotConfig { version: Some(Version::V5), timeout: TIMEOUT, ..RobotConfig::default() };
        match Robot::connect(&address, &config) {
            Err(error) => {
                num_failed += 1;
                assert!(!error.to_string().contains('\n'), "{error}");
            }
            Ok(mut robot) => {
                num_connected += 1;
                let hold = |state: &RobotState, _| ControlFlow::Continue(state.q_desired);
                let error = robot.control_joint_positions(InternalController::JointImpedance, hold).unwrap_err();
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
        assert!(begin.elapsed() < MAX_SESSION, "{:?}", begin.elapsed());
    }
    assert!(num_connected > 20 && num_failed > 20, "{num_connected} {num_failed}");
}

#[test]
fn a_hand_that_makes_mistakes_is_an_error() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        let rng = &mut Pcg64Mcg::seed_from_u64(2);
        loop {
            let _ = play_hand(&listener, rng);
        }
    });
    let mut num_failed = 0;
    for _ in 0..NUM_SESSIONS {
        let config = HandConfig { timeout: TIMEOUT, ..HandConfig::default() };
        let result = Hand::connect(&address, &config).and_then(|mut hand| hand.read_state());
        if let Err(error) = result {
            num_failed += 1;
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    }
    assert!(num_failed > 20, "{num_failed}");
}
