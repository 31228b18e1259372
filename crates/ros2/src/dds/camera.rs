//! A topic with pictures as a camera.

use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use image::RgbImage;
use sdg_camera::{Camera, CameraError, Fault, Frame};

use super::node::{MAX_DOMAIN, Node, NodeConfig, Rmw};
use super::topic::{Qos, Subscription};
use crate::encoding;
use crate::error::RosError;
use crate::messages::{CompressedImage, Header, Image, Time};
use crate::names::Naming;

/// A message's header, and its picture or the reason why it cannot be read.
type Taken = (Header, Result<RgbImage, String>);

/// Largest difference between a stamp and the present time. A larger one means that the stamp comes from another clock,
/// such as a simulation's or a recording's; then the time of arrival is used.
const MAX_STAMP_AGE: Duration = Duration::from_secs(60);

/// The part of a camera's address after `ros2:`: a topic, and optionally any of the options in
/// `TOPIC?compressed&reliable&domain=7&loopback`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicAddress {
    /// The topic.
    pub topic: String,
    /// Whether the topic has CompressedImage instead of Image: by the option, or because its name ends with
    /// `/compressed`.
    pub is_compressed: bool,
    /// Whether lost pictures are sent again.
    pub is_reliable: bool,
    /// The domain: `ROS_DOMAIN_ID`, unless the option gives another one.
    pub domain_id: u16,
    /// As in [`NodeConfig::is_loopback_only`].
    pub is_loopback_only: bool,
}

impl FromStr for TopicAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (topic, options) = text.split_once('?').unwrap_or((text, ""));
        let mut address = Self {
            topic: topic.to_owned(),
            is_compressed: topic.ends_with("/compressed"),
            is_reliable: false,
            domain_id: 0,
            is_loopback_only: false,
        };
        let mut has_domain = false;
        for option in options.split('&').filter(|option| !option.is_empty()) {
            match option.split_once('=') {
                None if option == "compressed" => address.is_compressed = true,
                None if option == "reliable" => address.is_reliable = true,
                None if option == "loopback" => address.is_loopback_only = true,
                Some(("domain", number)) => {
                    let parsed = number.parse().ok().filter(|domain| *domain <= MAX_DOMAIN);
                    address.domain_id =
                        parsed.ok_or_else(|| format!("expected domain=0 to {MAX_DOMAIN}, found \"{number}\""))?;
                    has_domain = true;
                }
                _ => {
                    return Err(format!(
                        "expected the options compressed, reliable, loopback or domain=NUMBER after ?, found \"{option}\""
                    ));
                }
            }
        }
        if !has_domain {
            address.domain_id = domain_of_environment()?;
        }
        Ok(address)
    }
}

/// The domain of `ROS_DOMAIN_ID`; 0 if it is empty or not set, as in ROS.
///
/// # Errors
/// An error text for an invalid domain.
pub fn domain_of_environment() -> Result<u16, String> {
    domain_of(&std::env::var("ROS_DOMAIN_ID").unwrap_or_default())
}

fn domain_of(variable: &str) -> Result<u16, String> {
    if variable.is_empty() {
        return Ok(0);
    }
    let parsed = variable.parse().ok().filter(|domain| *domain <= MAX_DOMAIN);
    parsed.ok_or_else(|| format!("ROS_DOMAIN_ID: expected 0 to {MAX_DOMAIN}, found \"{variable}\""))
}

enum Pictures {
    Raw(Subscription<Image>),
    Compressed(Subscription<CompressedImage>),
}

/// A camera whose pictures come from a topic.
pub struct RosCamera {
    // The node is kept because its topics end when it is dropped.
    _node: Node,
    pictures: Pictures,
    name: Arc<str>,
    stall_timeout: Duration,
    num_frames: u64,
    silent_secs: f64,
}

impl RosCamera {
    /// Subscribes to a topic; `name` is the camera's address in frames and errors.
    ///
    /// # Errors
    /// [`RosError`] for an invalid topic and a missing network.
    pub fn open(address: &TopicAddress, name: &str, stall_timeout: Duration) -> Result<Self, RosError> {
        // Nodes need unique names.
        let naming = Naming::new("", &format!("sdg_camera_{}", std::process::id()), &[])?;
        let mut node = Node::join(NodeConfig {
            domain_id: address.domain_id,
            rmw: Rmw::default(),
            is_loopback_only: address.is_loopback_only,
            ..NodeConfig::new(naming)
        })?;
        let qos = Qos { is_reliable: address.is_reliable, ..Qos::SENSORS };
        let pictures = match address.is_compressed {
            true => Pictures::Compressed(node.subscribe(&address.topic, qos)?),
            false => Pictures::Raw(node.subscribe(&address.topic, qos)?),
        };
        Ok(Self { _node: node, pictures, name: name.into(), stall_timeout, num_frames: 0, silent_secs: 0.0 })
    }

