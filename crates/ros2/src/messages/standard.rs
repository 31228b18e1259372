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
        /// And nanoseconds.
        nanosec: u32,
    }
}

impl Copy for Time {}

impl Time {
    /// Of the system's clock; what a signed 32-bit count of seconds cannot say is its nearest end.
    pub fn from_system(time: SystemTime) -> Self {
        let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() }
    }

    /// Of the system's clock; `None` before 1970 and for nanoseconds that are no fraction of a second.
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
        /// When what follows was measured.
        stamp: Time,
        /// The frame that it is given in.
        frame_id: String,
    }
}

structure! {
    /// `std_srvs/srv/Trigger_Response`.
    TriggerResponse {
        /// Whether it was done.
        success: bool,
        /// What was done, or why not.
        message: String,
    }
}
