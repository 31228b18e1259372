//! Sends messages to topics and receives messages from them.

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

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
/// Largest step back of the system's clock that is not reported: messages are delayed by it.
const MAX_CLOCK_STEP: Duration = Duration::from_secs(1);

/// Receives a topic's messages.
pub struct Subscription<T: Cdr + 'static> {
    topic: String,
    inner: ros2_client::Subscription<Wire<T>>,
    last_numbers: Mutex<HashMap<Gid, i64>>,
    num_lost: AtomicU64,
    /// The time of the last call of [`Self::receive`].
    last_call: Mutex<(SystemTime, Instant)>,
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
        let last_call = Mutex::new((SystemTime::now(), Instant::now()));
        Self { topic, inner, last_numbers: Mutex::default(), num_lost: AtomicU64::new(0), last_call }
    }

    /// The topic's absolute name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The next message; `None` if none arrives in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`] for an invalid message of this type; the next call continues with the next message.
    /// [`RosError::ClockSetBack`], once for each step of the clock. Errors reported by the network.
    pub fn receive(&self, timeout: Duration) -> Result<Option<Received<T>>, RosError> {
        self.check_clock()?;
        let Some(taken) = wait_for(self.inner.async_take(), Some(Instant::now() + timeout)) else { return Ok(None) };
        let arrived = Instant::now();
        let (Wire(message), info) = taken.map_err(|error| network(&self.topic, error))?;
        self.count(info.publisher_gid(), info.sequence_number());
        match message {
            Ok(message) => Ok(Some(Received { message, arrived })),
            Err(source) => Err(RosError::Malformed { topic: self.topic.clone(), source }),
        }
    }

    /// Checks that the system's clock was not set back since the last call. RustDDS orders messages by the time of their
    /// arrival, and gives a best-effort reader only those up to now.
    fn check_clock(&self) -> Result<(), RosError> {
        let now = (SystemTime::now(), Instant::now());
        let mut last_call = self.last_call.lock().unwrap_or_else(PoisonError::into_inner);
        match clock_step(std::mem::replace(&mut *last_call, now), now) {
            Some(back) => Err(RosError::ClockSetBack { topic: self.topic.clone(), secs: back.as_secs_f64() }),
            None => Ok(()),
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

/// The time by which the system's clock was set back between two readings of both clocks; `None` up to
/// [`MAX_CLOCK_STEP`].
fn clock_step(before: (SystemTime, Instant), now: (SystemTime, Instant)) -> Option<Duration> {
    let expected = before.0.checked_add(now.1.duration_since(before.1))?;
    expected.duration_since(now.0).ok().filter(|back| *back > MAX_CLOCK_STEP)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_back_is_noticed() {
        let before = (SystemTime::now(), Instant::now());
        let elapsed = Duration::from_secs(10);
        let now = |system: SystemTime| (system, before.1 + elapsed);
        let (on_time, hours) = (before.0 + elapsed, Duration::from_secs(7200));
        assert_eq!(clock_step(before, now(on_time - hours)), Some(hours));
        for system in [on_time, on_time - Duration::from_millis(500), on_time + hours] {
            assert_eq!(clock_step(before, now(system)), None);
        }
    }
}
