//! Selects frames of a camera for the calibration: frames in which the board is at rest, in a view that differs from
//! all previous views.

use nalgebra::Vector2;
use sdg_geometry::median;

use crate::detection::SeenCorner;

/// Largest movement of the corners of a board at rest, as a fraction of the picture's diagonal. Chosen by hand: 1.6
/// pixels of 640 × 480.
const STILL_SHARE: f64 = 0.002;
/// Number of successive frames at rest that are required, so that no picture is blurred.
const STILL_FRAMES: u32 = 4;
/// A view is new if its corners are at least this far from those of every taken view, as a fraction of the diagonal.
/// Chosen by hand: 48 pixels of 640 × 480.
const NEW_PLACE_SHARE: f64 = 0.06;
/// Like [`NEW_PLACE_SHARE`], for the corners relative to their centre: another tilt or size at the same place. Chosen
/// by hand: 10 pixels of 640 × 480, the effect of a tilt by 25 degrees on a board that fills half of the picture.
const NEW_SHAPE_SHARE: f64 = 0.0125;

/// The state of the board in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// The board moves, or has not been at rest for enough frames.
    Moving,
    /// At rest, in a view that was taken already.
    Known,
    /// At rest, in a new view: to be taken.
    New,
}

/// Selects the frames of a camera that a calibration needs.
#[derive(Debug, Clone, Default)]
pub struct PictureTaker {
    diagonal_px: f64,
    still_frames: u32,
    taken: Vec<Vec<SeenCorner>>,
    /// The corners at the beginning of the rest, and the number of frames since then.
    still: Option<(Vec<SeenCorner>, u32)>,
}

impl PictureTaker {
    /// Creates a selector for successive frames of this size.
    pub fn new(width: u32, height: u32) -> Self {
        let diagonal_px = f64::from(width).hypot(f64::from(height));
        Self { diagonal_px, still_frames: STILL_FRAMES, ..Self::default() }
    }

    /// Switches to pictures that are taken one by one, in each of which the board is at rest.
    #[must_use]
    pub fn of_single_pictures(self) -> Self {
        Self { still_frames: 1, ..self }
    }

    /// Processes the next frame, which shows these corners.
    pub fn look(&mut self, corners: &[SeenCorner]) -> Sight {
        let is_still = |from: &[SeenCorner]| {
            distances_px(from, corners).is_some_and(|[place, _]| place <= STILL_SHARE * self.diagonal_px)
        };
        let num_still = match &mut self.still {
            Some((from, num)) if is_still(from) => {
                *num += 1;
                *num
            }
            still => {
                *still = Some((corners.to_vec(), 1));
                1
            }
        };
        if num_still < self.still_frames {
            return Sight::Moving;
        }
        let is_known = |taken: &Vec<SeenCorner>| {
            distances_px(taken, corners).is_some_and(|[place, shape]| {
                place < NEW_PLACE_SHARE * self.diagonal_px && shape < NEW_SHAPE_SHARE * self.diagonal_px
            })
        };
        if self.taken.iter().any(is_known) { Sight::Known } else { Sight::New }
    }

    /// Processes the next frame, which does not show the board.
    pub fn lose(&mut self) {
        self.still = None;
    }

    /// Records the corners of a picture that was taken.
    pub fn keep(&mut self, corners: Vec<SeenCorner>) {
        self.taken.push(corners);
    }

    /// The corners of all taken pictures, in order.
    pub fn taken(&self) -> &[Vec<SeenCorner>] {
        &self.taken
    }
}

