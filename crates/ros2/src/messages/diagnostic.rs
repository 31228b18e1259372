//! diagnostic_msgs.

use super::{Header, message, structure};

structure! {
    /// `diagnostic_msgs/msg/KeyValue`.
    KeyValue {
        /// What.
        key: String,
        /// How much.
        value: String,
    }
}

structure! {
    /// `diagnostic_msgs/msg/DiagnosticStatus`.
    DiagnosticStatus {
        /// [`Self::OK`], [`Self::WARN`], [`Self::ERROR`] or [`Self::STALE`].
        level: u8,
        /// Who says it.
        name: String,
        /// In a line.
        message: String,
        /// The device.
        hardware_id: String,
        /// Numbers.
        values: Vec<KeyValue>,
    }
}

impl DiagnosticStatus {
    /// Nothing is wrong.
    pub const OK: u8 = 0;
    /// It works, but not as it should.
    pub const WARN: u8 = 1;
    /// It does not work.
    pub const ERROR: u8 = 2;
    /// Nothing is heard.
    pub const STALE: u8 = 3;
}

message! { "diagnostic_msgs",
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    DiagnosticArray {
        /// When.
        header: Header,
        /// Of each part.
        status: Vec<DiagnosticStatus>,
    }
}
