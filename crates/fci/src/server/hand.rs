//! The simulated hand: it takes requests and returns responses and states, cycle by cycle. It has no socket and no
//! clock.

use super::plant::Plant;
use crate::wire::{HandCommand, HandRequest, HandState, HandStatus};

/// Largest width of Franka's hand, m.
pub const HAND_MAX_WIDTH_M: f64 = 0.08;
/// Largest speed of Franka's hand.
const MAX_SPEED_M_S: f64 = 0.1;
const MAX_FORCE_N: f64 = 70.0;
/// Force of the fingers in motions without a grasp.
const MOVING_FORCE_N: f64 = 30.0;
/// Largest difference between the commanded width and a width that counts as reached.
const WIDTH_TOLERANCE_M: f64 = 1e-3;
/// Fingers have stopped if they are slower than this for [`STANDING_CYCLES`].
const STANDING_M_S: f64 = 2e-3;
const STANDING_CYCLES: u32 = 100;
/// Maximum number of cycles of a motion.
const MAX_CYCLES: u32 = 20_000;
/// Speed of homing.
const HOMING_SPEED_M_S: f64 = 0.05;
/// Target width of closing fingers, so far below zero that they press on any object.
const PRESSING_WIDTH_M: f64 = -0.03;
/// Reported temperature of the hand, °C.
const TEMPERATURE: u16 = 30;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Task {
    HomingClose,
    HomingOpen,
    Move { width: f64 },
    Grasp { range: (f64, f64) },
}

#[derive(Debug, Clone, Copy)]
struct Running {
    command_id: u32,
    command: HandCommand,
    task: Task,
    num_cycles: u32,
    num_standing: u32,
}

/// A response to be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HandOutgoing {
    /// Number of the request.
    pub command_id: u32,
    /// The request's command.
    pub command: HandCommand,
    /// The response.
    pub status: HandStatus,
}

/// A hand and its present action.
#[derive(Debug, Default)]
pub struct HandCore {
    running: Option<Running>,
    /// Smallest and largest width at which the last grasp holds a part, m.
    grasped: Option<(f64, f64)>,
    time_ms: u32,
    fails: bool,
    outbox: Vec<HandOutgoing>,
}

impl HandCore {
    /// Makes the hand fail from now on like a defective one, or work again.
    pub fn set_failing(&mut self, fails: bool) {
        self.fails = fails;
    }

    /// Removes and returns the responses that are due.
    pub fn take_responses(&mut self) -> Vec<HandOutgoing> {
        std::mem::take(&mut self.outbox)
    }

    /// Whether the fingers move for a client.
    pub fn is_busy(&self) -> bool {
        self.running.is_some()
    }

    /// Starts a client's request (except Connect) and aborts the previous one.
    pub fn request(&mut self, plant: &mut dyn Plant, command_id: u32, request: &HandRequest) {
        let command = request.command();
        if let Some(running) = self.running.take() {
            self.respond(running.command_id, running.command, HandStatus::Aborted);
        }
        self.grasped = None;
        let is_speed = |speed: f64| speed > 0.0 && speed.is_finite();
        let task = match *request {
            _ if self.fails => None,
            HandRequest::Homing => {
                plant.move_hand(PRESSING_WIDTH_M, HOMING_SPEED_M_S, MOVING_FORCE_N);
                Some(Task::HomingClose)
            }
            HandRequest::Move { width, speed } if (0.0..=HAND_MAX_WIDTH_M).contains(&width) && is_speed(speed) => {
                plant.move_hand(width, speed.min(MAX_SPEED_M_S), MOVING_FORCE_N);
                Some(Task::Move { width })
            }
            HandRequest::Grasp { width, epsilon_inner, epsilon_outer, speed, force }
                if (0.0..=HAND_MAX_WIDTH_M).contains(&width)
                    && is_speed(speed)
                    && (0.0..=2.0 * MAX_FORCE_N).contains(&force)
                    && epsilon_inner >= 0.0
                    && epsilon_outer >= 0.0 =>
            {
                plant.move_hand(PRESSING_WIDTH_M, speed.min(MAX_SPEED_M_S), force.min(MAX_FORCE_N));
                Some(Task::Grasp { range: (width - epsilon_inner, width + epsilon_outer) })
            }
            HandRequest::Stop => {
                plant.move_hand(plant.hand_width().0, MAX_SPEED_M_S, MOVING_FORCE_N);
                self.respond(command_id, command, HandStatus::Success);
                return;
            }
            _ => None,
        };
        match task {
            Some(task) => {
                self.running = Some(Running { command_id, command, task, num_cycles: 0, num_standing: 0 });
            }
            None => self.respond(command_id, command, HandStatus::Fail),
        }
    }

    /// Stops the fingers because the client is disconnected.
    pub fn disconnect(&mut self, plant: &mut dyn Plant) {
        if self.running.take().is_some() {
            plant.move_hand(plant.hand_width().0, MAX_SPEED_M_S, MOVING_FORCE_N);
        }
        self.outbox.clear();
    }

    /// Checks the fingers after a millisecond.
    pub fn cycle(&mut self, plant: &mut dyn Plant) {
        self.time_ms = self.time_ms.wrapping_add(1);
        let (width, speed) = plant.hand_width();
        if self.grasped.is_some_and(|(narrowest, widest)| !(narrowest < width && width < widest)) {
            self.grasped = None;
        }
        let Some(mut running) = self.running else { return };
        running.num_cycles += 1;
        running.num_standing = if speed.abs() < STANDING_M_S { running.num_standing + 1 } else { 0 };
        self.running = Some(running);
        let is_standing = running.num_standing >= STANDING_CYCLES;
        let is_reached = |target: f64| (width - target).abs() < WIDTH_TOLERANCE_M;
        let status = match running.task {
            _ if self.fails || running.num_cycles > MAX_CYCLES => HandStatus::Fail,
            Task::Move { width: target } if is_reached(target) && speed.abs() < 10.0 * STANDING_M_S => {
                HandStatus::Success
            }
            _ if !is_standing => return,
            Task::HomingClose => {
                plant.move_hand(HAND_MAX_WIDTH_M, HOMING_SPEED_M_S, MOVING_FORCE_N);
                self.running = Some(Running { task: Task::HomingOpen, num_standing: 0, ..running });
                return;
            }
            Task::HomingOpen if is_reached(HAND_MAX_WIDTH_M) => HandStatus::Success,
            Task::HomingOpen => HandStatus::Fail,
            Task::Move { .. } => HandStatus::Unsuccessful,
            Task::Grasp { range: (narrowest, widest) } if narrowest < width && width < widest => {
                self.grasped = Some((narrowest, widest));
                HandStatus::Success
            }
            Task::Grasp { .. } => HandStatus::Unsuccessful,
        };
        self.running = None;
        self.respond(running.command_id, running.command, status);
    }

    /// The present state.
    pub fn state(&self, plant: &dyn Plant) -> HandState {
        HandState {
            message_id: self.time_ms,
            width: plant.hand_width().0,
            max_width: HAND_MAX_WIDTH_M,
            is_grasped: self.grasped.is_some(),
            temperature: TEMPERATURE,
        }
    }

    fn respond(&mut self, command_id: u32, command: HandCommand, status: HandStatus) {
        self.outbox.push(HandOutgoing { command_id, command, status });
    }
}