    fn fault(&self, fault: Fault) -> CameraError {
        CameraError::Fault { camera: self.name.to_string(), fault }
    }

    /// The next picture with its header; `None` if none arrives in time.
    fn take(&self) -> Result<Option<Taken>, RosError> {
        let timeout = self.stall_timeout;
        Ok(match &self.pictures {
            Pictures::Raw(images) => images.receive(timeout)?.map(|received| {
                let picture = encoding::read_image(&received.message).map_err(|why| why.found_in_words());
                (received.message.header, picture)
            }),
            Pictures::Compressed(images) => images.receive(timeout)?.map(|received| {
                let picture = encoding::read_compressed(&received.message).map_err(|why| why.found_in_words());
                (received.message.header, picture)
            }),
        })
    }

    fn num_lost(&self) -> u64 {
        match &self.pictures {
            Pictures::Raw(images) => images.num_lost(),
            Pictures::Compressed(images) => images.num_lost(),
        }
    }
}

impl Camera for RosCamera {
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        match self.take() {
            Ok(Some((header, Ok(picture)))) => {
                self.silent_secs = 0.0;
                let number = self.num_frames + self.num_lost();
                self.num_frames += 1;
                let captured = stamp_or_now(header.stamp);
                Ok(Some(Frame { captured, ..Frame::new(picture, number, Arc::clone(&self.name)) }))
            }
            Ok(Some((_, Err(found)))) => {
                self.num_frames += 1;
                Err(self.fault(Fault::Torn { found }))
            }
            Ok(None) => {
                self.silent_secs += self.stall_timeout.as_secs_f64();
                Err(self.fault(Fault::Stale { silent_secs: self.silent_secs }))
            }
            Err(RosError::Malformed { source, .. }) => Err(self.fault(Fault::Torn { found: source.to_string() })),
            Err(error) => Err(CameraError::Ended { camera: self.name.to_string(), why: error.to_string() }),
        }
    }
}

/// The time at which a picture was taken; now, if the stamp comes from another clock. It is never later than now, because
/// a picture that was taken before the arm stopped must not seem to be taken after it.
pub fn stamp_or_now(stamp: Time) -> SystemTime {
    let now = SystemTime::now();
    let is_near = |time: &SystemTime| {
        let apart = now.duration_since(*time).or_else(|_| time.duration_since(now));
        apart.is_ok_and(|apart| apart < MAX_STAMP_AGE)
    };
    stamp.to_system().filter(is_near).map_or(now, |time| time.min(now))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_topic_and_options() {
        let address: TopicAddress = "/camera/image?reliable&loopback&domain=7".parse().unwrap();
        assert_eq!(address.topic, "/camera/image");
        assert!(address.is_reliable && address.is_loopback_only && !address.is_compressed && address.domain_id == 7);
        assert!("/camera/image/compressed".parse::<TopicAddress>().unwrap().is_compressed);
        for (text, expected) in
            [("/a?domain=233", "0 to 232"), ("/a?x", "compressed, reliable"), ("/a?domain", "found")]
        {
            assert!(text.parse::<TopicAddress>().unwrap_err().contains(expected), "{text}");
        }
    }

    #[test]
    fn an_empty_domain_is_the_default() {
        assert_eq!((domain_of(""), domain_of("7")), (Ok(0), Ok(7)));
        assert!(domain_of("233").is_err() && domain_of("x").is_err());
    }

    #[test]
    fn stamps_of_another_clock_are_the_time_of_arrival() {
        let now = SystemTime::now();
        let second_ago = now - Duration::from_secs(1);
        let read = stamp_or_now(Time::from_system(second_ago));
        assert!(second_ago.duration_since(read).unwrap_or_default() < Duration::from_millis(1));
        for other in [Time { sec: 5, nanosec: 0 }, Time { sec: -1, nanosec: 0 }, Time { sec: 5, nanosec: u32::MAX }] {
            assert!(stamp_or_now(other) >= now);
        }
    }

    #[test]
    fn a_stamp_in_the_future_is_the_time_of_arrival() {
        let read = stamp_or_now(Time::from_system(SystemTime::now() + Duration::from_secs(2)));
        assert!(read <= SystemTime::now());
    }
}
