//! Tiles of noise, drawn once and read at any position, angle and scale.

use rand::Rng;

use super::random::SampleRng;
use crate::raster::floor;

/// Side of a tile; a power of two, so that wrapping is a mask.
const SIDE: usize = 256;

/// Noise in `[0, 1]` that repeats every 256 pixels without a seam.
pub(crate) struct NoiseTile {
    /// An array, whose length the compiler knows: a masked index needs no check.
    values: Box<[f32; SIDE * SIDE]>,
}

impl NoiseTile {
    /// Sums octaves of smooth noise: the first has `coarsest` cells per side, each next one twice as many and
    /// `fall` times the strength.
    pub fn fractal(rng: &mut SampleRng, coarsest: usize, octaves: u32, fall: f32) -> Self {
        let mut values = vec![0.0; SIDE * SIDE].into_boxed_slice();
        let mut strength = 1.0;
        for octave in 0..octaves {
            let cells = (coarsest << octave).min(SIDE);
            let lattice: Vec<f32> = (0..cells * cells).map(|_| rng.random::<f32>()).collect();
            let cell = SIDE / cells;
            for y in 0..SIDE {
                let (v, fy) = (y / cell, ease((y % cell) as f32 / cell as f32));
                let (upper, lower) = (v * cells, (v + 1) % cells * cells);
                for x in 0..SIDE {
                    let (u, fx) = (x / cell, ease((x % cell) as f32 / cell as f32));
                    let right = (u + 1) % cells;
                    let top = lattice[upper + u] + (lattice[upper + right] - lattice[upper + u]) * fx;
                    let bottom = lattice[lower + u] + (lattice[lower + right] - lattice[lower + u]) * fx;
                    values[y * SIDE + x] += strength * (top + (bottom - top) * fy);
                }
            }
            strength *= fall;
        }
        let (low, high) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        values.iter_mut().for_each(|v| *v = (*v - low) / (high - low).max(1e-6));
        Self { values: values.try_into().expect("one value was made for each pixel of the tile") }
    }

    /// Value at a point, by bilinear interpolation.
    #[inline(always)]
    pub fn at(&self, x: f32, y: f32) -> f32 {
        let (column, row) = (floor(x), floor(y));
        let (fx, fy) = (x - column as f32, y - row as f32);
        // Negative positions also wrap.
        let (u, v) = (column as usize & (SIDE - 1), row as usize & (SIDE - 1));
        let (right, below) = ((u + 1) & (SIDE - 1), (v + 1) & (SIDE - 1));
        let top = self.values[v * SIDE + u] + (self.values[v * SIDE + right] - self.values[v * SIDE + u]) * fx;
        let bottom =
            self.values[below * SIDE + u] + (self.values[below * SIDE + right] - self.values[below * SIDE + u]) * fx;
        top + (bottom - top) * fy
    }
}

fn ease(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// Normally distributed numbers, drawn once and read in runs from random positions.
pub(crate) struct NormalTable {
    values: Vec<f32>,
}

impl NormalTable {
    const LENGTH: usize = 1 << 16;

    pub fn new(rng: &mut SampleRng) -> Self {
        // Twelve uniform numbers minus six have variance one and tails long enough for a sensor.
        let values = (0..Self::LENGTH).map(|_| (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0).collect();
        Self { values }
    }

    /// `length` numbers from the position given by `address`.
    pub fn run(&self, address: u64, length: usize) -> &[f32] {
        let start = (address % (Self::LENGTH - length) as u64) as usize;
        &self.values[start..start + length]
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Stream, sample_rng};
    use super::*;

    #[test]
    fn a_tile_repeats_without_a_seam() {
        let tile = NoiseTile::fractal(&mut sample_rng(3, Stream::Preparation, 0), 4, 3, 0.5);
        assert_eq!(tile.at(10.25, 20.5), tile.at(10.25 - 256.0, 20.5 + 512.0));
        // Without a seam, each octave changes by at most 1.5 / cell per pixel; the two positions are 0.02 pixels apart.
        assert!((tile.at(255.99, 7.0) - tile.at(0.01, 7.0)).abs() < 0.02);
        let mean = tile.values.iter().sum::<f32>() / tile.values.len() as f32;
        assert!((0.35..0.65).contains(&mean), "{mean}");
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let table = NormalTable::new(&mut sample_rng(3, Stream::Preparation, 1));
        let run = table.run(12_345_678_901, 20_000);
        let mean = run.iter().sum::<f32>() / 20_000.0;
        let variance = run.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / 20_000.0;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean}, {variance}");
    }
}
