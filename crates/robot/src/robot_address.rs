//! The network address of a robot.

use std::fmt;
use std::str::FromStr;

use sdg_fci::FciError;

use crate::error::RobotError;

/// Default port of the arm.
const ROBOT_PORT: u16 = 1337;

/// `HOST` or `HOST:PORT`; the hand is on the next port, as in Franka's convention.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotAddress {
    /// Name or IP address.
    pub host: String,
    /// TCP port of the arm.
    pub port: u16,
    /// TCP port of the hand.
    pub hand_port: u16,
}

impl RobotAddress {
    /// The error for a device at this address, such as `robot` or `hand`, that does not accept connections.
    pub(crate) fn refused(&self, device: &str, error: FciError) -> RobotError {
        match error {
            // The device was reached and uses another version of the protocol.
            FciError::Version { .. } => RobotError::Device(Box::new(error)),
            error => RobotError::Unreachable { peer: format!("the {device} at {self}"), why: error.to_string() },
        }
    }

    /// The error for a device at this address, such as `robot` or `hand`, whose connection is lost.
    pub(crate) fn lost(&self, device: &str, error: &FciError) -> RobotError {
        RobotError::Lost { peer: format!("the {device} at {self}"), why: error.to_string() }
    }
}

impl FromStr for RobotAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected HOST or HOST:PORT, as in 172.16.0.2, found \"{text}\"");
        let (host, port) = match text.rsplit_once(':') {
            None => (text, ROBOT_PORT),
            Some((host, port)) => (host, port.parse().map_err(|_| expected())?),
        };
        let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        if host.is_empty() || !host.chars().all(is_name) || port == 0 || port == u16::MAX {
            return Err(expected());
        }
        Ok(Self { host: host.to_owned(), port, hand_port: port + 1 })
    }
}

impl fmt::Display for RobotAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.port {
            ROBOT_PORT => f.write_str(&self.host),
            port => write!(f, "{}:{port}", self.host),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_hosts_with_or_without_a_port() {
        let address: RobotAddress = "172.16.0.2".parse().unwrap();
        assert_eq!((address.host.as_str(), address.port, address.hand_port), ("172.16.0.2", 1337, 1338));
        let address: RobotAddress = "localhost:4000".parse().unwrap();
        assert_eq!((address.port, address.hand_port), (4000, 4001));
        assert_eq!(address.to_string(), "localhost:4000");
        for bad in ["", ":1337", "host:", "host:x", "a b", "host:0", "host:65535", "http://host"] {
            assert!(bad.parse::<RobotAddress>().unwrap_err().contains("expected HOST or HOST:PORT"), "{bad}");
        }
    }
}
