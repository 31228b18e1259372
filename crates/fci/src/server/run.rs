//! The server's loop: a thousand cycles per second, or one per answer of the client.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::config::{Pace, ServerConfig};
use super::hand::HandCore;
use super::link::{Incoming, Link};
use super::plant::Plant;
use super::robot::RobotCore;
use super::statistics::{STALL, ServerStatistics};
use crate::error::{FciError, Result};
use crate::wire::{
    COMMAND_SIZE_V5, Command, HAND_VERSION, HandCommand, HandRequest, HandStatus, Header, HeaderKind, Request,
    RobotCommand, Status, Version,
};

/// The server's protocol version.
const VERSION: Version = Version::V5;
/// Duration of a cycle.
const PERIOD: Duration = Duration::from_millis(1);
/// Maximum numbers of requests and of datagrams that are handled before the loop checks the clock: a client that floods
/// the server does not stop the arm's control.
const MAX_REQUESTS: usize = 64;
const MAX_COMMANDS: usize = 64;
/// Interval of the hand's states, in cycles.
const HAND_STATE_CYCLES: u64 = 20;
/// In lockstep, maximum wait for an answer at the start of a motion: libfranka leaves the first one or two states
/// unanswered.
const START_WAIT: Duration = Duration::from_millis(50);

/// Data shared by the server's owner and its loop.
#[derive(Debug, Default)]
struct Shared {
    is_stopping: AtomicBool,
    hand_fails: AtomicBool,
    statistics: Mutex<ServerStatistics>,
}

/// A simulated robot on the network. Dropping it ends the server.
#[derive(Debug)]
pub struct Server {
    robot_address: SocketAddr,
    hand_address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Result<()>>>,
}

impl Server {
    /// Serves a plant.
    ///
    /// # Errors
    /// [`FciError::Socket`], for example if the ports are in use.
    pub fn start(plant: impl Plant + 'static, config: &ServerConfig) -> Result<Self> {
        let robot_link = Link::listen(config.ip, config.robot_port, HeaderKind::Robot)?;
        let hand_link = Link::listen(config.ip, config.hand_port, HeaderKind::Hand)?;
        let (robot_address, hand_address) = (robot_link.address(), hand_link.address());
        if let Pace::Lockstep { .. } = config.pace {
            robot_link.set_waiting(true)?;
        }
        let shared = Arc::new(Shared::default());
        let (config, loop_shared) = (*config, shared.clone());
        let thread = thread::Builder::new()
            .name("fci server".into())
            .spawn(move || Loop::new(Box::new(plant), robot_link, hand_link, config, loop_shared).run())
            .map_err(|source| FciError::Socket {
                action: "start a thread for",
                address: robot_address.to_string(),
                source,
            })?;
        Ok(Self { robot_address, hand_address, shared, thread: Some(thread) })
    }

    /// The robot's address.
    pub fn robot_address(&self) -> SocketAddr {
        self.robot_address
    }

    /// The hand's address.
    pub fn hand_address(&self) -> SocketAddr {
        self.hand_address
    }

    /// The counters.
    pub fn statistics(&self) -> ServerStatistics {
        *self.shared.statistics.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the hand fail like a defective one, or work again, for tests of clients.
    pub fn set_hand_failing(&self, fails: bool) {
        self.shared.hand_fails.store(fails, Ordering::Relaxed);
    }

    /// Whether the server's loop still runs.
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Ends the server.
    ///
    /// # Errors
    /// [`FciError::Plant`] if the simulation failed.
    pub fn stop(mut self) -> Result<()> {
        self.end()
    }

    fn end(&mut self) -> Result<()> {
        self.shared.is_stopping.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(FciError::Plant("its thread panicked".into())),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // A caller that needs the result calls `stop`.
        let _ = self.end();
    }
}

struct Loop {
    plant: Box<dyn Plant>,
    robot: RobotCore,
    hand: HandCore,
    robot_link: Link,
    hand_link: Link,
    config: ServerConfig,
    shared: Arc<Shared>,
    statistics: ServerStatistics,
    next_cycle: Instant,
}

impl Loop {
    fn new(
        mut plant: Box<dyn Plant>,
        robot_link: Link,
        hand_link: Link,
        config: ServerConfig,
        shared: Arc<Shared>,
    ) -> Self {
        let robot = RobotCore::new(plant.as_mut(), config.limits);
        Self {
            plant,
            robot,
            hand: HandCore::default(),
            robot_link,
            hand_link,
            config,
            shared,
            statistics: ServerStatistics::default(),
            next_cycle: Instant::now() + PERIOD,
        }
    }

