//! Real-time scheduling of the control loop.

use crate::error::{Result, RobotError};

/// Scheduling of the loop that drives the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheduling {
    /// As a thread with `SCHED_FIFO`, with priority over everything else on this computer.
    RealTime,
    /// As any other thread: for simulated arms.
    Ordinary,
}

/// Whether the kernel allows this process to run threads with `SCHED_FIFO`; tried in a short thread.
///
/// # Errors
/// [`RobotError::Configuration`] with the remedy.
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
    // No higher priority than that of interrupt threads (50) is needed: the packets come through them.
    const PRIORITY_SHARE: u8 = 40;
    let priority = ThreadPriorityValue::try_from(PRIORITY_SHARE).map_err(refused)?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), fifo)
        .map_err(|error| refused(format!("{error:?}")))
}

/// Other systems have no such scheduling.
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
