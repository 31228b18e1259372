//! Franka's protocol, both sides.

use std::io::{self, Read};

use sdg_fci::read_message;
use sdg_fci::wire::{
    CollisionBehavior, Command, ControllerMode, Deviation, HandCommand, HandRequest, HandState, HandStatus, Header,
    HeaderKind, Load, MotionCommand, MotionGeneratorMode, MoveRequest, Request, Response, RobotCommand, RobotState,
    Status, Version,
};

use crate::target::Target;

const VERSIONS: [Version; 2] = [Version::V5, Version::V10];

/// Messages of the robot and the hand over TCP and UDP; the first byte of the input selects the kind of message.
pub(super) const FRANKA: Target = Target {
    name: "franka",
    // A header may announce 4 MB; memory is allocated as the bytes arrive.
    max_extra_bytes: 1 << 20,
    quick_executions: 100_000,
    dictionary: &[b"\0\0@\0", b"\x01\0@\0", b"\xff\xff\xff\x7f", b"\0\0\0\0\0\0\xf0\x7f", b"\0\0\0\0\0\0\xf8\x7f"],
    seeds: || {
        let mut seeds = Vec::new();
        for (k, version) in VERSIONS.into_iter().enumerate() {
            let messages = requests().into_iter().filter_map(|request| request.encode(1, version));
            seeds.extend(messages.map(|bytes| tagged(k as u8, &bytes)));
            for (command, rest) in
                [(Command::Connect, vec![5, 0]), (Command::Move, vec![]), (Command::GetCartesianLimit, vec![0; 153])]
            {
                let numbers = (command.number(version), Status::Success.number(command, version));
                if let (Some(number), Some(status)) = numbers {
                    let payload = [&[status], rest.as_slice()].concat();
                    seeds.push(tagged(k as u8, &Header::message(HeaderKind::Robot, number, 1, &payload)));
                }
            }
            seeds.push(tagged(2 + k as u8, &RobotState::default().encode(version)));
            seeds.push(tagged(2 + k as u8, &command(0, [0.1; 7]).encode(version)));
        }
        seeds.extend(hand_requests().iter().map(|request| tagged(4, &request.encode(1))));
        seeds.push(tagged(4, &HandStatus::Success.encode(HandCommand::Grasp, 1)));
        seeds.push(tagged(5, &HandState::default().encode()));
        seeds
    },
    run: |bytes| {
        let Some((kind, rest)) = bytes.split_first() else { return false };
        let version = VERSIONS[usize::from(kind & 1)];
        match kind % 6 {
            0 | 1 => message(rest, HeaderKind::Robot).is_some_and(|(header, payload)| {
                let command = Command::from_number(header.command, version);
                let answer = command.is_ok_and(|command| Response::decode(&payload, command, version).is_ok());
                Request::decode(&header, &payload, version).is_ok() | answer
            }),
            2 | 3 => RobotState::decode(rest, version).is_ok() | RobotCommand::decode(rest, version).is_ok(),
            4 => message(rest, HeaderKind::Hand).is_some_and(|(header, payload)| {
                HandRequest::decode(&header, &payload).is_ok() | HandStatus::decode(&payload).is_ok()
            }),
            _ => HandState::decode(rest).is_ok(),
        }
    },
};

/// Maximum number of bytes that are requested before they have arrived.
const MAX_STEP: usize = 8192;

/// Reads the first message of a stream. Asserts that no read requests more than [`MAX_STEP`] bytes, or more bytes than
/// the message has, and that the payload takes no more memory than the message has bytes.
pub(super) fn message(bytes: &[u8], kind: HeaderKind) -> Option<(Header, Vec<u8>)> {
    let mut stream = Watched { bytes, largest_buffer: 0 };
    let message = read_message(&mut stream, kind);
    let announced = bytes.get(..kind.size()).and_then(|bytes| Header::decode(bytes, kind).ok());
    let size = announced.map_or(kind.size(), |header| header.size as usize);
    assert!(
        stream.largest_buffer <= size.min(MAX_STEP),
        "expected a buffer of at most {} bytes, found {}",
        size.min(MAX_STEP),
        stream.largest_buffer
    );
    if let Ok(Ok((_, payload))) = &message {
        assert!(
            kind.size() + payload.capacity() <= size,
            "expected at most {size} bytes, found {}",
            payload.capacity()
        );
    }
    message.ok()?.ok()
}

/// A stream that records the largest buffer it was read into.
struct Watched<'a> {
    bytes: &'a [u8],
    largest_buffer: usize,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.largest_buffer = self.largest_buffer.max(buffer.len());
        self.bytes.read(buffer)
    }
}

fn tagged(kind: u8, bytes: &[u8]) -> Vec<u8> {
    [&[kind], bytes].concat()
}

/// Every request of a robot's client.
pub(super) fn requests() -> Vec<Request> {
    let deviation = Deviation { translation: 10.0, rotation: 3.12, elbow: 6.0 };
    let start = |controller, generator| {
        Request::Move(MoveRequest {
            controller,
            generator,
            max_path_deviation: deviation,
            max_goal_deviation: deviation,
        })
    };
    vec![
        start(ControllerMode::JointImpedance, MotionGeneratorMode::JointPosition),
        Request::Connect { version: 5, udp_port: 0x1234 },
        start(ControllerMode::External, MotionGeneratorMode::CartesianVelocity),
        Request::StopMove,
        Request::GetCartesianLimit(3),
        Request::SetCollisionBehavior(CollisionBehavior::new([1.0; 7], [2.0; 7], [3.0; 6], [4.0; 6])),
        Request::SetJointImpedance([3000.0; 7]),
        Request::SetCartesianImpedance([300.0; 6]),
        Request::SetGuidingMode([true, false, true, false, true, false, true]),
        Request::SetEeToStiffness(RobotState::default().ee_from_stiffness),
        Request::SetNeToEe(RobotState::default().ne_from_ee),
        Request::SetLoad(Load { mass: 0.5, center: [0.1, 0.2, 0.3], inertia: [0.01; 9] }),
        Request::SetFilters([100.0; 5]),
        Request::AutomaticErrorRecovery,
        Request::LoadModelLibrary([0, 0]),
        Request::GetRobotModel,
    ]
}

/// Every request of a hand's client.
pub(super) fn hand_requests() -> Vec<HandRequest> {
    vec![
        HandRequest::Connect { version: 3, udp_port: 7 },
        HandRequest::Homing,
        HandRequest::Grasp { width: 0.03, epsilon_inner: 0.005, epsilon_outer: 0.006, speed: 0.1, force: 20.0 },
        HandRequest::Move { width: 0.05, speed: 0.1 },
        HandRequest::Stop,
    ]
}

/// A command of a joint motion.
pub(super) fn command(message_id: u64, q: [f64; 7]) -> RobotCommand {
    let motion = MotionCommand { q, dq: [0.0; 7], valid_elbow: false, ..MotionCommand::default() };
    RobotCommand { message_id, motion, torque: [0.0; 7], torque_finished: false }
}
