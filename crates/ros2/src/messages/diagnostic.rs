//! diagnostic_msgs.

use super::{Header, message, structure};

structure! {
    /// `diagnostic_msgs/msg/KeyValue`.
    KeyValue {
        /// Name.
        key: String,
        /// Value.
        value: String,
    }
}

structure! {
    /// `diagnostic_msgs/msg/DiagnosticStatus`.
    DiagnosticStatus {
        /// [`Self::OK`], [`Self::WARN`], [`Self::ERROR`] or [`Self::STALE`].
        level: u8,
        /// Name of the source.
        name: String,
        /// Text, one line.
        message: String,
        /// The device.
        hardware_id: String,
        /// Numbers.
        values: Vec<KeyValue>,
    }
}

impl DiagnosticStatus {
    /// No error.
    pub const OK: u8 = 0;
    /// It works with restrictions.
    pub const WARN: u8 = 1;
    /// It does not work.
    pub const ERROR: u8 = 2;
    /// No data are received.
    pub const STALE: u8 = 3;
}

message! { "diagnostic_msgs",
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    DiagnosticArray {
        /// Time.
        header: Header,
        /// The status of each part.
        status: Vec<DiagnosticStatus>,
    }
}
