//! Motion JPEG: one endless response with a picture in each part.

use std::time::{Duration, Instant, SystemTime};

use sdg_picture::PixelFrame;

use super::body::{Body, Progress};
use super::multipart::Multipart;
use crate::decode::decode;
use crate::source::{Missing, Source, Taken};

/// Maximum time for skipping to newer pictures, so that a server that sends faster than the client reads does not cause
/// an endless loop.
const MAX_CATCH_UP: Duration = Duration::from_millis(20);

/// One connection.
pub(super) struct MotionJpeg {
    multipart: Multipart,
    body: Body,
    frame: PixelFrame,
    /// The end of the connection, if it was reached while skipping.
    end: Option<Result<Progress, String>>,
}

impl MotionJpeg {
    /// A source of JPEG pictures from the body of a response with this content type.
    ///
    /// # Errors
    /// Text that says that the content type has no boundary.
    pub(super) fn new(content_type: &str, body: Body, frame: PixelFrame) -> Result<Self, String> {
        Ok(Self { multipart: Multipart::new(content_type)?, body, frame, end: None })
    }

    /// Skips to the newest part received; counts the skipped parts.
    fn catch_up(&mut self, mut part: Vec<u8>) -> (Vec<u8>, u64) {
        let start = Instant::now();
        let mut num_skipped = 0;
        // Invalid framing only ends this loop: the next call finds it again and reports it.
        loop {
            match self.multipart.next_part() {
                Ok(Some(newer)) => {
                    part = newer;
                    num_skipped += 1;
                }
                Ok(None) if start.elapsed() < MAX_CATCH_UP => match self.body.read(self.multipart.buffer(), None) {
                    Ok(Progress::More) => {}
                    Ok(Progress::Late) => return (part, num_skipped),
                    end => {
                        self.end = Some(end);
                        return (part, num_skipped);
                    }
                },
                _ => return (part, num_skipped),
            }
        }
    }
}

impl Source for MotionJpeg {
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing> {
        loop {
            if let Some(part) = self.multipart.next_part().map_err(Missing::Gone)? {
                let (part, num_skipped) = self.catch_up(part);
                let captured = SystemTime::now();
                let picture = decode(&part, self.frame).map_err(Missing::Torn)?;
                return Ok(Some(Taken { picture, captured, num_skipped }));
            }
            match self.end.take().unwrap_or_else(|| self.body.read(self.multipart.buffer(), Some(deadline))) {
                Ok(Progress::More) => {}
                Ok(Progress::Late) => return Err(Missing::Late),
                Ok(Progress::End) if self.multipart.is_in_part() => {
                    return Err(Missing::Gone(
                        "the server closed the connection in the middle of a picture".to_owned(),
                    ));
                }
                Ok(Progress::End) => return Err(Missing::Gone("the server closed the connection".to_owned())),
                Err(why) => return Err(Missing::Gone(why)),
            }
        }
    }
}
