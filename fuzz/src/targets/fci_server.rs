//! The simulated robot's side of Franka's protocol: sessions of successive messages to its control loop.

use nalgebra::{Isometry3, SMatrix};
use sdg_fci::Limits;
use sdg_fci::server::{HandCore, Jacobian, JointVector, Observation, PERIOD_SECS, Plant, RobotCore};
use sdg_fci::wire::{HandRequest, HeaderKind, Request, RobotCommand, Version};

use super::numbers::Numbers;
use super::robots::{command, hand_requests, message, requests};
use crate::target::Target;

/// The version that the server speaks.
const VERSION: Version = Version::V5;
/// Maximum number of cycles of one session. A motion whose client has disconnected ends after far fewer cycles.
const MAX_CYCLES: u32 = 400;
/// Start position of the joints, in rad: Franka's ready pose.
const READY: [f64; 7] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];

/// A session is a sequence of records: a kind, a length, bytes. Kinds: 0 a request to the robot, 1 a request to the
/// hand, 2 a command by UDP whose number is relative to the current state's number, 3 cycles without a command, 4 the
/// end of the client.
pub(super) const FCI_SERVER: Target = Target {
    name: "fci_server",
    max_extra_bytes: 8 << 20,
    quick_executions: 2_000,
    dictionary: &[
        b"\0\0\0\0\0\0\xf8\x7f",
        b"\0\0\0\0\0\0\xf0\x7f",
        b"\0\0\0\0\0\0\xf0\xff",
        b"\x03\x02\0\x40\x01",
        b"\x04\0\0",
    ],
    seeds: || {
        let request = |request: &Request| request.encode(7, VERSION).map(|bytes| record(0, &bytes)).unwrap_or_default();
        let moves = requests().into_iter().filter(|request| matches!(request, Request::Move(_)));
        let answers: Vec<u8> = (0..20).flat_map(|_| record(2, &command(0, READY).encode(VERSION))).collect();
        let wait = record(3, &200_u16.to_le_bytes());
        let mut seeds: Vec<Vec<u8>> = moves
            .map(|start| {
                [request(&start), answers.clone(), request(&Request::StopMove), wait.clone(), record(4, b"")].concat()
            })
            .collect();
        let recovery = [wait.as_slice(), &request(&Request::AutomaticErrorRecovery), &wait].concat();
        seeds[0].extend(recovery);
        seeds.push(requests().iter().flat_map(request).collect());
        let hand = hand_requests()
            .into_iter()
            .skip(1)
            .flat_map(|request| [record(1, &request.encode(7)), record(3, &60_u16.to_le_bytes())].concat());
        seeds.push(hand.collect());
        seeds
    },
    run: |bytes| {
        let mut plant = FreeArm::default();
        let mut robot = RobotCore::new(&mut plant, Limits::PANDA);
        let mut hand = HandCore::default();
        let mut input = Numbers(bytes);
        let (mut num_cycles, mut num_understood) = (0, 0);
        while !input.0.is_empty() && num_cycles < MAX_CYCLES {
            let (kind, length) = (input.u8(), input.u16());
            let body = input.bytes(usize::from(length));
            let mut answer = None;
            match kind % 5 {
                0 => {
                    let request = message(&body, HeaderKind::Robot)
                        .map(|(header, payload)| Request::decode(&header, &payload, VERSION));
                    match request {
                        Some(Ok(request)) => {
                            num_understood += 1;
                            robot.request(&plant, 7, &request);
                        }
                        // The server's loop does the same with a client that uses another protocol.
                        _ => robot.disconnect(),
                    }
                }
                1 => {
                    let request = message(&body, HeaderKind::Hand)
                        .map(|(header, payload)| HandRequest::decode(&header, &payload));
                    match request {
                        Some(Ok(request)) => {
                            num_understood += 1;
                            hand.request(&mut plant, 7, &request);
                        }
                        _ => hand.disconnect(&mut plant),
                    }
                }
                2 => {
                    // The server accepts only the answer to its current state.
                    answer = RobotCommand::decode(&body, VERSION).ok().filter(|command| command.message_id == 0);
                    num_understood += u32::from(answer.is_some());
                }
                3 => {
                    let count = u32::from(Numbers(&body).u16()).min(MAX_CYCLES - num_cycles);
                    for _ in 0..count {
                        cycle(&mut robot, &mut hand, &mut plant, None);
                    }
                    num_cycles += count;
                    continue;
                }
                _ => {
                    robot.disconnect();
                    hand.disconnect(&mut plant);
                }
            }
            cycle(&mut robot, &mut hand, &mut plant, answer.as_ref());
            num_cycles += 1;
        }
        num_understood > 0
    },
};

