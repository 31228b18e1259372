//! The camera's pose: from the camera file, or from tf at the picture's time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use sdg_geometry::{PinholeCamera, PosedCamera};
use sdg_grasp::CameraOverTable;
use sdg_ros2::dds::{Node, Qos, network_thread};
use sdg_ros2::messages::{CameraInfo, Header, TfMessage};
use sdg_ros2::{RosError, Transforms, camera_info};

use crate::lines::Lines;

/// Interval at which a thread checks whether it must end.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Source of the camera's pose.
#[derive(Debug, Clone)]
pub enum CameraPoseSource {
    /// No source: detections have no poses.
    Unknown,
    /// The camera file.
    File(CameraOverTable),
    /// tf; the intrinsics come from the camera file, or from camera_info if there is no camera file.
    Transforms {
        /// The frame of the robot's base.
        base_frame: String,
        /// z of the table in that frame.
        table_height_m: f64,
        /// Intrinsics from the camera file.
        intrinsics: Option<PinholeCamera>,
    },
}

struct Known {
    transforms: Transforms,
    sent: Option<Result<PinholeCamera, String>>,
}

impl Known {
    /// Checks that a received camera_info is of the camera in a file. With a camera file, neither a missing nor an
    /// unreadable camera_info matters.
    fn check(&self, of_file: &PinholeCamera) -> Result<(), RosError> {
        match &self.sent {
            Some(Ok(sent)) => camera_info::check_same_camera(of_file, sent),
            _ => Ok(()),
        }
    }
}

/// Receives tf and camera_info on threads.
pub(super) struct CameraPoseReader {
    source: CameraPoseSource,
    known: Arc<Mutex<Known>>,
    is_stopped: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl CameraPoseReader {
    pub(super) fn open(
        node: &mut Node,
        source: CameraPoseSource,
        max_age_secs: f64,
        lines: &Arc<Lines>,
    ) -> Result<Self, RosError> {
        let known = Arc::new(Mutex::new(Known { transforms: Transforms::new(max_age_secs), sent: None }));
        let is_stopped = Arc::<AtomicBool>::default();
        let mut reader = Self { source, known, is_stopped, threads: Vec::new() };
        let infos = node.subscribe::<CameraInfo>("camera_info", Qos::SENSORS)?;
        reader.spawn(lines, move |known| {
            let Some(received) = infos.receive(POLL_INTERVAL)? else { return Ok(()) };
            let read = camera_info::read_camera_info(&received.message);
            lock(known).sent = Some(read.as_ref().copied().map_err(ToString::to_string));
            read.map(drop)
        })?;
        if let CameraPoseSource::Transforms { .. } = reader.source {
            for (topic, qos, is_static) in
                [("/tf", Qos::TRANSFORMS, false), ("/tf_static", Qos::STATIC_TRANSFORMS, true)]
            {
                let messages = node.subscribe::<TfMessage>(topic, qos)?;
                reader.spawn(lines, move |known| {
                    let Some(received) = messages.receive(POLL_INTERVAL)? else { return Ok(()) };
                    match lock(known).transforms.add(&received.message, is_static) {
                        0 => Ok(()),
                        num_refused => Err(RosError::Transform {
                            target_frame: received.message.transforms[0].header.frame_id.clone(),
                            source_frame: received.message.transforms[0].child_frame_id.clone(),
                            why: format!("{num_refused} transforms on {topic} are invalid"),
                        }),
                    }
                })?;
            }
        }
        Ok(reader)
    }

    fn spawn(
        &mut self,
        lines: &Arc<Lines>,
        receive: impl Fn(&Mutex<Known>) -> Result<(), RosError> + Send + 'static,
    ) -> Result<(), RosError> {
        let (known, is_stopped, lines) = (Arc::clone(&self.known), Arc::clone(&self.is_stopped), Arc::clone(lines));
        self.threads.push(network_thread("camera pose", move || {
            while !is_stopped.load(Ordering::SeqCst) {
                if let Err(error) = receive(&known) {
                    lines.complain(&error.to_string());
                }
            }
        })?);
        Ok(())
    }

    /// Checks that a received camera_info is of the camera in a file, from which a grasp gets its intrinsics.
    ///
    /// # Errors
    /// [`RosError::CameraInfo`] with the first difference.
    pub(super) fn check(&self, of_file: &PinholeCamera) -> Result<(), RosError> {
        lock(&self.known).check(of_file)
    }

    /// The camera and its pose above the table at the time of a picture; `None` for [`CameraPoseSource::Unknown`].
    pub(super) fn at(&self, header: &Header) -> Result<Option<CameraOverTable>, RosError> {
        let known = lock(&self.known);
        let refused = |expected: &str, found: String| RosError::CameraInfo { expected: expected.to_owned(), found };
        match &self.source {
            CameraPoseSource::Unknown => Ok(None),
            CameraPoseSource::File(over_table) => {
                known.check(&over_table.camera.intrinsics)?;
                Ok(Some(*over_table))
            }
            CameraPoseSource::Transforms { base_frame, table_height_m, intrinsics } => {
                let intrinsics = match (intrinsics, &known.sent) {
                    (Some(of_file), _) => {
                        known.check(of_file)?;
                        *of_file
                    }
                    (None, Some(Ok(sent))) => *sent,
                    (None, Some(Err(why))) => return Err(refused("a usable camera_info", why.clone())),
                    (None, None) => return Err(refused("a camera_info with the pictures", "none yet".to_owned())),
                };
                let base_from_camera = known.transforms.lookup(base_frame, &header.frame_id, header.stamp)?;
                let camera = PosedCamera { intrinsics, world_from_camera: base_from_camera };
                Ok(Some(CameraOverTable { camera, table_height_m: *table_height_m, workspace: None }))
            }
        }
    }
}

fn lock(known: &Mutex<Known>) -> MutexGuard<'_, Known> {
    known.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for CameraPoseReader {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::SeqCst);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_info_of_another_camera_is_refused_also_without_a_source_of_poses() {
        let check = |sent: Option<Result<PinholeCamera, String>>| {
            let known = Arc::new(Mutex::new(Known { transforms: Transforms::new(0.5), sent }));
            let source = CameraPoseSource::Unknown;
            CameraPoseReader { source, known, is_stopped: Arc::default(), threads: Vec::new() }
                .check(&PinholeCamera::WRIST)
        };
        for sent in [None, Some(Err("unreadable".to_owned())), Some(Ok(PinholeCamera::WRIST))] {
            check(sent).unwrap();
        }
        let other = PinholeCamera { fx: 600.0, ..PinholeCamera::WRIST };
        let error = check(Some(Ok(other))).unwrap_err().to_string();
        assert_eq!(error, "camera_info: expected fx = 550.0 ± 6.4 px, as in the camera file, found 600.0");
    }
}
