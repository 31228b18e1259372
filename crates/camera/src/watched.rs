//! Detects faults in the pictures: frozen, black, other size.

use image::RgbImage;

use crate::error::CameraError;
use crate::fault::Fault;
use crate::frame::{Camera, Frame};

/// Maximum value of a channel in a black picture: compression leaves small values.
const NEAR_BLACK: u8 = 24;
/// One channel in this many may be brighter in a black picture: sensors have single bright pixels.
const MAX_BRIGHT_SHARE: usize = 1000;

/// Adds the faults of a camera's pictures to [`Frame::faults`].
pub struct Watched<C> {
    camera: C,
    /// Number of equal pictures that count as frozen; `None` if equal pictures are normal, as in files.
    frozen_frames: Option<u32>,
    last: Option<RgbImage>,
    num_equal: u32,
}

impl<C: Camera> Watched<C> {
    /// Watches a camera. `frozen_frames` bit-identical frames in a row are a fault; `None` disables this check, as for
    /// files.
    pub fn new(camera: C, frozen_frames: Option<u32>) -> Self {
        Self { camera, frozen_frames, last: None, num_equal: 0 }
    }

    fn inspect(&mut self, frame: &mut Frame) {
        if is_black(&frame.picture) {
            frame.faults.push(Fault::Black);
        }
        let now = frame.picture.dimensions();
        match self.last.as_ref().map(RgbImage::dimensions) {
            Some(before) if before != now => frame.faults.push(Fault::OtherSize { before, now }),
            _ => {}
        }
        self.num_equal = if self.last.as_ref() == Some(&frame.picture) { self.num_equal + 1 } else { 1 };
        if self.frozen_frames.is_some_and(|limit| self.num_equal >= limit.max(2)) {
            frame.faults.push(Fault::Frozen { num_frames: self.num_equal });
        }
        if self.num_equal == 1 {
            self.last = Some(frame.picture.clone());
        }
    }
}

impl<C: Camera> Camera for Watched<C> {
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        let mut frame = self.camera.next_frame()?;
        if let Some(frame) = &mut frame {
            self.inspect(frame);
        }
        Ok(frame)
    }

    fn is_on_request(&self) -> bool {
        self.camera.is_on_request()
    }
}

fn is_black(picture: &RgbImage) -> bool {
    let bytes = picture.as_raw();
    let limit = bytes.len() / MAX_BRIGHT_SHARE;
    // The first pixels usually exceed the limit, except in black pictures.
    bytes.iter().filter(|&&byte| byte > NEAR_BLACK).take(limit + 1).count() <= limit
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use std::vec::IntoIter;

    struct Pictures(IntoIter<RgbImage>);

    impl Camera for Pictures {
        fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
            Ok(self.0.next().map(|picture| Frame::new(picture, 0, "test:".into())))
        }
    }

    /// The faults of each picture.
    fn faults(pictures: Vec<RgbImage>, frozen_frames: Option<u32>) -> Vec<Vec<Fault>> {
        let mut camera = Watched::new(Pictures(pictures.into_iter()), frozen_frames);
        std::iter::from_fn(|| camera.next_frame().unwrap()).map(|frame| frame.faults).collect()
    }

    fn grey(level: u8) -> RgbImage {
        RgbImage::from_pixel(40, 25, Rgb([level; 3]))
    }

    #[test]
    fn the_same_bits_again_and_again_are_frozen() {
        let pictures = vec![grey(99), grey(99), grey(99), grey(99), grey(98), grey(99)];
        let frozen = |num_frames| vec![Fault::Frozen { num_frames }];
        assert_eq!(faults(pictures.clone(), Some(3)), [vec![], vec![], frozen(3), frozen(4), vec![], vec![]]);
        assert_eq!(faults(pictures, None), vec![vec![]; 6]);
        let mut noise = grey(99);
        noise.put_pixel(39, 24, Rgb([99, 99, 98]));
        assert_eq!(faults(vec![grey(99), noise, grey(99)], Some(2)), vec![vec![]; 3]);
    }

    #[test]
    fn black_is_dark_but_for_single_pixels() {
        let mut hot = grey(NEAR_BLACK);
        hot.put_pixel(3, 3, Rgb([255; 3]));
        let mut lit = hot.clone();
        lit.put_pixel(4, 3, Rgb([255; 3]));
        // 40 × 25 pixels have 3000 channels, of which 3 may be bright.
        assert_eq!(faults(vec![hot, lit, grey(NEAR_BLACK + 1)], None), [vec![Fault::Black], vec![], vec![]]);
    }

    #[test]
    fn another_size_is_told_once() {
        let wide = || RgbImage::from_pixel(50, 25, Rgb([99; 3]));
        let told = vec![Fault::OtherSize { before: (40, 25), now: (50, 25) }];
        assert_eq!(faults(vec![grey(99), wide(), wide()], None), [vec![], told, vec![]]);
    }
}
