//! The two versions of the robot's protocol.

use super::codec::Real;

/// A version of the robot's protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// 5: Panda (libfranka 0.9).
    V5,
    /// 10: FR3 (libfranka 0.18 and later).
    V10,
}

impl Version {
    /// The number in Connect.
    pub const fn number(self) -> u16 {
        match self {
            Version::V5 => 5,
            Version::V10 => 10,
        }
    }

    /// The version with a number; `None` for an unsupported one.
    pub const fn from_number(number: u16) -> Option<Self> {
        match number {
            5 => Some(Version::V5),
            10 => Some(Version::V10),
            _ => None,
        }
    }

    /// The precision of the numbers in a state.
    pub(crate) const fn state_real(self) -> Real {
        match self {
            Version::V5 => Real::F64,
            Version::V10 => Real::F32,
        }
    }
}
