//! Live pictures from any implementation of [`LivePictures`].
//!
//! Frames shown on the page are kept for a while: a photo is the frame that the person saw, and detections are drawn on
//! the frame in which they were found. A page that pauses holds its frame, so that other pages do not displace it.

use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use image::RgbImage;
use serde::Serialize;

use crate::error::{Error, Result};

/// Number of shown frames that are kept, several for each open page; and of held ones.
const MAX_KEPT: usize = 8;

/// A camera as used by the page.
pub trait LivePictures: fmt::Debug + Send + Sync + 'static {
    /// The newest picture and the camera's fault, without waiting.
    fn newest(&self) -> Live;
}

/// A camera's newest picture and its state.
#[derive(Debug, Clone, Default)]
pub struct Live {
    /// `None` until the first picture.
    pub frame: Option<LiveFrame>,
    /// `None` if there is no fault.
    pub fault: Option<LiveFault>,
}

/// One picture of a camera.
#[derive(Debug, Clone)]
pub struct LiveFrame {
    /// The picture.
    pub picture: Arc<RgbImage>,
    /// Number, unique among the camera's pictures.
    pub number: u64,
    /// Time since its arrival.
    pub age: Duration,
}

/// A fault of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LiveFault {
    /// The kind of fault.
    pub kind: LiveFaultKind,
    /// One line of text for the user.
    pub text: String,
}

/// Kinds of faults of a live camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LiveFaultKind {
    /// No new picture for too long.
    Stale,
    /// The same picture repeatedly.
    Frozen,
    /// Pictures are incomplete.
    Torn,
    /// The camera cannot be reached; connecting is retried.
    Gone,
    /// The pictures are black.
    Black,
    /// Pictures of another size than the calibrated camera's.
    OtherSize,
    /// There are no more pictures, as at the end of a folder; the last one remains.
    Ended,
    /// The camera failed and is not opened again.
    Failed,
}

impl LiveFaultKind {
    /// Whether the newest picture can be used in spite of the fault.
    pub fn is_usable(self) -> bool {
        self == Self::Ended
    }
}

/// The camera of a session.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// Source of its pictures.
    pub pictures: Arc<dyn LivePictures>,
    /// Name shown on the page.
    pub address: String,
    /// Path of the first photo, if no such file exists; further photos get numbers.
    pub photo_path: PathBuf,
}

/// The camera of a session, and the frames shown so far.
#[derive(Debug)]
pub(crate) struct LiveDesk {
    pub(crate) options: LiveOptions,
    kept: Mutex<Kept>,
}

/// The last shown frames, and the last held ones.
#[derive(Debug, Default)]
struct Kept {
    shown: VecDeque<LiveFrame>,
    held: VecDeque<LiveFrame>,
}

impl Kept {
    fn find(&self, number: u64) -> Result<&LiveFrame> {
        let mut frames = self.shown.iter().chain(&self.held);
        frames.find(|frame| frame.number == number).ok_or(Error::NoSuchFrame { number })
    }
}

fn push(frames: &mut VecDeque<LiveFrame>, frame: LiveFrame) {
    if frames.iter().all(|known| known.number != frame.number) {
        frames.push_back(frame);
    }
    if frames.len() > MAX_KEPT {
        frames.pop_front();
    }
}

impl LiveDesk {
    pub(crate) fn new(options: LiveOptions) -> Self {
        Self { options, kept: Mutex::default() }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The newest frame, which is kept from now on, and the camera's fault.
    pub(crate) fn newest(&self) -> Live {
        let live = self.options.pictures.newest();
        if let Some(frame) = &live.frame {
            push(&mut self.kept().shown, frame.clone());
        }
        live
    }

    /// Keeps a shown frame beyond those shown later, until [`MAX_KEPT`] others are held.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub(crate) fn hold(&self, number: u64) -> Result<()> {
        let mut kept = self.kept();
        let frame = kept.find(number)?.clone();
        push(&mut kept.held, frame);
        Ok(())
    }

    /// The picture of a shown frame.
    ///
    /// # Errors
    /// [`Error::NoSuchFrame`] if it is no longer kept.
    pub(crate) fn frame(&self, number: u64) -> Result<Arc<RgbImage>> {
        Ok(Arc::clone(&self.kept().find(number)?.picture))
    }

    /// The picture of a shown frame, for use as a photo.
    ///
    /// # Errors
    /// As [`frame`](Self::frame), and [`Error::Camera`] while the camera has a fault that makes its picture unusable.
    pub(crate) fn photo(&self, number: u64) -> Result<Arc<RgbImage>> {
        match self.options.pictures.newest().fault.filter(|fault| !fault.kind.is_usable()) {
            Some(fault) => Err(Error::Camera { expected: "a camera without a fault", found: fault.text }),
            None => self.frame(number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera whose newest picture the test sets.
    #[derive(Debug, Default)]
    struct Still(Mutex<Live>);

    impl LivePictures for Still {
        fn newest(&self) -> Live {
            self.0.lock().unwrap().clone()
        }
    }

    fn desk() -> (LiveDesk, Arc<Still>) {
        let still = Arc::new(Still::default());
        let pictures = Arc::clone(&still) as Arc<dyn LivePictures>;
        (LiveDesk::new(LiveOptions { pictures, address: "test:".into(), photo_path: "photo.png".into() }), still)
    }

    fn show(still: &Still, number: u64) {
        let picture = Arc::new(RgbImage::from_pixel(1, 1, image::Rgb([number as u8; 3])));
        still.0.lock().unwrap().frame = Some(LiveFrame { picture, number, age: Duration::ZERO });
    }

    fn fault(still: &Still, kind: LiveFaultKind) {
        still.0.lock().unwrap().fault = Some(LiveFault { kind, text: "covered".into() });
    }

    #[test]
    fn the_last_frames_that_were_shown_are_kept() {
        let (desk, still) = desk();
        assert!(desk.newest().frame.is_none());
        for number in 0..10 {
            show(&still, number);
            desk.newest();
            desk.newest();
        }
        show(&still, 10);
        assert!(matches!(desk.frame(1), Err(Error::NoSuchFrame { number: 1 })));
        assert_eq!(desk.frame(2).unwrap().get_pixel(0, 0)[0], 2);
        assert!(desk.frame(9).is_ok());
        assert!(desk.frame(10).is_err(), "this frame was never shown");
    }

    #[test]
    fn a_held_frame_stays_while_another_page_shows_the_next_ones() {
        let (desk, still) = desk();
        for number in 0..20 {
            show(&still, number);
            desk.newest();
            if number == 3 {
                desk.hold(3).unwrap();
            }
        }
        assert_eq!(desk.frame(3).unwrap().get_pixel(0, 0)[0], 3);
        assert!(desk.frame(4).is_err() && desk.hold(4).is_err());
    }

    #[test]
    fn no_photo_is_taken_with_a_camera_that_shows_something_else() {
        let (desk, still) = desk();
        show(&still, 0);
        desk.newest();
        for kind in [LiveFaultKind::Stale, LiveFaultKind::Frozen, LiveFaultKind::Gone, LiveFaultKind::Black] {
            fault(&still, kind);
            let refusal = desk.photo(0).unwrap_err().to_string();
            assert!(refusal.contains("found covered"), "{refusal}");
            assert!(desk.frame(0).is_ok(), "it is shown all the same");
        }
        fault(&still, LiveFaultKind::Ended);
        assert!(desk.photo(0).is_ok());
    }
}
