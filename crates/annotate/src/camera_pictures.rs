//! A camera for the annotation page, which does not see the crate `camera`.
//!
//! A thread reads the camera without a pause, so that the page, which asks when it likes, gets the newest picture.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use anyhow::Result;
use image::RgbImage;
use sdg_annotate::{Live, LiveFault, LiveFaultKind, LiveFrame, LivePictures};
use sdg_camera::{Address, CameraError, Fault, OpenOptions, PixelFrame, Playback};
use sdg_inputs::camera_files::CameraFile;

use crate::exit::one_line;
use crate::live_pictures;

/// Pictures a second from files whose address names no pace: a folder that is read as fast as it can be would be over, or take a
/// core, before anybody has seen it.
const FILES_INTERVAL: Duration = Duration::from_millis(200);
/// A torn frame is a fault only when no whole one has come for so long: single ones are common with cheap cameras.
const MAX_TORN_AGE: Duration = Duration::from_secs(1);

/// The newest picture of a camera that a thread reads for as long as the process runs.
#[derive(Debug)]
pub struct PageCamera(Arc<Mutex<Newest>>);

#[derive(Debug, Default)]
struct Newest {
    frame: Option<(Arc<RgbImage>, u64, Instant)>,
    fault: Option<LiveFault>,
    calibration: Option<CameraFile>,
}

impl PageCamera {
    /// Opens the camera at an address and begins to read it; gives the address without its password, too. With a calibration
    /// its size is asked for, and pictures of another size are a fault.
    ///
    /// # Errors
    /// A camera that does not open.
    pub fn open(address: Address, mut options: OpenOptions, calibration: Option<CameraFile>) -> Result<(Self, String)> {
        let address = paced(address);
        if let Some([width, height]) = calibration.as_ref().map(CameraFile::size_px) {
            (options.width, options.height) = (width, height);
            options.frame = PixelFrame::Sensor;
        }
        let mut camera = live_pictures::open(&address, &options)?;
        let newest = Arc::new(Mutex::new(Newest { calibration, ..Newest::default() }));
        let writer = Arc::clone(&newest);
        let is_simulated = matches!(address, Address::Sim(_));
        thread::spawn(move || {
            loop {
                let next = camera.next_frame();
                if let (true, Ok(Some(frame))) = (is_simulated, &next) {
                    // The simulated camera draws as fast as it can; its frames' times are those of its own clock.
                    thread::sleep(frame.captured.duration_since(SystemTime::now()).unwrap_or_default());
                }
                if lock(&writer).has_ended_with(next) {
                    return;
                }
            }
        });
        Ok((Self(newest), address.to_string()))
    }
}

impl LivePictures for PageCamera {
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
    /// Takes what the camera gave; true where nothing more will come.
    fn has_ended_with(&mut self, next: Result<Option<sdg_camera::Frame>, CameraError>) -> bool {
        let fault = |kind, text: String| Some(LiveFault { kind, text });
        match next {
            Ok(Some(frame)) => {
                let other_size =
                    self.calibration.as_ref().and_then(|camera| camera.check_picture(&frame.picture).err());
                self.fault = match other_size {
                    Some(error) => fault(LiveFaultKind::OtherSize, one_line(&error)),
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
                let is_recent = self.frame.as_ref().is_some_and(|(.., arrived)| arrived.elapsed() < MAX_TORN_AGE);
                match error.fault() {
                    Some(Fault::Torn { .. }) if is_recent => {}
                    Some(passing) => self.fault = live_fault(passing),
                    None => self.fault = fault(LiveFaultKind::Failed, error.to_string()),
                }
                !error.is_passing()
            }
        }
    }
}

/// The page's text for a fault; `None` for what does not matter on it.
fn live_fault(fault: &Fault) -> Option<LiveFault> {
    let kind = match fault {
        Fault::Stale { .. } => LiveFaultKind::Stale,
        Fault::Torn { .. } => LiveFaultKind::Torn,
        Fault::Gone { .. } => LiveFaultKind::Gone,
        Fault::Frozen { .. } => LiveFaultKind::Frozen,
        Fault::Black => LiveFaultKind::Black,
        // The page shows pictures of any size, and a camera that is back is seen to be.
        _ => return None,
    };
    // The page names the kind itself.
    let text = fault.to_string();
    let text = text.split_once(": ").map_or(text.as_str(), |(_, rest)| rest).to_owned();
    Some(LiveFault { kind, text })
}

/// Files at a pace that can be watched.
fn paced(mut address: Address) -> Address {
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

    fn open(address: &str) -> Result<(PageCamera, String)> {
        PageCamera::open(address.parse().unwrap(), OpenOptions::default(), None)
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
        let (camera, address) = open(&format!("dir:{}?loop", folder.path().display())).unwrap();
        assert!(address.ends_with("?fps=5&loop"), "{address}");
        let begun = Instant::now();
        let number = |camera: &PageCamera| camera.newest().frame.map(|frame| frame.number);
        while number(&camera) < Some(2) {
            assert!(begun.elapsed() < Duration::from_secs(30));
            thread::sleep(Duration::from_millis(5));
        }
        assert!(begun.elapsed() >= 2 * FILES_INTERVAL);
        assert_eq!(*camera.newest().frame.unwrap().picture, picture(7));
    }

    #[test]
    fn what_cannot_be_opened_is_refused_before_the_page_opens() {
        let line = one_line(&open("dir:/nowhere/at/all").unwrap_err());
        assert!(line.starts_with("--from: dir:/nowhere/at/all") && line.contains("expected a folder"), "{line}");
    }
}
