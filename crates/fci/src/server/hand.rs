//! The simulated hand: it takes requests and returns responses and states, cycle by cycle. It has no socket and no
//! clock.

use super::plant::Plant;
use super::reference::PERIOD_SECS;
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
/// Fingers have stopped if they are slower than this for [`STANDING_CYCLES`] and do not follow the commanded motion.
const STANDING_M_S: f64 = 2e-3;
const STANDING_CYCLES: u32 = 100;
/// Largest difference between the width and the commanded motion of fingers that follow it. The simulated fingers
/// follow a motion slower than [`STANDING_M_S`] within micrometres.
const FOLLOWING_M: f64 = 2e-4;
/// Maximum number of cycles of a motion, if the commanded motion is over.
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
    Move,
    Grasp { range: (f64, f64) },
}

/// A commanded motion of the width, m and m/s.
#[derive(Debug, Clone, Copy)]
struct Motion {
    from: f64,
    to: f64,
    speed: f64,
    num_cycles: u32,
}

impl Motion {
    fn start(plant: &mut dyn Plant, to: f64, speed: f64, force: f64) -> Self {
        let speed = speed.min(MAX_SPEED_M_S);
        plant.move_hand(to, speed, force);
        Self { from: plant.hand_width().0, to, speed, num_cycles: 0 }
    }

    fn moved(&self) -> f64 {
        self.speed * PERIOD_SECS * f64::from(self.num_cycles)
    }

    fn is_over(&self) -> bool {
        self.moved() >= (self.to - self.from).abs()
    }

    /// Whether fingers at a width follow the motion, that is, nothing blocks them and the motion continues.
    fn is_followed(&self, width: f64) -> bool {
        let commanded = self.from + (self.to - self.from).clamp(-self.moved(), self.moved());
        !self.is_over() && (commanded - width).abs() < FOLLOWING_M
    }
}

