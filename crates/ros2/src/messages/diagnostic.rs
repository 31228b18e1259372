//! Messages of diagnostic_msgs.

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
        /// A text of one line.
        message: String,
        /// Identifier of the device.
        hardware_id: String,
        /// Further values.
        values: Vec<KeyValue>,
    }
}

impl DiagnosticStatus {
    /// No error.
    pub const OK: u8 = 0;
    /// The source works with restrictions.
    pub const WARN: u8 = 1;
    /// The source does not work.
    pub const ERROR: u8 = 2;
    /// No data is received.
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
