//! Real-time scheduling of the control loop.

use crate::error::{Result, RobotError};

/// How the loop that drives the arm is scheduled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheduling {
    /// As a thread with `SCHED_FIFO`, before everything else on this computer.
    RealTime,
    /// As any other thread: for simulated arms.
    Ordinary,
}

/// Whether the kernel lets this process run threads with `SCHED_FIFO`; tried in a thread that ends at once.
///
/// # Errors
/// [`RobotError::Configuration`] with what to do.
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
    // Above interrupts' threads (50) nothing needs to be: the packets come through them.
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
        // This thread is scheduled as before.
        #[cfg(unix)]
        assert!(matches!(
            thread_priority::thread_schedule_policy().unwrap(),
            thread_priority::ThreadSchedulePolicy::Normal(_)
        ));
    }
}
