//! All orders of up to five steps of a hand and of a caller of [`HandWorker`], compared with a model without threads. A
//! caller that waits for the hand continues when the motion ends, so that this order equals the one in which the motion
//! ends first.

use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use sdg_fci::client::{Hand, HandConfig};
use sdg_fci::read_message;
use sdg_fci::wire::{HandCommand as Command, HandRequest, HandStatus, HeaderKind};

use super::HandWorker;
use crate::arm_state::HandCommand;

/// Maximum number of steps: there are 5 + 25 + … + 5⁵ = 3905 schedules.
const MAX_TURNS: u32 = 5;
const TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    /// The hand reaches the width.
    Reach,
    /// The hand ends elsewhere.
    Miss,
    /// The caller starts a motion.
    Start,
    /// The caller stops a running motion.
    StopMotion,
    /// The caller waits for the end of the motion.
    Finish,
}

const TURNS: [Turn; 5] = [Turn::Reach, Turn::Miss, Turn::Start, Turn::StopMotion, Turn::Finish];

/// The state of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Resting,
    Moving {
        id: u32,
    },
    /// The motion has ended, and the caller has not asked for its result.
    Ended {
        is_reached: bool,
    },
}

/// The other end of the connection: responses are written by the test.
struct DrivenHand {
    stream: TcpStream,
    requests: Receiver<(u32, HandRequest)>,
}

impl DrivenHand {
    fn connected() -> (HandWorker, Self) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let config = HandConfig { port: listener.local_addr().unwrap().port(), ..HandConfig::default() };
        let (send, requests) = channel();
        let accepted = thread::spawn(move || {
            let (mut reading, _) = listener.accept().unwrap();
            reading.set_nodelay(true).unwrap();
            let mut stream = reading.try_clone().unwrap();
            let (header, _) = read_message(&mut reading, HeaderKind::Hand).unwrap().unwrap();
            stream.write_all(&HandStatus::Success.encode(Command::Connect, header.command_id)).unwrap();
            thread::spawn(move || {
                while let Ok(Ok((header, payload))) = read_message(&mut reading, HeaderKind::Hand) {
                    let request = HandRequest::decode(&header, &payload).unwrap();
                    if send.send((header.command_id, request)).is_err() {
                        return;
                    }
                }
            });
            stream
        });
        let worker = HandWorker::new(Hand::connect("127.0.0.1", &config).unwrap());
        (worker, Self { stream: accepted.join().unwrap(), requests })
    }

    fn request(&self) -> (u32, HandRequest) {
        self.requests.recv_timeout(TIMEOUT).unwrap()
    }

    fn respond(&mut self, status: HandStatus, command: Command, id: u32) {
        self.stream.write_all(&status.encode(command, id)).unwrap();
    }
}

/// A motion's end, as seen by the worker.
fn wait_for_end(worker: &HandWorker) {
    let deadline = Instant::now() + TIMEOUT;
    while worker.is_moving() {
        assert!(Instant::now() < deadline, "the motion does not end");
        thread::yield_now();
    }
}

struct Checked {
    worker: HandWorker,
    hand: DrivenHand,
    phase: Phase,
}

impl Checked {
    /// The hand ends a running motion; it does nothing without one.
    fn end(&mut self, status: HandStatus) {
        if let Phase::Moving { id } = self.phase {
            assert!(self.worker.is_moving());
            self.hand.respond(status, Command::Move, id);
            wait_for_end(&self.worker);
            self.phase = Phase::Ended { is_reached: status == HandStatus::Success };
        }
    }

    fn turn(&mut self, turn: Turn) {
        match turn {
            Turn::Reach => self.end(HandStatus::Success),
            Turn::Miss => self.end(HandStatus::Unsuccessful),
            Turn::StopMotion => {
                self.worker.stop_motion();
                if let Phase::Moving { .. } = self.phase {
                    let (stop, request) = self.hand.request();
                    assert_eq!(request, HandRequest::Stop);
                    self.end(HandStatus::Aborted);
                    self.hand.respond(HandStatus::Success, Command::Stop, stop);
                }
            }
            Turn::Finish => {
                self.end(HandStatus::Success);
                assert_eq!(self.worker.finish().is_ok(), self.phase != Phase::Ended { is_reached: false });
                self.phase = Phase::Resting;
            }
            Turn::Start => {
                self.end(HandStatus::Success);
                let started = self.worker.start(HandCommand::Move { opening_m: 0.05, speed_m_s: 0.1 });
                // The failure of the last motion is reported instead of a new one.
                if self.phase == (Phase::Ended { is_reached: false }) {
                    assert!(started.is_err());
                    self.phase = Phase::Resting;
                } else {
                    started.unwrap();
                    // A hand at rest got no request to stop.
                    let (id, request) = self.hand.request();
                    assert_eq!(request, HandRequest::Move { width: 0.05, speed: 0.1 });
                    self.phase = Phase::Moving { id };
                }
            }
        }
    }
}

#[test]
fn every_schedule_reports_each_motion_once_and_stops_only_a_moving_hand() {
    let (worker, hand) = DrivenHand::connected();
    let mut checked = Checked { worker, hand, phase: Phase::Resting };
    let mut num_schedules = 0;
    for length in 1..=MAX_TURNS {
        for number in 0..5_usize.pow(length) {
            let schedule: Vec<Turn> = (0..length).map(|place| TURNS[number / 5_usize.pow(place) % 5]).collect();
            for turn in &schedule {
                checked.turn(*turn);
            }
            checked.turn(Turn::Finish);
            num_schedules += 1;
        }
    }
    assert_eq!(num_schedules, 3905);
    assert!(checked.hand.requests.try_recv().is_err());
}

#[test]
fn a_stop_ends_the_search_for_the_range_of_the_fingers() {
    let (mut worker, mut hand) = DrivenHand::connected();
    worker.start_homing().unwrap();
    let (id, request) = hand.request();
    assert_eq!(request, HandRequest::Homing);
    worker.stop_motion();
    let (stop, request) = hand.request();
    assert_eq!(request, HandRequest::Stop);
    hand.respond(HandStatus::Aborted, Command::Homing, id);
    hand.respond(HandStatus::Success, Command::Stop, stop);
    assert!(worker.finish().is_err());
}
