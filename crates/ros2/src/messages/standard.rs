//! builtin_interfaces, std_msgs, std_srvs.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::{Empty, structure};

/// `std_srvs/srv/Trigger_Request`.
pub type TriggerRequest = Empty;

structure! {
    /// `builtin_interfaces/msg/Time`: since 1970.
    Time {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds.
        nanosec: u32,
    }
}

impl Copy for Time {}

impl Time {
    /// From the system's clock; clamped to the range of a signed 32-bit count of seconds.
    pub fn from_system(time: SystemTime) -> Self {
        let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() }
    }

    /// To the system's clock; `None` before 1970 and for nanoseconds of a second or more.
    pub fn to_system(self) -> Option<SystemTime> {
        let sec = u64::try_from(self.sec).ok()?;
        (self.nanosec < 1_000_000_000).then(|| UNIX_EPOCH + Duration::new(sec, self.nanosec))
    }

    /// Seconds since 1970.
    pub fn secs(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

structure! {
    /// `std_msgs/msg/Header`.
    Header {
        /// Time of the measurement.
        stamp: Time,
        /// Frame of the data.
        frame_id: String,
    }
}

structure! {
    /// `std_srvs/srv/Trigger_Response`.
    TriggerResponse {
        /// Whether it was done.
        success: bool,
        /// The action, or the reason for its failure.
        message: String,
    }
}