/// Medians of two distances over the common corners, in pixels: between the corners, and between the corners relative
/// to their centres. `None` without common corners.
fn distances_px(one: &[SeenCorner], other: &[SeenCorner]) -> Option<[f64; 2]> {
    let apart = one.iter().filter_map(|seen| {
        let same = other.iter().find(|same| same.corner == seen.corner)?;
        Some(same.pixel - seen.pixel)
    });
    let apart: Vec<Vector2<f64>> = apart.collect();
    let mean = apart.iter().sum::<Vector2<f64>>() / apart.len() as f64;
    let place = median(apart.iter().map(|vector| vector.norm()))?;
    Some([place, median(apart.iter().map(|vector| (vector - mean).norm()))?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    /// Corners of one row of the board, such as 0 to 11. Corner 0 is, or would be, at (x, y).
    fn row(x: f64, y: f64, corners: std::ops::Range<u32>) -> Vec<SeenCorner> {
        let corner = |k: u32| SeenCorner { corner: [k, 0], pixel: Point2::new(x + 20.0 * f64::from(k), y) };
        corners.map(corner).collect()
    }

    #[test]
    fn a_board_is_taken_when_it_has_come_to_rest_and_only_once() {
        let mut taker = PictureTaker::new(640, 480);
        let moving = (0..6).map(|k| taker.look(&row(100.0 + 3.0 * f64::from(k), 50.0, 0..12)));
        assert!(moving.collect::<Vec<_>>().iter().all(|sight| *sight == Sight::Moving));
        let resting = row(115.5, 50.0, 0..12);
        let sights = [(); 3].map(|()| taker.look(&resting));
        assert_eq!(sights, [Sight::Moving, Sight::Moving, Sight::New]);
        taker.keep(resting.clone());
        assert_eq!(taker.look(&resting), Sight::Known);
        // Within 48 pixels the view is the same.
        let sights = [(); 4].map(|()| taker.look(&row(115.5, 90.0, 0..12)));
        assert_eq!(sights[3], Sight::Known);
        let sights = [(); 4].map(|()| taker.look(&row(115.5, 100.0, 0..12)));
        assert_eq!(sights[3], Sight::New);
        assert_eq!(taker.taken().len(), 1);
    }

    #[test]
    fn another_size_at_the_same_place_is_a_new_view() {
        let mut taker = PictureTaker::new(640, 480).of_single_pictures();
        let sized = |step: f64| -> Vec<SeenCorner> {
            let corner =
                |k: u32| SeenCorner { corner: [k, 0], pixel: Point2::new(320.0 + step * (f64::from(k) - 5.5), 240.0) };
            (0..12).map(corner).collect()
        };
        taker.keep(sized(30.0));
        // The corners are 0.5 to 5.5 steps from their centre, with a median of 3. Steps that are longer by 2 pixels
        // change this distance by 6 pixels, steps that are longer by 4 pixels by 12. A new view requires 10 pixels.
        assert_eq!(taker.look(&sized(32.0)), Sight::Known);
        assert_eq!(taker.look(&sized(34.0)), Sight::New);
    }

    #[test]
    fn slow_motion_is_no_rest_and_a_board_that_was_gone_begins_anew() {
        let mut taker = PictureTaker::new(640, 480);
        let mut seen = Vec::new();
        for k in 0..30 {
            seen.push(taker.look(&row(100.0 + 0.7 * f64::from(k), 50.0, 0..12)));
        }
        assert!(seen.iter().all(|sight| *sight == Sight::Moving), "{seen:?}");
        let resting = row(200.0, 50.0, 0..12);
        let first = [(); 3].map(|()| taker.look(&resting));
        taker.lose();
        assert_eq!((first, taker.look(&resting)), ([Sight::Moving; 3], Sight::Moving));
    }

    #[test]
    fn other_corners_of_the_board_are_a_new_view_and_single_pictures_need_no_rest() {
        let mut taker = PictureTaker::new(640, 480).of_single_pictures();
        assert_eq!(taker.look(&row(100.0, 50.0, 0..6)), Sight::New);
        taker.keep(row(100.0, 50.0, 0..6));
        assert_eq!(taker.look(&row(100.0, 50.0, 6..12)), Sight::New);
        assert_eq!(taker.look(&row(100.0, 50.0, 3..9)), Sight::Known);
    }
}
