//! Runs the blocking calls of the hand in a thread, in parallel with the arm's loop.

use std::thread::JoinHandle;

use sdg_fci::client::{Hand, HandStopHandle};

use crate::arm_state::{HandCommand, HandState, held_widths_m};
use crate::error::{Result, RobotError};
use crate::robot_address::RobotAddress;

/// A hand at rest, or one that moves in a thread.
#[derive(Debug)]
pub(super) struct HandWorker {
    hand: Option<Hand>,
    running: Option<JoinHandle<(Hand, Result<()>)>>,
    stop: HandStopHandle,
}

impl HandWorker {
    pub(super) fn new(hand: Hand) -> Self {
        Self { stop: hand.stop_handle(), hand: Some(hand), running: None }
    }

    /// Waits for a running motion, then starts another.
    pub(super) fn start(&mut self, command: HandCommand) -> Result<()> {
        self.spawn(move |hand| execute(hand, command))
    }

    /// As [`Self::start`], for the motion that finds the fingers' range.
    pub(super) fn start_homing(&mut self) -> Result<()> {
        self.spawn(|hand| match hand.homing() {
            Ok(true) => Ok(()),
            Ok(false) => Err(RobotError::Hand("it did not find its range".to_owned())),
            Err(error) => Err(RobotError::Hand(error.to_string())),
        })
    }

    fn spawn(&mut self, motion: impl FnOnce(&mut Hand) -> Result<()> + Send + 'static) -> Result<()> {
        self.finish()?;
        let mut hand = self.hand.take().ok_or_else(gone)?;
        self.running = Some(std::thread::spawn(move || {
            let done = motion(&mut hand);
            (hand, done)
        }));
        Ok(())
    }

    pub(super) fn is_moving(&self) -> bool {
        self.running.as_ref().is_some_and(|running| !running.is_finished())
    }

    /// Stops the fingers if they move; a hand at rest keeps holding its part.
    pub(super) fn stop_motion(&self) {
        if self.is_moving() {
            self.stop();
        }
    }

    /// Waits for the running motion.
    pub(super) fn finish(&mut self) -> Result<()> {
        let Some(running) = self.running.take() else { return Ok(()) };
        let (hand, done) = running.join().map_err(|_| gone())?;
        self.hand = Some(hand);
        done
    }

    /// Stops the fingers; a call that waits for them returns.
    fn stop(&self) {
        // An error means that the hand is disconnected; this program cannot stop it then.
        let _ = self.stop.stop();
    }

    pub(super) fn state(&mut self, address: &RobotAddress) -> Result<HandState> {
        self.finish()?;
        let state = self.hand.as_mut().ok_or_else(gone)?.read_state().map_err(|error| address.lost("hand", &error))?;
        Ok(HandState { opening_m: state.width, is_grasping: state.is_grasped, force_n: None })
    }
}

fn gone() -> RobotError {
    RobotError::Hand("an earlier motion of the hand failed".to_owned())
}

fn execute(hand: &mut Hand, command: HandCommand) -> Result<()> {
    let failed = |error: sdg_fci::FciError| RobotError::Hand(error.to_string());
    match command {
        HandCommand::Move { opening_m, speed_m_s } => match hand.move_to(opening_m, speed_m_s).map_err(failed)? {
            true => Ok(()),
            false => Err(RobotError::Hand(format!("it did not reach {:.0} mm", opening_m * 1e3))),
        },
        HandCommand::Grasp { width_m, tolerance_m, speed_m_s, force_n } => {
            let held_m = held_widths_m(width_m, tolerance_m);
            let (thinner_m, wider_m) = ((width_m - held_m.start()).max(0.0), held_m.end() - width_m);
            // Closing without a part is not a failure of the hand; its width shows that it holds nothing.
            hand.grasp(width_m, speed_m_s, force_n, thinner_m, wider_m).map(drop).map_err(failed)
        }
    }
}

#[cfg(test)]
mod schedules;
