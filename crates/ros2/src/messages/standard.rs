//! Messages of builtin_interfaces, std_msgs and std_srvs.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::{Empty, structure};

/// `std_srvs/srv/Trigger_Request`.
pub type TriggerRequest = Empty;

structure! {
    /// `builtin_interfaces/msg/Time`: the time since 1970.
    Time {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds.
        nanosec: u32,
    }
}

impl Copy for Time {}

impl Time {
    /// Converts from the system's clock. Times before 1970 become 1970; the seconds are at most 2³¹ - 1.
    pub fn from_system(time: SystemTime) -> Self {
        let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() }
    }

    /// Converts to the system's clock; `None` before 1970 and for nanoseconds of a second or more.
    pub fn to_system(self) -> Option<SystemTime> {
        let sec = u64::try_from(self.sec).ok()?;
        (self.nanosec < 1_000_000_000).then(|| UNIX_EPOCH + Duration::new(sec, self.nanosec))
    }

    /// The time in seconds since 1970.
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
        /// Whether the service succeeded.
        success: bool,
        /// A description of the result, or the reason for the failure.
        message: String,
    }
}
