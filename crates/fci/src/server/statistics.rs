//! What a server counts.

use std::time::Duration;

/// A cycle this much too late, by the computer's clock, is a stall.
pub const STALL: Duration = Duration::from_millis(20);

/// Counts since the server started.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ServerStatistics {
    /// States that were sent.
    pub num_states: u64,
    /// Cycles of motions, from the first command of each on.
    pub num_motion_cycles: u64,
    /// Commands that came in their own cycle.
    pub num_commands: u64,
    /// Commands that came too late.
    pub num_late: u64,
    /// Datagrams that are no commands.
    pub num_invalid: u64,
    /// Motions that were started.
    pub num_motions: u64,
    /// Cycles that began more than 20 ms too late.
    pub num_stalls: u64,
    /// The latest beginning of a cycle.
    pub max_lateness: Duration,
}
