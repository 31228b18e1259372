//! The directions of a keypoint: the peaks of a histogram of the gradients around it.

use std::f64::consts::TAU;

use pulp::{Simd, WithSimd};

use crate::gradient::GradientRow;
use crate::scale_space::Octave;

const NUM_BINS: usize = 36;
/// σ of the window, in units of the keypoint's own σ.
const WINDOW_SIGMA: f64 = 1.5;
/// Radius of the window, in units of its σ.
const WINDOW_RADIUS: f64 = 3.0;
/// Minimum height of a peak that gives a direction, as a fraction of the highest peak.
const PEAK_RATIO: f32 = 0.8;

/// A keypoint in its octave: position and σ in pixels of the octave, and the level nearest to its scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub x: f64,
    pub y: f64,
    pub sigma: f64,
    pub level: usize,
}

/// Finds the directions, in radians, of one keypoint; they are not sorted by strength.
///
/// # Source
/// Lowe 2004, section 5. Each sample is distributed over the two nearest bins; the paper does not specify this.
pub(crate) struct FindOrientations<'a> {
    pub octave: &'a Octave,
    pub place: Place,
    pub gradients: &'a mut GradientRow,
}

impl WithSimd for FindOrientations<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f64> {
        let Self { octave, place, gradients } = self;
        let image = &octave.levels[place.level];
        let sigma = WINDOW_SIGMA * place.sigma;
        let radius = WINDOW_RADIUS * sigma;
        let window = |center: f64, size: usize| {
            let first = (center - radius).ceil().max(1.0) as usize;
            let last = (center + radius).floor().min(size as f64 - 2.0) as usize;
            first..=last
        };
        let weight = |distance: f64| (-0.5 * (distance / sigma).powi(2)).exp() as f32;
        let (columns, rows) = (window(place.x, image.width()), window(place.y, image.height()));
        if columns.is_empty() || rows.is_empty() {
            return Vec::new();
        }
        let column_weights: Vec<f32> = columns.clone().map(|x| weight(x as f64 - place.x)).collect();

        // Two bins more than a full rotation: 2π itself falls into bin 36, and the bin after it is 37.
        let mut open = [0.0f32; NUM_BINS + 2];
        for y in rows {
            gradients.read(image.row(y - 1), image.row(y), image.row(y + 1), *columns.start(), *columns.end());
            let row_weight = weight(y as f64 - place.y);
            let samples = gradients.magnitude.iter().zip(&gradients.direction).zip(&column_weights);
            for ((&magnitude, &direction), &column_weight) in samples {
                let position = direction * (NUM_BINS as f64 / TAU) as f32;
                let bin = (position as usize).min(NUM_BINS);
                let share = position - bin as f32;
                let vote = magnitude * column_weight * row_weight;
                open[bin] += (1.0 - share) * vote;
                open[bin + 1] += share * vote;
            }
        }
        let mut histogram = [0.0f32; NUM_BINS];
        histogram.copy_from_slice(&open[..NUM_BINS]);
        histogram[0] += open[NUM_BINS];
        histogram[1] += open[NUM_BINS + 1];
        peaks(&smoothed(&histogram))
    }
}

/// The histogram smoothed by a binomial of five bins.
fn smoothed(histogram: &[f32; NUM_BINS]) -> [f32; NUM_BINS] {
    let at = |i: usize, shift: usize| histogram[(i + shift) % NUM_BINS];
    std::array::from_fn(|i| {
        (at(i, NUM_BINS - 2) + at(i, 2)) / 16.0 + (at(i, NUM_BINS - 1) + at(i, 1)) / 4.0 + histogram[i] * (3.0 / 8.0)
    })
}

/// The directions of the peaks, each at the vertex of a parabola through three bins.
fn peaks(histogram: &[f32; NUM_BINS]) -> Vec<f64> {
    let highest = histogram.iter().copied().fold(0.0, f32::max);
    let mut found = Vec::new();
    for (i, &value) in histogram.iter().enumerate() {
        let left = histogram[(i + NUM_BINS - 1) % NUM_BINS];
        let right = histogram[(i + 1) % NUM_BINS];
        if value > left && value > right && value >= PEAK_RATIO * highest {
            let bin = i as f64 + f64::from(0.5 * (left - right) / (left - 2.0 * value + right));
            found.push(bin * TAU / NUM_BINS as f64);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_lies_between_its_bins() {
        let mut histogram = [0.0; NUM_BINS];
        // A peak between bins 0 and 1, a lower peak at bin 18 that is high enough, and one at bin 20 that is not.
        (histogram[35], histogram[0], histogram[1]) = (0.4375, 0.9375, 0.4375 + 0.5 * 0.9375 - 0.03125);
        histogram[18] = 0.8;
        histogram[20] = 0.7;
        let expected = 0.5 * (0.4375 - histogram[1]) / (0.4375 - 2.0 * 0.9375 + histogram[1]);
        let found = peaks(&histogram);
        assert_eq!(found.len(), 2);
        assert!((found[0].to_degrees() - f64::from(expected) * 10.0).abs() < 1e-4);
        assert!((found[1].to_degrees() - 180.0).abs() < 1e-4);
    }

    #[test]
    fn smoothing_keeps_the_sum() {
        let histogram: [f32; NUM_BINS] = std::array::from_fn(|i| (i * i % 7) as f32);
        let (before, after): (f32, f32) = (histogram.iter().sum(), smoothed(&histogram).iter().sum());
        assert!((before - after).abs() < 1e-3);
    }
}
