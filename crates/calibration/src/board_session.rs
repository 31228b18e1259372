//! Takes the pictures for a calibration from a camera's frames, and states the view that is needed next.

use image::RgbImage;
use sdg_geometry::BoundingBox;

use crate::board::Board;
use crate::detection::{SeenCorner, find_board};
use crate::error::CalibrationError;
use crate::intrinsics::{CalibrationConfig, MIN_PICTURES, calibrate};
use crate::taking::{PictureTaker, Sight};

/// Number of pictures after which taking ends if nothing is missing; docs/calibration.md states this number and
/// [`MAX_TAKEN`].
const MIN_TAKEN: usize = 12;
/// Number of pictures after which taking always ends: more do not improve the result.
const MAX_TAKEN: usize = 40;

/// The pictures taken so far.
#[derive(Debug, Clone)]
pub struct BoardSession<'a> {
    board: &'a Board,
    config: CalibrationConfig,
    taker: PictureTaker,
    next: String,
}

/// The board in a frame.
#[derive(Debug, Clone)]
pub struct BoardSight {
    /// The board's corners; none if it is not visible.
    pub corners: Vec<SeenCorner>,
    /// Whether the frame is to be taken: the caller stores it and calls [`BoardSession::keep`].
    pub is_new: bool,
    /// The frame's state in words.
    pub words: String,
}

impl<'a> BoardSession<'a> {
    /// Starts a session with frames of a size. `is_live` is false for pictures that are taken one by one, in each of
    /// which the board is at rest.
    pub fn new(board: &'a Board, config: CalibrationConfig, is_live: bool) -> Self {
        let taker = PictureTaker::new(config.width, config.height);
        let taker = if is_live { taker } else { taker.of_single_pictures() };
        let next = "show the board, tilted by 20 to 40 degrees, and hold it still".to_owned();
        Self { board, config, taker, next }
    }

    /// Width and height of the frames.
    pub fn size(&self) -> (u32, u32) {
        (self.config.width, self.config.height)
    }

    /// The corners of all taken pictures, in order.
    pub fn taken(&self) -> &[Vec<SeenCorner>] {
        self.taker.taken()
    }

    /// The view that is needed most, in words; empty if nothing is known to be missing.
    pub fn next(&self) -> &str {
        &self.next
    }

    /// Whether enough pictures are taken.
    pub fn is_done(&self) -> bool {
        let num_taken = self.taken().len();
        num_taken >= MAX_TAKEN || (num_taken >= MIN_TAKEN && self.next.is_empty())
    }

    /// Searches the next frame for the board.
    pub fn look(&mut self, picture: &RgbImage) -> BoardSight {
        let corners = match find_board(&image::imageops::grayscale(picture), self.board) {
            Ok(corners) => corners,
            Err(error) => {
                self.taker.lose();
                let words = match error {
                    CalibrationError::OtherBoard { .. } | CalibrationError::OtherCheckerboard { .. } => {
                        error.to_string()
                    }
                    _ => "no board is visible".to_owned(),
                };
                return BoardSight { corners: Vec::new(), is_new: false, words };
            }
        };
        let sight = self.taker.look(&corners);
        let words = match sight {
            Sight::Moving => "hold it still",
            Sight::Known => "this view is taken, move the board",
            Sight::New => "picture taken",
        };
        BoardSight { corners, is_new: sight == Sight::New, words: words.to_owned() }
    }

    /// Records the corners of a stored frame.
    pub fn keep(&mut self, corners: Vec<SeenCorner>) {
        self.taker.keep(corners);
        self.next = self.lacking();
    }

    fn lacking(&self) -> String {
        let taken = self.taken();
        if taken.len() < MIN_PICTURES {
            return "tilt the board another way, by 20 to 40 degrees".to_owned();
        }
        match calibrate(self.board, taken, &self.config) {
            Ok(found) => found.advice.first().map(ToString::to_string).unwrap_or_default(),
            Err(CalibrationError::PosesAlike { .. }) => {
                "tilt the board more, to the left and right, upwards and downwards".to_owned()
            }
            Err(error) => error.to_string(),
        }
    }

    /// The cells of a 3x3 grid over the picture that contain no corner so far.
    pub fn empty_parts(&self) -> Vec<BoundingBox> {
        let [width, height] = [self.config.width, self.config.height].map(|side| f64::from(side) / 3.0);
        let parts = (0..9).map(|k| {
            let [x1, y1] = [f64::from(k % 3) * width, f64::from(k / 3) * height];
            BoundingBox { x1, y1, x2: x1 + width, y2: y1 + height }
        });
        let is_seen = |part: &BoundingBox| {
            self.taken()
                .iter()
                .flatten()
                .any(|seen| (part.x1..part.x2).contains(&seen.pixel.x) && (part.y1..part.y2).contains(&seen.pixel.y))
        };
        parts.filter(|part| !is_seen(part)).collect()
    }
}
