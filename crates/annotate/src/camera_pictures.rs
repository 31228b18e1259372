//! A camera's pictures for the page.
//!
//! A thread reads the camera continuously, so that each request of the page gets the newest picture.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use image::RgbImage;
use sdg_camera::{Address, Camera, CameraError, Fault, Playback};

use crate::live::{Live, LiveFault, LiveFaultKind, LiveFrame, LivePictures};

/// Default interval between pictures from files without a frame rate in their address. Without an interval, a folder's
/// pictures would end before anyone has seen them, or reading them would use a whole core.
const FILES_INTERVAL: Duration = Duration::from_millis(200);
/// Time without a complete frame after which torn frames are a fault: single ones are common with cheap cameras.
const MAX_TORN_AGE: Duration = Duration::from_secs(1);

/// The newest picture of a camera. A thread reads the camera until the camera ends or fails.
#[derive(Debug)]
pub struct CameraPictures(Arc<Mutex<Newest>>);

#[derive(Default)]
struct Newest {
    frame: Option<(Arc<RgbImage>, u64, Instant)>,
    fault: Option<LiveFault>,
    check: Option<Box<SizeCheck>>,
}

/// Checks a picture's width and height; the error is a text for the user.
pub type SizeCheck = dyn Fn((u32, u32)) -> Result<(), String> + Send;

impl fmt::Debug for Newest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Newest").field("fault", &self.fault).finish_non_exhaustive()
    }
}

impl CameraPictures {
    /// Starts reading a camera; pictures rejected by `check` are a fault. A simulated camera renders as fast as it can,
    /// so it is read at the rate of its frames' timestamps.
    pub fn read(mut camera: Box<dyn Camera>, is_simulated: bool, check: Option<Box<SizeCheck>>) -> Self {
        let newest = Arc::new(Mutex::new(Newest { check, ..Newest::default() }));
        let writer = Arc::clone(&newest);
        thread::spawn(move || {
            loop {
                let next = camera.next_frame();
                if let (true, Ok(Some(frame))) = (is_simulated, &next) {
                    thread::sleep(frame.captured.duration_since(SystemTime::now()).unwrap_or_default());
                }
                if lock(&writer).has_ended_with(next) {
                    return;
                }
            }
        });
        Self(newest)
    }
}

impl LivePictures for CameraPictures {
    fn newest(&self) -> Live {
        let newest = lock(&self.0);
        let frame = newest.frame.as_ref().map(|(picture, number, arrived)| LiveFrame {
            picture: Arc::clone(picture),
            number: *number,
            age: arrived.elapsed(),
        });
        Live { frame, fault: newest.fault.clone() }
    }
}

fn lock(newest: &Mutex<Newest>) -> MutexGuard<'_, Newest> {
    newest.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Newest {
    /// Stores the camera's result; returns true if no more pictures will come.
    fn has_ended_with(&mut self, next: Result<Option<sdg_camera::Frame>, CameraError>) -> bool {
        let fault = |kind, text: String| Some(LiveFault { kind, text });
        match next {
            Ok(Some(frame)) => {
                let other_size = self.check.as_ref().and_then(|check| check(frame.picture.dimensions()).err());
                self.fault = match other_size {
                    Some(error) => fault(LiveFaultKind::OtherSize, error),
                    None => frame.faults.iter().find_map(live_fault),
                };
                self.frame = Some((Arc::new(frame.picture), frame.number, Instant::now()));
                false
            }
            Ok(None) => {
                self.fault = fault(LiveFaultKind::Ended, "there are no more pictures; this is the last one".to_owned());
                true
            }
            Err(error) => {
                let is_of_folder = matches!(&error, CameraError::Fault { camera, .. } if camera.starts_with("dir:"));
                let is_recent = self.frame.as_ref().is_some_and(|(.., arrived)| arrived.elapsed() < MAX_TORN_AGE);
                match error.fault() {
                    Some(Fault::Torn { .. }) if is_recent => {}
                    // With `follow`, the newest file is the newest picture until there is another, however late.
                    Some(Fault::Stale { .. }) if is_of_folder => {}
                    Some(passing) => self.fault = live_fault(passing),
                    None => self.fault = fault(LiveFaultKind::Failed, error.to_string()),
                }
                !error.is_passing()
            }
        }
    }
}

/// The page's text for a fault; `None` for faults that do not matter on the page.
fn live_fault(fault: &Fault) -> Option<LiveFault> {
    let kind = match fault {
        Fault::Stale { .. } => LiveFaultKind::Stale,
        Fault::Torn { .. } => LiveFaultKind::Torn,
        Fault::Gone { .. } => LiveFaultKind::Gone,
        Fault::Frozen { .. } => LiveFaultKind::Frozen,
        Fault::Black => LiveFaultKind::Black,
        // The page shows pictures of any size, and needs no message when a camera is back.
        _ => return None,
    };
    // The page shows the kind of the fault itself.
    let text = fault.to_string();
    let text = text.split_once(": ").map_or(text.as_str(), |(_, rest)| rest).to_owned();
    Some(LiveFault { kind, text })
}