#[derive(Debug, Clone, Copy)]
struct Running {
    command_id: u32,
    command: HandCommand,
    task: Task,
    motion: Motion,
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
        let started = match *request {
            _ if self.fails => None,
            HandRequest::Homing => {
                let motion = Motion::start(plant, PRESSING_WIDTH_M, HOMING_SPEED_M_S, MOVING_FORCE_N);
                Some((Task::HomingClose, motion))
            }
            HandRequest::Move { width, speed } if (0.0..=HAND_MAX_WIDTH_M).contains(&width) && is_speed(speed) => {
                Some((Task::Move, Motion::start(plant, width, speed, MOVING_FORCE_N)))
            }
            HandRequest::Grasp { width, epsilon_inner, epsilon_outer, speed, force }
                if (0.0..=HAND_MAX_WIDTH_M).contains(&width)
                    && is_speed(speed)
                    && (0.0..=2.0 * MAX_FORCE_N).contains(&force)
                    && epsilon_inner >= 0.0
                    && epsilon_outer >= 0.0 =>
            {
                let motion = Motion::start(plant, PRESSING_WIDTH_M, speed, force.min(MAX_FORCE_N));
                Some((Task::Grasp { range: (width - epsilon_inner, width + epsilon_outer) }, motion))
            }
            HandRequest::Stop => {
                plant.move_hand(plant.hand_width().0, MAX_SPEED_M_S, MOVING_FORCE_N);
                self.respond(command_id, command, HandStatus::Success);
                return;
            }
            _ => None,
        };
        match started {
            Some((task, motion)) => {
                self.running = Some(Running { command_id, command, task, motion, num_standing: 0 });
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
        running.motion.num_cycles += 1;
        running.num_standing = if speed.abs() < STANDING_M_S { running.num_standing + 1 } else { 0 };
        self.running = Some(running);
        let motion = running.motion;
        let is_standing = running.num_standing >= STANDING_CYCLES && !motion.is_followed(width);
        let is_reached = |target: f64| (width - target).abs() < WIDTH_TOLERANCE_M;
        let status = match running.task {
            _ if self.fails || (motion.num_cycles > MAX_CYCLES && motion.is_over()) => HandStatus::Fail,
            Task::Move if is_reached(motion.to) && speed.abs() < 10.0 * STANDING_M_S => HandStatus::Success,
            _ if !is_standing => return,
            Task::HomingClose => {
                let motion = Motion::start(plant, HAND_MAX_WIDTH_M, HOMING_SPEED_M_S, MOVING_FORCE_N);
                self.running = Some(Running { task: Task::HomingOpen, motion, num_standing: 0, ..running });
                return;
            }
            Task::HomingOpen if is_reached(HAND_MAX_WIDTH_M) => HandStatus::Success,
            Task::HomingOpen => HandStatus::Fail,
            Task::Move => HandStatus::Unsuccessful,
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

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::server::plant::{Jacobian, JointVector, Observation};

    /// Fingers that follow every motion, down to the width of the object between them.
    struct Fingers {
        width: f64,
        object: f64,
        command: (f64, f64),
        rate: f64,
    }

    impl Fingers {
        fn around(object: f64) -> Self {
            Self { width: HAND_MAX_WIDTH_M, object, command: (HAND_MAX_WIDTH_M, 1.0), rate: 0.0 }
        }
    }

    impl Plant for Fingers {
        fn observe(&mut self) -> Observation {
            unreachable!("the hand does not observe the arm")
        }

        fn flange(&self, _: &JointVector) -> (Isometry3<f64>, Jacobian) {
            unreachable!("the hand has no flange")
        }

        fn step(&mut self, _: &JointVector) -> Result<(), String> {
            let (to, speed) = self.command;
            let step = (to - self.width).clamp(-speed * PERIOD_SECS, speed * PERIOD_SECS);
            let width = (self.width + step).max(self.object.min(self.width));
            self.rate = (width - self.width) / PERIOD_SECS;
            self.width = width;
            Ok(())
        }

        fn move_hand(&mut self, width_m: f64, speed_m_s: f64, _: f64) {
            self.command = (width_m, speed_m_s);
        }

        fn hand_width(&self) -> (f64, f64) {
            (self.width, self.rate)
        }
    }

    /// The response to a request, the seconds until then, the final width, and whether the hand reports a grasped part.
    fn run(mut plant: Fingers, request: &HandRequest) -> (HandStatus, f64, f64, bool) {
        let mut hand = HandCore::default();
        hand.request(&mut plant, 1, request);
        for cycle in 1..200_000 {
            plant.step(&JointVector::zeros()).unwrap();
            hand.cycle(&mut plant);
            if let Some(response) = hand.take_responses().first() {
                let secs = PERIOD_SECS * f64::from(cycle);
                return (response.status, secs, plant.width, hand.state(&plant).is_grasped);
            }
        }
        panic!("no response to {request:?}");
    }

    #[test]
    fn a_slow_motion_goes_on_until_its_width() {
        let (status, secs, width, _) = run(Fingers::around(0.0), &HandRequest::Move { width: 0.02, speed: 0.001 });
        assert_eq!(status, HandStatus::Success);
        // 60 mm with a tolerance of 1 mm.
        assert!((58.9..60.1).contains(&secs) && (width - 0.02).abs() < 1.1e-3, "{secs} s, {width} m");
        let blocked = run(Fingers::around(0.05), &HandRequest::Move { width: 0.02, speed: 0.001 });
        assert!(blocked.0 == HandStatus::Unsuccessful && blocked.1 < 31.0, "{blocked:?}");
    }

    #[test]
    fn a_slow_hand_holds_nothing_before_it_has_closed_on_a_part() {
        let grasp =
            HandRequest::Grasp { width: 0.075, epsilon_inner: 0.005, epsilon_outer: 0.005, speed: 0.001, force: 20.0 };
        let (status, _, width, is_grasped) = run(Fingers::around(0.0), &grasp);
        assert_eq!((status, is_grasped), (HandStatus::Unsuccessful, false));
        assert!(width.abs() < 1e-6, "{width}");
        let (status, secs, width, is_grasped) = run(Fingers::around(0.075), &grasp);
        assert_eq!((status, is_grasped), (HandStatus::Success, true));
        assert!((5.0..6.0).contains(&secs) && (width - 0.075).abs() < 1e-6, "{secs} s, {width} m");
    }
}
