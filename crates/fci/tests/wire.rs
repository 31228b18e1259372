//! Sizes and bytes of messages, encoded and decoded. fuzz/ tests invalid messages.

use sdg_fci::wire::{
    COMMAND_SIZE_V5, COMMAND_SIZE_V10, CollisionBehavior, Command, ControllerMode, Deviation, HAND_HEADER_SIZE,
    HEADER_SIZE, HandRequest, Header, HeaderKind, Load, MAX_MESSAGE_SIZE, MotionCommand, MotionGeneratorMode,
    MoveRequest, Request, RobotCommand, RobotMode, RobotState, STATE_SIZE_V5, STATE_SIZE_V10, Status, Version,
};
use sdg_fci::{RobotError, RobotErrors, WireError, read_message};

const VERSIONS: [Version; 2] = [Version::V5, Version::V10];

fn requests() -> Vec<Request> {
    let deviation = Deviation { translation: 10.0, rotation: 3.12, elbow: 6.0 };
    vec![
        Request::Connect { version: 5, udp_port: 0x1234 },
        Request::Move(MoveRequest {
            controller: ControllerMode::External,
            generator: MotionGeneratorMode::CartesianVelocity,
            max_path_deviation: deviation,
            max_goal_deviation: deviation,
        }),
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

fn hand_requests() -> Vec<HandRequest> {
    vec![
        HandRequest::Connect { version: 3, udp_port: 7 },
        HandRequest::Homing,
        HandRequest::Grasp { width: 0.03, epsilon_inner: 0.005, epsilon_outer: 0.006, speed: 0.1, force: 20.0 },
        HandRequest::Move { width: 0.05, speed: 0.1 },
        HandRequest::Stop,
    ]
}

/// A state in which every number differs from its neighbours.
fn state() -> RobotState {
    let blank = RobotState::default().encode(Version::V5);
    let mut bytes = vec![0; blank.len()];
    for (index, number) in bytes[8..8 + 284 * 8].chunks_exact_mut(8).enumerate() {
        // Whole numbers keep their value in version 10's single precision.
        number.copy_from_slice(&(index as f64 + 1.0).to_le_bytes());
    }
    bytes[..8].copy_from_slice(&77_u64.to_le_bytes());
    let mut state = RobotState::decode(&bytes, Version::V5).unwrap();
    state.motion_generator_mode = MotionGeneratorMode::CartesianPosition;
    state.controller_mode = ControllerMode::External;
    state.robot_mode = RobotMode::Reflex;
    state.errors =
        [RobotError::JointPositionLimitsViolation, RobotError::BaseAccelerationInvalidReading].into_iter().collect();
    state.reflex_reason = RobotErrors::from(RobotError::CommunicationConstraintsViolation);
    state.control_command_success_rate = 0.75;
    state
}

fn command() -> RobotCommand {
    RobotCommand {
        message_id: 0x0102_0304_0506_0708,
        motion: MotionCommand {
            q: [0.1; 7],
            dq: [0.2; 7],
            twist: [0.3; 6],
            elbow: [0.4, -1.0],
            valid_elbow: true,
            finished: true,
            ..MotionCommand::default()
        },
        torque: [0.5; 7],
        torque_finished: false,
    }
}

#[test]
fn states_and_commands_have_the_published_sizes_and_survive() {
    for (version, state_size, command_size) in
        [(Version::V5, STATE_SIZE_V5, COMMAND_SIZE_V5), (Version::V10, STATE_SIZE_V10, COMMAND_SIZE_V10)]
    {
        let bytes = state().encode(version);
        assert_eq!(bytes.len(), state_size);
        assert_eq!(RobotState::decode(&bytes, version).unwrap(), state());
        let bytes = command().encode(version);
        assert_eq!(bytes.len(), command_size);
        assert_eq!(RobotCommand::decode(&bytes, version).unwrap(), command());
    }
}

#[test]
fn fields_stand_where_libfranka_reads_them() {
    // The offsets follow from the published structs: the message's number, then six transforms, and so on.
    let bytes = state().encode(Version::V5);
    let number = |offset: usize| f64::from_le_bytes(bytes[offset..offset + 8].try_into().unwrap());
    let state = state();
    assert_eq!(number(8), state.base_from_ee[0]);
    // 8 + 6 * 16 * 8 bytes before the mass; 26 numbers of masses, inertias and centres, 4 of elbows and 3 * 7 of
    // torques before q.
    assert_eq!(number(776), state.ee_mass);
    assert_eq!(number(776 + 8 * (26 + 4 + 21)), state.q[0]);
    // Modes and errors come after 284 numbers; only the success rate follows.
    assert_eq!(bytes[8 + 8 * 284..8 + 8 * 284 + 2], [3, 2]);
    assert_eq!(bytes[8 + 8 * 284 + 2], 1, "the first error");
    assert_eq!(bytes[8 + 8 * 284 + 2 + 40], 1, "the last error");
    assert_eq!(bytes[8 + 8 * 284 + 2 + 41 + 25], 1, "the reason");
    assert_eq!(bytes[8 + 8 * 284 + 2 + 82], 4);
    assert_eq!(number(STATE_SIZE_V5 - 8), 0.75);

    let bytes = command().encode(Version::V5);
    assert_eq!(bytes[..8], [8, 7, 6, 5, 4, 3, 2, 1]);
    assert_eq!(bytes[8 + 8 * 38..8 + 8 * 38 + 2], [1, 1], "elbow and end");

    // A Move has four bytes for each mode, and its generator 0 is joint positions.
    let bytes = requests()[1].encode(9, Version::V5).unwrap();
    assert_eq!(bytes[..20], [1, 0, 0, 0, 9, 0, 0, 0, 68, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
    // The numbers of the hand's commands have two bytes.
    let bytes = hand_requests()[0].encode(9);
    assert_eq!(bytes, [0, 0, 9, 0, 0, 0, 14, 0, 0, 0, 3, 0, 7, 0]);
}

#[test]
fn requests_survive_in_both_versions() {
    let mut num_missing = 0;
    for version in VERSIONS {
        for request in requests() {
            let Some(bytes) = request.encode(5, version) else {
                num_missing += 1;
                continue;
            };
            let header = Header::decode(&bytes, HeaderKind::Robot).unwrap();
            assert_eq!((header.command_id, header.size as usize), (5, bytes.len()));
            assert_eq!(Request::decode(&header, &bytes[HEADER_SIZE..], version).unwrap(), request);
        }
    }
    // Walls, filters and the library exist only in version 5, the description only in version 10.
    assert_eq!(num_missing, 4);
    for request in hand_requests() {
        let bytes = request.encode(5);
        let header = Header::decode(&bytes, HeaderKind::Hand).unwrap();
        assert_eq!(HandRequest::decode(&header, &bytes[HAND_HEADER_SIZE..]).unwrap(), request);
    }
}

#[test]
fn statuses_depend_on_the_version() {
    let number = |status: Status, version| status.number(Command::Move, version);
    assert_eq!(number(Status::ReflexAborted, Version::V5), Some(6));
    assert_eq!(number(Status::ReflexAborted, Version::V10), Some(8));
    assert_eq!(number(Status::PreemptedBySafety, Version::V5), None);
    assert_eq!(Status::from_number(9, Command::Move, Version::V5), Ok(Status::Aborted));
    assert!(Status::from_number(10, Command::Move, Version::V5).is_err());
}

#[test]
fn errors_have_libfrankas_names_and_bits() {
    assert_eq!(RobotError::ALL[25].name(), "communication_constraints_violation");
    assert_eq!(RobotError::ALL[6].name(), "joint_reflex");
    assert_eq!(RobotError::ALL[40].name(), "base_acceleration_invalid_reading");
    let both: RobotErrors = [RobotError::JointReflex, RobotError::CartesianReflex].into_iter().collect();
    assert_eq!(both.to_string(), "joint_reflex, cartesian_reflex");
}

#[test]
fn a_message_that_ends_early_or_late_says_by_how_much() {
    let bytes = state().encode(Version::V5);
    let short = RobotState::decode(&bytes[..100], Version::V5).unwrap_err();
    assert!(matches!(short, WireError::Short { found: 100, .. }), "{short}");
    let long = RobotState::decode(&[&bytes[..], &[0]].concat(), Version::V5).unwrap_err();
    assert_eq!(long.to_string(), "expected a state of 2373 bytes, found 2374");
}

#[test]
fn a_header_announces_no_less_than_itself_and_no_more_than_a_message_has() {
    for (kind, min) in [(HeaderKind::Robot, HEADER_SIZE as u32), (HeaderKind::Hand, HAND_HEADER_SIZE as u32)] {
        // In both headers the size is the last number.
        let header = |size: u32| {
            let mut bytes = Header::message(kind, 1, 1, &[]);
            bytes[kind.size() - 4..].copy_from_slice(&size.to_le_bytes());
            Header::decode(&bytes, kind)
        };
        for size in [min, MAX_MESSAGE_SIZE] {
            assert_eq!(header(size).unwrap().payload_size(kind), (size - min) as usize);
        }
        for found in [0, min - 1, MAX_MESSAGE_SIZE + 1, u32::MAX] {
            assert_eq!(header(found), Err(WireError::MessageSize { min, max: MAX_MESSAGE_SIZE, found }));
        }
    }
}

/// The memory for a message is allocated in steps, while its bytes arrive.
#[test]
fn a_header_that_announces_much_takes_little_memory() {
    struct Stream<'a> {
        bytes: &'a [u8],
        largest_buffer: usize,
    }
    impl std::io::Read for Stream<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            self.largest_buffer = self.largest_buffer.max(buffer.len());
            self.bytes.read(buffer)
        }
    }
    let mut bytes = Header::message(HeaderKind::Robot, 1, 1, &[7; 100]);
    bytes[HEADER_SIZE - 4..HEADER_SIZE].copy_from_slice(&MAX_MESSAGE_SIZE.to_le_bytes());
    let mut stream = Stream { bytes: &bytes, largest_buffer: 0 };
    let error = read_message(&mut stream, HeaderKind::Robot).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::UnexpectedEof);
    // The header announced 4 MB.
    assert!(stream.largest_buffer <= 8192, "{}", stream.largest_buffer);
}
