//! Franka's protocol, on both sides.

use sdg_fci::read_message;
use sdg_fci::wire::{
    Command, HandRequest, HandState, HandStatus, HeaderKind, Request, Response, RobotCommand, RobotState, Version,
};

use crate::target::Target;

const VERSIONS: [Version; 2] = [Version::V5, Version::V10];

/// Messages over TCP and UDP, of robot and hand; the first byte of the input says of which kind it is read.
pub(super) const FRANKA: Target = Target {
    name: "franka",
    max_extra_bytes: 8 << 20,
    quick_executions: 100_000,
    dictionary: &[b"\0\0@\0", b"\x01\0@\0", b"\xff\xff\xff\x7f", b"\0\0\0\0\0\0\xf0\x7f", b"\0\0\0\0\0\0\xf8\x7f"],
    seeds: || {
        let mut seeds = Vec::new();
        for (k, version) in VERSIONS.into_iter().enumerate() {
            let requests = [
                Request::Connect { version: 5, udp_port: 0x1234 },
                Request::SetJointImpedance([3000.0; 7]),
                Request::StopMove,
            ];
            seeds.extend(
                requests.iter().filter_map(|request| request.encode(1, version)).map(|bytes| tagged(k as u8, &bytes)),
            );
            seeds.push(tagged(2 + k as u8, &RobotState::default().encode(version)));
        }
        seeds.push(tagged(4, &HandRequest::Move { width: 0.05, speed: 0.1 }.encode(1)));
        seeds.push(tagged(5, &HandState::default().encode()));
        seeds
    },
    run: |bytes| {
        let Some((kind, mut rest)) = bytes.split_first() else { return false };
        let version = VERSIONS[usize::from(kind & 1)];
        match kind % 6 {
            0 | 1 => match read_message(&mut rest, HeaderKind::Robot) {
                Ok(Ok((header, payload))) => {
                    let command = Command::from_number(header.command, version);
                    let answer = command.is_ok_and(|command| Response::decode(&payload, command, version).is_ok());
                    Request::decode(&header, &payload, version).is_ok() | answer
                }
                _ => false,
            },
            2 | 3 => RobotState::decode(rest, version).is_ok() | RobotCommand::decode(rest, version).is_ok(),
            4 => match read_message(&mut rest, HeaderKind::Hand) {
                Ok(Ok((header, payload))) => {
                    HandRequest::decode(&header, &payload).is_ok() | HandStatus::decode(&payload).is_ok()
                }
                _ => false,
            },
            _ => HandState::decode(rest).is_ok(),
        }
    },
};

fn tagged(kind: u8, bytes: &[u8]) -> Vec<u8> {
    [&[kind], bytes].concat()
}