    fn run(mut self) -> Result<()> {
        while !self.shared.is_stopping.load(Ordering::Relaxed) {
            let command = match self.config.pace {
                Pace::RealTime => {
                    self.sleep();
                    self.serve_requests();
                    self.receive_command()
                }
                Pace::Lockstep { max_wait } => self.await_command(max_wait),
            };
            self.cycle(command.as_ref())?;
            self.publish();
        }
        Ok(())
    }

    /// Advances robot and hand by a millisecond.
    fn cycle(&mut self, command: Option<&RobotCommand>) -> Result<()> {
        self.hand.set_failing(self.shared.hand_fails.load(Ordering::Relaxed));
        if command.is_some() || self.robot.expects_commands() == Some(true) {
            self.statistics.num_motion_cycles += 1;
            self.statistics.num_commands += u64::from(command.is_some());
        }
        let is_frozen = self.config.pace != Pace::RealTime && self.robot.is_settled() && !self.hand.is_busy();
        if is_frozen {
            self.robot.tick_clock();
        } else {
            self.robot.cycle(self.plant.as_mut(), command).map_err(FciError::Plant)?;
            self.hand.cycle(self.plant.as_mut());
        }
        Ok(())
    }

    /// Sends responses and states.
    fn publish(&mut self) {
        for outgoing in self.robot.take_responses() {
            let (command, response) = (outgoing.command, outgoing.response);
            let numbers = (command.number(VERSION), response.status.number(command, VERSION));
            if let (Some(number), Some(status)) = numbers {
                let payload = [&[status][..], &response.rest].concat();
                self.robot_link.respond(&Header::message(HeaderKind::Robot, number, outgoing.command_id, &payload));
            }
        }
        for outgoing in self.hand.take_responses() {
            self.hand_link.respond(&outgoing.status.encode(outgoing.command, outgoing.command_id));
        }
        if self.robot_link.is_open() {
            self.robot_link.send_state(&self.robot.state(self.plant.as_ref()).encode(VERSION));
            self.statistics.num_states += 1;
        }
        if self.hand_link.is_open() && self.robot.time_ms().is_multiple_of(HAND_STATE_CYCLES) {
            self.hand_link.send_state(&self.hand.state(self.plant.as_ref()).encode());
        }
        *self.shared.statistics.lock().unwrap_or_else(PoisonError::into_inner) = self.statistics;
    }

    /// Waits for the start of the next millisecond; later cycles do not compensate a delay.
    fn sleep(&mut self) {
        let now = Instant::now();
        if now < self.next_cycle {
            thread::sleep(self.next_cycle - now);
        }
        let lateness = Instant::now().saturating_duration_since(self.next_cycle);
        self.statistics.max_lateness = self.statistics.max_lateness.max(lateness);
        self.statistics.num_stalls += u64::from(lateness > STALL);
        self.next_cycle += PERIOD;
        if lateness > PERIOD {
            self.next_cycle = Instant::now() + PERIOD;
        }
    }

