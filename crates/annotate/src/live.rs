//! Live pictures, of whatever implements [`LivePictures`].
//!
//! A frame that was shown to the page is kept for a while, so that the photo that is taken is the one that the person saw, and
//! detections are drawn on the picture that they were found in.

use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use image::RgbImage;
use serde::Serialize;

use crate::error::{Error, Result};

/// Frames that are kept after they were shown: some for each of the few pages that may be open.
const MAX_KEPT: usize = 8;

/// A camera as the page needs it.
pub trait LivePictures: fmt::Debug + Send + Sync + 'static {
    /// The newest picture and what is wrong with the camera; does not wait.
    fn newest(&self) -> Live;
}

/// A camera's newest picture and its state.
#[derive(Debug, Clone, Default)]
pub struct Live {
    /// `None` until the first picture.
    pub frame: Option<LiveFrame>,
    /// `None` where nothing is wrong.
    pub fault: Option<LiveFault>,
}

/// One picture of a camera.
#[derive(Debug, Clone)]
pub struct LiveFrame {
    /// The picture.
    pub picture: Arc<RgbImage>,
    /// Tells it from every other picture of the camera.
    pub number: u64,
    /// The time since it arrived.
    pub age: Duration,
}

/// What is wrong with a camera.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LiveFault {
    /// What kind of fault it is.
    pub kind: LiveFaultKind,
    /// The same for people, in one line.
    pub text: String,
}

/// Kinds of faults of a live camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LiveFaultKind {
    /// No new picture for too long.
    Stale,
    /// The same picture again and again.
    Frozen,
    /// Pictures do not arrive whole.
    Torn,
    /// The camera cannot be reached; it is tried again.
    Gone,
    /// The pictures are black.
    Black,
    /// Pictures of another size than the calibrated camera's.
    OtherSize,
    /// There will be no more pictures, as at the end of a folder; the last one stays.
    Ended,
    /// It failed and is not opened again.
    Failed,
}

impl LiveFaultKind {
    /// Whether the newest picture shows what the camera was meant to show.
    pub fn is_usable(self) -> bool {
        self == Self::Ended
    }
}

/// The camera that a session is opened with.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// Source of its pictures.
    pub pictures: Arc<dyn LivePictures>,
    /// What the page calls it.
    pub address: String,
    /// Where the first photo is written, if there is no file of that name yet; further ones get numbers.
    pub photo_path: PathBuf,
}

/// The camera of a session, and the frames that were shown.
#[derive(Debug)]
pub(crate) struct LiveDesk {
    pub(crate) options: LiveOptions,
    kept: Mutex<VecDeque<LiveFrame>>,
}

impl LiveDesk {
    pub(crate) fn new(options: LiveOptions) -> Self {
        Self { options, kept: Mutex::default() }
    }

    fn kept(&self) -> MutexGuard<'_, VecDeque<LiveFrame>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The newest frame, which is kept from now on, and what is wrong with the camera.
    pub(crate) fn newest(&self) -> Live {
        let live = self.options.pictures.newest();
        if let Some(frame) = &live.frame {
            let mut kept = self.kept();
            if kept.iter().all(|known| known.number != frame.number) {
                kept.push_back(frame.clone());
            }
            if kept.len() > MAX_KEPT {
                kept.pop_front();
            }
        }
        live
    }

    /// The picture of a frame that was shown.
    ///
    /// # Errors
    /// [`Error::NoSuchFrame`] for one that is not kept any more.
    pub(crate) fn frame(&self, number: u64) -> Result<Arc<RgbImage>> {
        let kept = self.kept();
        let frame = kept.iter().find(|frame| frame.number == number).ok_or(Error::NoSuchFrame { number })?;
        Ok(Arc::clone(&frame.picture))
    }

    /// The picture of a frame to make a photo of.
    ///
    /// # Errors
    /// As [`frame`](Self::frame), and [`Error::Camera`] while the camera shows something else than what is before it.
    pub(crate) fn photo(&self, number: u64) -> Result<Arc<RgbImage>> {
        match self.options.pictures.newest().fault.filter(|fault| !fault.kind.is_usable()) {
            Some(fault) => Err(Error::Camera { expected: "a camera that shows what is before it", found: fault.text }),
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
        assert!(desk.frame(10).is_err(), "nobody has seen it");
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
