//! Publishes detections and the node's state as topics.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use sdg_ros2::RosError;
use sdg_ros2::dds::{Node, Publisher, Qos};
use sdg_ros2::encoding::{to_compressed, to_image};
use sdg_ros2::found::{to_detections, to_pose, to_transform};
use sdg_ros2::messages::{
    CompressedImage, Detection2DArray, DiagnosticArray, DiagnosticStatus, Header, Image, KeyValue, PoseStamped,
    TfMessage, Time,
};

use crate::lines::Lines;
use crate::pictures::PictureReader;
use crate::searching::Searched;

/// Interval of diagnostics.
const DIAGNOSTICS_INTERVAL: Duration = Duration::from_secs(1);
/// Time without a picture after which the camera is stale.
const STALE_AFTER: Duration = Duration::from_secs(2);
/// The grasp's frame in tf.
const GRASP_FRAME: &str = "sdg_grasp";

/// The node's topics.
pub(super) struct Topics {
    poses: Publisher<PoseStamped>,
    detections: Publisher<Detection2DArray>,
    overlays: Publisher<Image>,
    compressed_overlays: Publisher<CompressedImage>,
    transforms: Publisher<TfMessage>,
    diagnostics: Publisher<DiagnosticArray>,
    name: String,
    last_diagnostics: Instant,
    num_searched: u64,
    num_failed: u64,
    last_search_secs: f64,
    last_latency_secs: f64,
    lines: Arc<Lines>,
}

impl Topics {
    pub(super) fn open(node: &mut Node, lines: &Arc<Lines>) -> Result<Self, RosError> {
        Ok(Self {
            poses: node.publish("~/grasp_pose", Qos::RESULTS)?,
            detections: node.publish("~/detections", Qos::RESULTS)?,
            overlays: node.publish("~/overlay", Qos::RESULTS)?,
            compressed_overlays: node.publish("~/overlay/compressed", Qos::RESULTS)?,
            transforms: node.publish("/tf", Qos::TRANSFORMS)?,
            diagnostics: node.publish("/diagnostics", Qos::RESULTS)?,
            name: node.naming().node().to_owned(),
            last_diagnostics: Instant::now(),
            num_searched: 0,
            num_failed: 0,
            last_search_secs: 0.0,
            last_latency_secs: 0.0,
            lines: Arc::clone(lines),
        })
    }

    /// The absolute names of the topics, for the line that is printed at the start.
    pub(super) fn names(&self) -> String {
        [self.poses.topic(), self.detections.topic(), self.overlays.topic()].join(", ")
    }

    /// Publishes the results of a picture: the pose of the best part (also to tf), all detections, and the overlay if
    /// it has subscribers.
    pub(super) fn publish(&mut self, node: &Node, searched: &Searched) {
        let header = &searched.header;
        if let Some((camera_from_tcp, _)) = searched.found.first().and_then(|part| part.grasp) {
            self.told(self.poses.send(to_pose(header, &camera_from_tcp)));
            let transform = to_transform(header, GRASP_FRAME, &camera_from_tcp);
            self.told(self.transforms.send(TfMessage { transforms: vec![transform] }));
        }
        self.told(self.detections.send(to_detections(header, &searched.found)));
        self.last_latency_secs = searched.arrived.elapsed().as_secs_f64();
        self.last_search_secs = searched.search_secs;
        self.num_searched += 1;
        let (raw, compressed) = (node.num_readers(&self.overlays) > 0, node.num_readers(&self.compressed_overlays) > 0);
        if !raw && !compressed {
            return;
        }
        let drawn = searched.overlay();
        if raw {
            self.told(self.overlays.send(to_image(&drawn, header.clone())));
        }
        if let Some(message) = to_compressed(&drawn, header.clone()).filter(|_| compressed) {
            self.told(self.compressed_overlays.send(message));
        }
    }

    /// Counts a picture that could not be searched.
    pub(super) fn failed(&mut self) {
        self.num_failed += 1;
    }

    fn told(&self, sent: Result<(), RosError>) {
        if let Err(error) = sent {
            self.lines.complain(&error.to_string());
        }
    }

    /// Publishes diagnostics if they are due.
    pub(super) fn diagnose(&mut self, reader: &PictureReader, has_model: bool) {
        if self.last_diagnostics.elapsed() < DIAGNOSTICS_INTERVAL {
            return;
        }
        self.last_diagnostics = Instant::now();
        let (level, message) = state(has_model, reader.shared.newest_arrival(), &reader.topic);
        let counts = &reader.shared.counts;
        let count = |name: &str, value: u64| KeyValue { key: name.to_owned(), value: value.to_string() };
        let secs = |name: &str, value: f64| KeyValue { key: name.to_owned(), value: format!("{:.1}", 1e3 * value) };
        let values = vec![
            count("pictures received", counts.received.load(Ordering::Relaxed)),
            count("pictures searched", self.num_searched),
            count("pictures not searched", self.num_failed),
            count("pictures skipped", counts.skipped.load(Ordering::Relaxed)),
            count("messages refused", counts.refused.load(Ordering::Relaxed)),
            count("messages lost", counts.lost.load(Ordering::Relaxed)),
            secs("last search, ms", self.last_search_secs),
            secs("last picture to pose, ms", self.last_latency_secs),
        ];
        let status = DiagnosticStatus {
            level,
            name: format!("{}: detection", self.name),
            message,
            values,
            ..Default::default()
        };
        let header = Header { stamp: Time::from_system(SystemTime::now()), frame_id: String::new() };
        self.told(self.diagnostics.send(DiagnosticArray { header, status: vec![status] }));
    }
}

/// Level and message of the diagnostics. Pictures that arrive during a long search count.
fn state(has_model: bool, newest_arrival: Option<Instant>, topic: &str) -> (u8, String) {
    let is_stale = newest_arrival.is_none_or(|arrived| arrived.elapsed() > STALE_AFTER);
    match (has_model, is_stale) {
        (false, _) => (DiagnosticStatus::WARN, "no grasp model yet".to_owned()),
        (true, true) => (DiagnosticStatus::STALE, format!("no picture on {topic}")),
        (true, false) => (DiagnosticStatus::OK, "pictures are searched".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_stale_if_no_picture_arrives() {
        let level = |newest_arrival| state(true, newest_arrival, "/image").0;
        assert_eq!(level(None), DiagnosticStatus::STALE);
        assert_eq!(level(Instant::now().checked_sub(2 * STALE_AFTER)), DiagnosticStatus::STALE);
        assert_eq!(level(Some(Instant::now())), DiagnosticStatus::OK);
        assert_eq!(state(false, None, "/image").0, DiagnosticStatus::WARN);
    }
}