/// The address with a watchable frame rate, if it is an address of files without one.
pub fn paced(mut address: Address) -> Address {
    if let Address::Folder { playback: Playback { interval, .. }, .. }
    | Address::File { playback: Playback { interval, .. }, .. } = &mut address
    {
        interval.get_or_insert(FILES_INTERVAL);
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    const STALL_TIMEOUT: Duration = Duration::from_millis(50);

    fn open(address: &str) -> (CameraPictures, String) {
        let address = paced(address.parse().unwrap());
        let options = sdg_camera::OpenOptions { stall_timeout: STALL_TIMEOUT, ..sdg_camera::OpenOptions::default() };
        let camera = sdg_camera::open(&address, &options).unwrap();
        (CameraPictures::read(camera, false, None), address.to_string())
    }

    fn picture(level: u8) -> RgbImage {
        RgbImage::from_pixel(4, 3, Rgb([level; 3]))
    }

    fn frame(number: u64, faults: Vec<Fault>) -> sdg_camera::Frame {
        sdg_camera::Frame { faults, ..sdg_camera::Frame::new(picture(90), number, "test:".into()) }
    }

    fn passing(fault: Fault) -> CameraError {
        CameraError::Fault { camera: "test:".into(), fault }
    }

    fn kind(newest: &Newest) -> Option<LiveFaultKind> {
        newest.fault.as_ref().map(|fault| fault.kind)
    }

    #[test]
    fn a_fault_stands_until_a_frame_without_one() {
        let mut newest = Newest::default();
        assert!(!newest.has_ended_with(Ok(Some(frame(0, vec![])))));
        for (told, expected) in [
            (Err(passing(Fault::Stale { silent_secs: 2.0 })), LiveFaultKind::Stale),
            (Err(passing(Fault::Gone { why: "cable".into() })), LiveFaultKind::Gone),
            (Ok(Some(frame(1, vec![Fault::Back { away_secs: 1.0 }, Fault::Black]))), LiveFaultKind::Black),
            (Ok(Some(frame(2, vec![Fault::Frozen { num_frames: 10 }]))), LiveFaultKind::Frozen),
        ] {
            assert!(!newest.has_ended_with(told));
            assert_eq!(kind(&newest), Some(expected));
        }
        assert!(!newest.has_ended_with(Ok(Some(frame(3, vec![Fault::Back { away_secs: 1.0 }])))));
        assert_eq!((kind(&newest), newest.frame.as_ref().unwrap().1), (None, 3));
        assert!(!newest.has_ended_with(Err(passing(Fault::Torn { found: "half".into() }))));
        assert_eq!(kind(&newest), None, "one torn frame between whole ones is not told");
    }

    #[test]
    fn an_end_and_a_failure_are_final_and_the_last_picture_stays() {
        let mut ended = Newest::default();
        ended.has_ended_with(Ok(Some(frame(0, vec![]))));
        assert!(ended.has_ended_with(Ok(None)));
        assert!(kind(&ended).unwrap().is_usable() && ended.frame.is_some());
        let mut failed = Newest::default();
        let error = CameraError::Ended { camera: "test:".into(), why: "no such program".into() };
        assert!(failed.has_ended_with(Err(error)));
        assert!(!kind(&failed).unwrap().is_usable());
        assert!(failed.fault.unwrap().text.contains("no such program"));
    }

    #[test]
    fn a_folder_is_read_at_a_pace_that_can_be_watched() {
        let folder = tempfile::tempdir().unwrap();
        picture(7).save(folder.path().join("a.png")).unwrap();
        let (camera, address) = open(&format!("dir:{}?loop", folder.path().display()));
        assert!(address.ends_with("?fps=5&loop"), "{address}");
        let begun = Instant::now();
        let number = |camera: &CameraPictures| camera.newest().frame.map(|frame| frame.number);
        while number(&camera) < Some(2) {
            assert!(begun.elapsed() < Duration::from_secs(30));
            thread::sleep(Duration::from_millis(5));
        }
        assert!(begun.elapsed() >= 2 * FILES_INTERVAL);
        assert_eq!(*camera.newest().frame.unwrap().picture, picture(7));

        // While a followed folder gets no new file, its newest picture stays usable.
        picture(90).save(folder.path().join("b.png")).unwrap();
        let (followed, _) = open(&format!("dir:{}?follow", folder.path().display()));
        while number(&followed) != Some(1) {
            assert!(begun.elapsed() < Duration::from_secs(60));
            thread::sleep(Duration::from_millis(5));
        }
        thread::sleep(10 * STALL_TIMEOUT);
        assert_eq!(followed.newest().fault, None);
    }
}
