//! The server's counters.

use std::time::Duration;

/// Largest delay of a cycle, by the computer's clock, that is not a stall.
pub const STALL: Duration = Duration::from_millis(20);

/// Counts since the server started.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ServerStatistics {
    /// Number of states that were sent to clients, one for each cycle with a connected client.
    pub num_states: u64,
    /// Number of cycles within motions, from the first command of each motion on.
    pub num_motion_cycles: u64,
    /// Number of commands that arrived in the cycle whose number they carry.
    pub num_commands: u64,
    /// Number of commands of a motion that carry the number of another cycle, usually because they arrived too late.
    pub num_late: u64,
    /// Number of datagrams that are not commands.
    pub num_invalid: u64,
    /// Number of requests to start a motion, including refused ones.
    pub num_motions: u64,
    /// Number of cycles that started more than 20 ms too late.
    pub num_stalls: u64,
    /// The largest delay of a cycle's start.
    pub max_lateness: Duration,
}
