//! Sends messages to topics and receives messages from them.

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};

use super::failure::network;
use super::wait::wait_for;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;

/// The delivery settings of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost messages are sent again.
    pub is_reliable: bool,
    /// Whether late subscribers get the last messages.
    pub is_transient_local: bool,
    /// Number of messages that are kept for a slow reader.
    pub depth: usize,
}

impl Qos {
    /// Settings for sensors: best effort, as in ROS's `SensorDataQoS`.
    pub const SENSORS: Self = Self { is_reliable: false, is_transient_local: false, depth: 5 };
    /// Settings for results: reliable.
    pub const RESULTS: Self = Self { is_reliable: true, is_transient_local: false, depth: 10 };
    /// Settings for services: reliable.
    pub const SERVICES: Self = Self::RESULTS;
    /// Settings for `/tf`.
    pub const TRANSFORMS: Self = Self { is_reliable: true, is_transient_local: false, depth: 100 };
    /// Settings for `/tf_static`: late subscribers also get earlier messages.
    pub const STATIC_TRANSFORMS: Self = Self { is_reliable: true, is_transient_local: true, depth: 100 };
    /// Settings for the statuses of actions.
    pub(super) const STATUSES: Self = Self { is_reliable: true, is_transient_local: true, depth: 1 };

    pub(super) fn profile(self) -> QosProfile {
        let reliability = match self.is_reliable {
            true => Reliability::Reliable { when_full: WhenFull::Wait(Duration::from_millis(100)) },
            false => Reliability::BestEffort,
        };
        let durability = if self.is_transient_local { Durability::TransientLocal } else { Durability::Volatile };
        QosProfile::subscription_default()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth: self.depth })
    }
}

/// Maximum number of senders for which the number of the last message is stored.
const MAX_SENDERS: usize = 64;

/// Receives a topic's messages.
pub struct Subscription<T: Cdr + 'static> {
    topic: String,
    inner: ros2_client::Subscription<Wire<T>>,
    last_numbers: Mutex<HashMap<Gid, i64>>,
    num_lost: AtomicU64,
}

/// A message, and its time of arrival.
#[derive(Debug, Clone)]
pub struct Received<T> {
    /// The message.
    pub message: T,
    /// The time at which the message was taken from the network.
    pub arrived: Instant,
}

impl<T: Cdr + 'static> Subscription<T> {
    pub(super) fn new(topic: String, inner: ros2_client::Subscription<Wire<T>>) -> Self {
        Self { topic, inner, last_numbers: Mutex::default(), num_lost: AtomicU64::new(0) }
    }

    /// The topic's absolute name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The next message; `None` if none arrives in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`] for an invalid message of this type; the next call continues with the next message.
    /// Errors reported by the network.
    pub fn receive(&self, timeout: Duration) -> Result<Option<Received<T>>, RosError> {
        let Some(taken) = wait_for(self.inner.async_take(), Some(Instant::now() + timeout)) else { return Ok(None) };
        let arrived = Instant::now();
        let (Wire(message), info) = taken.map_err(|error| network(&self.topic, error))?;
        self.count(info.publisher_gid(), info.sequence_number());
        match message {
            Ok(message) => Ok(Some(Received { message, arrived })),
            Err(source) => Err(RosError::Malformed { topic: self.topic.clone(), source }),
        }
    }

    /// Number of messages that were sent after the first received one and did not arrive.
    pub fn num_lost(&self) -> u64 {
        self.num_lost.load(Ordering::Relaxed)
    }

    /// Counts the sender's messages that are missing before this one. A sender numbers its messages consecutively.
    fn count(&self, sender: Gid, number: i64) {
        let mut last_numbers = self.last_numbers.lock().unwrap_or_else(PoisonError::into_inner);
        if last_numbers.len() >= MAX_SENDERS && !last_numbers.contains_key(&sender) {
            last_numbers.clear();
        }
        if let Some(last) = last_numbers.insert(sender, number) {
            self.num_lost.fetch_add(
                u64::try_from(number.saturating_sub(last).saturating_sub(1)).unwrap_or(0),
                Ordering::Relaxed,
            );
        }
    }
}

/// Sends messages to a topic.
pub struct Publisher<T: Cdr> {
    topic: String,
    inner: ros2_client::Publisher<Wire<T>>,
}

impl<T: Cdr> Publisher<T> {
    pub(super) fn new(topic: String, inner: ros2_client::Publisher<Wire<T>>) -> Self {
        Self { topic, inner }
    }

    /// The topic's absolute name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    pub(super) fn inner(&self) -> &ros2_client::Publisher<Wire<T>> {
        &self.inner
    }

    /// Sends a message.
    ///
    /// # Errors
    /// [`RosError::Network`] if the queue of a reliable reader stays full.
    pub fn send(&self, message: T) -> Result<(), RosError> {
        self.inner.publish(Wire(Ok(message))).map_err(|error| network(&self.topic, error.forget_data()))
    }
}