fn record(kind: u8, bytes: &[u8]) -> Vec<u8> {
    [&[kind], (bytes.len() as u16).to_le_bytes().as_slice(), bytes].concat()
}

/// Runs a cycle of one millisecond and encodes the states that would be sent.
fn cycle(robot: &mut RobotCore, hand: &mut HandCore, plant: &mut FreeArm, command: Option<&RobotCommand>) {
    let outcome = robot.cycle(plant, command);
    assert!(outcome.is_ok(), "expected a cycle, found {outcome:?}");
    hand.cycle(plant);
    let _ = (robot.take_responses(), hand.take_responses());
    let state = robot.state(plant);
    assert!(
        state.q_desired.iter().all(|q| q.is_finite()),
        "expected finite joint positions, found {:?}",
        state.q_desired
    );
    assert!(!state.encode(VERSION).is_empty() && !hand.state(plant).encode().is_empty());
}

/// Joints of inertia 1 without gravity, with the Panda's flange; panics on torques beyond a motor's limits.
#[derive(Debug)]
struct FreeArm {
    q: JointVector,
    dq: JointVector,
    width_m: f64,
}

impl Default for FreeArm {
    fn default() -> Self {
        Self { q: READY.into(), dq: JointVector::zeros(), width_m: 0.04 }
    }
}

impl Plant for FreeArm {
    fn observe(&mut self) -> Observation {
        Observation {
            q: self.q,
            dq: self.dq,
            mass: SMatrix::identity(),
            gravity: JointVector::zeros(),
            coriolis: JointVector::zeros(),
            contact_torque: JointVector::zeros(),
            self_collision: false,
        }
    }

    fn flange(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian) {
        let geometry = sdg_kinematics::ArmGeometry::panda();
        let frames = geometry.frames(q);
        let flange = frames.base_from_flange;
        let mut jacobian = Jacobian::zeros();
        for (joint, base_from_link) in frames.base_from_link.iter().enumerate() {
            let axis = base_from_link.rotation * nalgebra::Vector3::z();
            let lever = flange.translation.vector - base_from_link.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&axis.cross(&lever));
            jacobian.fixed_view_mut::<3, 1>(3, joint).copy_from(&axis);
        }
        (flange, jacobian)
    }

    fn step(&mut self, torque: &JointVector) -> Result<(), String> {
        for (torque, limit) in torque.iter().zip(Limits::PANDA.torque) {
            assert!(torque.abs() <= limit, "expected a torque of at most {limit} N·m, found {torque}");
        }
        self.dq += torque * PERIOD_SECS;
        self.q += self.dq * PERIOD_SECS;
        Ok(())
    }

    fn move_hand(&mut self, width_m: f64, speed_m_s: f64, force_n: f64) {
        let is_possible = width_m.is_finite() && speed_m_s.is_finite() && force_n.is_finite();
        assert!(is_possible, "expected finite numbers, found {width_m} m, {speed_m_s} m/s, {force_n} N");
        self.width_m = width_m.clamp(0.0, sdg_fci::server::HAND_MAX_WIDTH_M);
    }

    fn hand_width(&self) -> (f64, f64) {
        (self.width_m, 0.0)
    }
}
