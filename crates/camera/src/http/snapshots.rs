//! Single pictures, requested repeatedly.

use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use sdg_picture::PixelFrame;

use super::body::Progress;
use super::exchange::{Answer, Login, get};
use super::url::Url;
use crate::decode::{MAX_ENCODED_BYTES, decode};
use crate::options::OpenOptions;
use crate::source::{Missing, Source, Taken};

/// A server of single pictures.
pub(super) struct Snapshots {
    url: Url,
    login: Login,
    /// The response by which the server was recognised as one of single pictures, and the time before its request.
    first: Option<(SystemTime, Answer)>,
    interval: Duration,
    next_at: Instant,
    frame: PixelFrame,
}

impl Snapshots {
    pub(super) fn new(url: Url, login: Login, first: (SystemTime, Answer), options: &OpenOptions) -> Self {
        let fps = options.fps.unwrap_or(OpenOptions::DEFAULT_SNAPSHOT_FPS);
        Self {
            url,
            login,
            first: Some(first),
            interval: Duration::from_secs_f64(1.0 / fps),
            next_at: Instant::now(),
            frame: options.frame,
        }
    }
}

impl Source for Snapshots {
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing> {
        let wait = self.next_at.saturating_duration_since(Instant::now());
        sleep(wait);
        // Waiting for the requested interval is not a delay of the camera.
        let deadline = deadline + wait;
        self.next_at = Instant::now() + self.interval;
        // A server may take the picture as soon as it receives the request, long before the picture arrives.
        let asked = SystemTime::now();
        let (captured, mut answer) = match self.first.take() {
            Some(first) => first,
            None => (asked, get(&self.url, &mut self.login, deadline).map_err(Missing::Gone)?),
        };
        if !answer.content_type.trim_start().to_ascii_lowercase().starts_with("image/") {
            return Err(Missing::Gone(format!("expected a picture, found {}", answer.content_type)));
        }
        let mut bytes = Vec::new();
        loop {
            match answer.body.read(&mut bytes, Some(deadline)) {
                Ok(Progress::More) if bytes.len() > MAX_ENCODED_BYTES => {
                    return Err(Missing::Gone(format!(
                        "expected a picture of at most {MAX_ENCODED_BYTES} bytes, found more"
                    )));
                }
                Ok(Progress::More) => {}
                Ok(Progress::End) => break,
                // The request of a late picture is abandoned; the next call sends a new one.
                Ok(Progress::Late) => return Err(Missing::Late),
                Err(why) => return Err(Missing::Torn(format!("{} bytes, then: {why}", bytes.len()))),
            }
        }
        let picture = decode(&bytes, self.frame).map_err(Missing::Torn)?;
        Ok(Some(Taken { picture, captured, num_skipped: 0 }))
    }

    fn is_on_request(&self) -> bool {
        true
    }
}
