//! Binary masks and their COCO run-length encoding.

use serde::{Deserialize, Serialize};

use crate::{BoundingBox, GeometryError};

/// One Boolean per pixel, row by row from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    bits: Vec<bool>,
}

impl Mask {
    /// An empty mask.
    pub fn empty(width: u32, height: u32) -> Self {
        Self { width, height, bits: vec![false; width as usize * height as usize] }
    }

    /// A mask whose pixel (x, y) is `inside(x, y)`.
    pub fn from_fn(width: u32, height: u32, mut inside: impl FnMut(u32, u32) -> bool) -> Self {
        let mut bits = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            bits.extend((0..width).map(|x| inside(x, y)));
        }
        Self { width, height, bits }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether the pixel is inside. Panics outside the image.
    pub fn get(&self, x: u32, y: u32) -> bool {
        self.bits[self.index(x, y)]
    }

    /// Sets one pixel. Panics outside the image.
    pub fn set(&mut self, x: u32, y: u32, inside: bool) {
        let index = self.index(x, y);
        self.bits[index] = inside;
    }

    /// The number of pixels inside.
    pub fn area(&self) -> usize {
        self.bits.iter().filter(|&&bit| bit).count()
    }

    /// The tight box around the unit squares of all pixels inside; `None` for an empty mask.
    pub fn bounds(&self) -> Option<BoundingBox> {
        let mut bounds: Option<BoundingBox> = None;
        for y in 0..self.height {
            for x in (0..self.width).filter(|&x| self.get(x, y)) {
                let (x, y) = (f64::from(x), f64::from(y));
                let b = bounds.get_or_insert(BoundingBox { x1: x, y1: y, x2: x + 1.0, y2: y + 1.0 });
                b.x1 = b.x1.min(x);
                b.x2 = b.x2.max(x + 1.0);
                b.y2 = y + 1.0;
            }
        }
        bounds
    }

    /// Intersection over union with a mask of the same size; zero when both are empty.
    pub fn iou(&self, other: &Self) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height), "masks of the same image");
        let (mut intersection, mut union) = (0usize, 0usize);
        for (&a, &b) in self.bits.iter().zip(&other.bits) {
            intersection += usize::from(a && b);
            union += usize::from(a || b);
        }
        if union == 0 { 0.0 } else { intersection as f64 / union as f64 }
    }

    /// Encodes the mask as the lengths of its runs of equal pixels.
    pub fn encode(&self) -> RunLengthMask {
        let mut counts = Vec::new();
        let (mut run, mut inside) = (0u32, false);
        for x in 0..self.width {
            for y in 0..self.height {
                if self.get(x, y) != inside {
                    counts.push(run);
                    run = 0;
                    inside = !inside;
                }
                run += 1;
            }
        }
        counts.push(run);
        RunLengthMask { size: [self.height, self.width], counts }
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of a {} × {} mask", self.width, self.height);
        y as usize * self.width as usize + x as usize
    }
}

/// COCO's uncompressed run-length encoding: column by column, the lengths of alternating runs outside and inside,
/// outside first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunLengthMask {
    /// Height, width.
    pub size: [u32; 2],
    /// Lengths of the runs, in pixels.
    pub counts: Vec<u32>,
}

impl RunLengthMask {
    /// The mask that the runs describe.
    ///
    /// # Errors
    /// Runs that do not add up to height × width; detected before memory is allocated.
    pub fn decode(&self) -> Result<Mask, GeometryError> {
        let [height, width] = self.size;
        let expected = u64::from(height) * u64::from(width);
        let found = self.counts.iter().map(|&count| u64::from(count)).sum();
        if expected != found {
            return Err(GeometryError::RunLengthMismatch { expected, found });
        }
        let mut mask = Mask::empty(width, height);
        let mut position = 0u64;
        for (i, &count) in self.counts.iter().enumerate() {
            if i % 2 == 1 {
                for p in position..position + u64::from(count) {
                    mask.set((p / u64::from(height)) as u32, (p % u64::from(height)) as u32, true);
                }
            }
            position += u64::from(count);
        }
        Ok(mask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn runs_go_down_the_columns() {
        // . X
        // X X   columns: (., X), (X, X)
        let mask = Mask::from_fn(2, 2, |x, y| x + y > 0);
        assert_eq!(mask.encode(), RunLengthMask { size: [2, 2], counts: vec![1, 3] });
        let first_set = Mask::from_fn(2, 1, |x, _| x == 0);
        assert_eq!(first_set.encode().counts, vec![0, 1, 1]);
    }

    #[test]
    fn runs_of_a_wrong_length_are_refused() {
        let runs = RunLengthMask { size: [4000, 4000], counts: vec![3] };
        assert_eq!(runs.decode(), Err(GeometryError::RunLengthMismatch { expected: 16_000_000, found: 3 }));
    }

    #[test]
    fn bounds_cover_whole_pixels() {
        let mask = Mask::from_fn(10, 8, |x, y| (x, y) == (3, 2) || (x, y) == (5, 4));
        assert_eq!(mask.bounds(), Some(BoundingBox { x1: 3.0, y1: 2.0, x2: 6.0, y2: 5.0 }));
        assert_eq!(Mask::empty(3, 3).bounds(), None);
    }

    proptest! {
        #[test]
        fn run_length_round_trip(width in 1u32..9, height in 1u32..9, seed in any::<u64>()) {
            let mask = Mask::from_fn(width, height, |x, y| (seed >> ((x * 9 + y) % 64)) & 1 == 1);
            prop_assert_eq!(mask.encode().decode().unwrap(), mask);
        }
    }
}