    /// During a motion, waits for the answer to the last state. Without a motion, waits for the clock if nothing moves.
    fn await_command(&mut self, max_wait: Duration) -> Option<RobotCommand> {
        self.serve_requests();
        let Some(has_started) = self.robot.expects_commands() else {
            if self.robot.is_settled() && !self.hand.is_busy() {
                self.sleep();
            }
            return None;
        };
        let deadline = Instant::now() + if has_started { max_wait } else { START_WAIT };
        loop {
            if let Some(command) = self.receive_command() {
                return Some(command);
            }
            self.serve_requests();
            let is_over = self.robot.expects_commands().is_none() || Instant::now() >= deadline;
            if is_over || self.shared.is_stopping.load(Ordering::Relaxed) {
                return None;
            }
        }
    }

    /// The answer to the last state among the received messages.
    fn receive_command(&mut self) -> Option<RobotCommand> {
        // One byte more than a command, to detect datagrams that are too long.
        let mut buffer = [0; COMMAND_SIZE_V5 + 1];
        for _ in 0..MAX_COMMANDS {
            let length = self.robot_link.receive(&mut buffer)?;
            match RobotCommand::decode(&buffer[..length], VERSION) {
                Ok(command) if command.message_id == self.robot.time_ms() => return Some(command),
                Ok(_) => self.statistics.num_late += u64::from(self.robot.expects_commands().is_some()),
                Err(_) => self.statistics.num_invalid += 1,
            }
        }
        None
    }

    fn serve_requests(&mut self) {
        for _ in 0..MAX_REQUESTS {
            let Some(incoming) = self.robot_link.poll() else { break };
            match incoming {
                Incoming::Gone => self.robot.disconnect(),
                Incoming::Request(header, payload) => self.serve_robot_request(&header, &payload),
            }
        }
        for _ in 0..MAX_REQUESTS {
            let Some(incoming) = self.hand_link.poll() else { break };
            match incoming {
                Incoming::Gone => self.hand.disconnect(self.plant.as_mut()),
                Incoming::Request(header, payload) => self.serve_hand_request(&header, &payload),
            }
        }
    }

    fn serve_robot_request(&mut self, header: &Header, payload: &[u8]) {
        match (Request::decode(header, payload, VERSION), self.robot_link.is_open()) {
            (Ok(Request::Connect { version, udp_port }), false) => {
                let is_same = version == VERSION.number();
                let status = if is_same { Status::Success } else { Status::IncompatibleVersion };
                let status = status.number(Command::Connect, VERSION).unwrap_or_default();
                let payload = [&[status][..], &VERSION.number().to_le_bytes()].concat();
                let response = Header::message(HeaderKind::Robot, header.command, header.command_id, &payload);
                self.robot_link.respond(&response);
                if is_same {
                    self.robot_link.open_udp(udp_port);
                } else {
                    self.robot_link.close();
                }
            }
            (Ok(request), true) => {
                self.statistics.num_motions += u64::from(request.command() == Command::Move);
                self.robot.request(self.plant.as_ref(), header.command_id, &request);
            }
            // A client with an invalid request, or a request before Connect, uses another protocol.
            (Err(_), _) | (Ok(_), false) => {
                self.robot_link.close();
                self.robot.disconnect();
            }
        }
    }

    fn serve_hand_request(&mut self, header: &Header, payload: &[u8]) {
        match (HandRequest::decode(header, payload), self.hand_link.is_open()) {
            (Ok(HandRequest::Connect { version, udp_port }), false) => {
                // Status 1 means another version for Connect, and a failure for other commands.
                let status = if version == HAND_VERSION { HandStatus::Success } else { HandStatus::Fail };
                self.hand_link.respond(&status.encode(HandCommand::Connect, header.command_id));
                if status == HandStatus::Success {
                    self.hand_link.open_udp(udp_port);
                } else {
                    self.hand_link.close();
                }
            }
            (Ok(request), true) => self.hand.request(self.plant.as_mut(), header.command_id, &request),
            (Err(_), _) | (Ok(_), false) => {
                self.hand_link.close();
                self.hand.disconnect(self.plant.as_mut());
            }
        }
    }
}
