//! Real-time scheduling of the control loop.

use crate::error::{Result, RobotError};

/// Scheduling of the loop that drives the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheduling {
    /// A thread with `SCHED_FIFO`, which has priority over all ordinary threads of this computer.
    RealTime,
    /// An ordinary thread, for simulated arms.
    Ordinary,
}

/// Checks in a short thread whether the kernel allows this process to use `SCHED_FIFO`.
///
/// # Errors
/// [`RobotError::NoRealTime`] with the remedy.
pub fn check_real_time() -> Result<()> {
    std::thread::spawn(enter).join().unwrap_or_else(|_| Err(refused("a thread that panicked")))
}

/// Gives the calling thread `SCHED_FIFO`, until it ends.
#[cfg(unix)]
pub(super) fn enter() -> Result<()> {
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    // The priority is below that of interrupt threads (50), because the packets arrive through them.
    const PRIORITY_SHARE: u8 = 40;
    let priority = ThreadPriorityValue::try_from(PRIORITY_SHARE).map_err(refused)?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), fifo)
        .map_err(|error| refused(format!("{error:?}")))
}

/// Returns an error, because other systems have no `SCHED_FIFO`.
#[cfg(not(unix))]
pub(super) fn enter() -> Result<()> {
    Err(refused("a system without it"))
}

fn refused(found: impl std::fmt::Display) -> RobotError {
    RobotError::NoRealTime { found: found.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_allows_it_or_says_what_is_missing() {
        match check_real_time() {
            Ok(()) => {}
            Err(error) => {
                let line = error.to_string();
                assert!(line.contains("SCHED_FIFO") && line.contains("rtprio"), "{line}");
            }
        }
        // The scheduling of this thread is unchanged.
        #[cfg(unix)]
        assert!(matches!(
            thread_priority::thread_schedule_policy().unwrap(),
            thread_priority::ThreadSchedulePolicy::Normal(_)
        ));
    }
}
