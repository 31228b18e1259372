//! The learning rate over a run.

use serde::{Deserialize, Serialize};

/// One cycle: a cosine up to `peak` during warm-up, then a cosine down to nearly zero.
///
/// # Source
/// Smith and Topin 2018, with the two factors of PyTorch's `OneCycleLR`. The second factor divides the peak here, and
/// the first learning rate in PyTorch. With Detectron2's default warm-up of 1000 iterations the learning rate of the
/// paper's 1000-iteration runs only increases; this schedule avoids that.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OneCycle {
    /// Maximum learning rate.
    pub peak: f64,
    /// Fraction of the run that warms up, in (0, 1).
    pub warm_up: f64,
}

/// Ratio of the peak to the first learning rate.
const START_DIVISOR: f64 = 25.0;
/// Ratio of the peak to the last learning rate.
const END_DIVISOR: f64 = 1e4;

impl OneCycle {
    /// The learning rate at `progress` of the run, in `[0, 1]`.
    pub fn learning_rate(&self, progress: f64) -> f64 {
        let progress = progress.clamp(0.0, 1.0);
        if progress < self.warm_up {
            cosine(self.peak / START_DIVISOR, self.peak, progress / self.warm_up)
        } else {
            cosine(self.peak, self.peak / END_DIVISOR, (progress - self.warm_up) / (1.0 - self.warm_up))
        }
    }
}

/// Half a cosine wave from `from` (at 0) to `to` (at 1).
fn cosine(from: f64, to: f64, t: f64) -> f64 {
    to + 0.5 * (from - to) * (1.0 + (std::f64::consts::PI * t).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: OneCycle = OneCycle { peak: 1e-3, warm_up: 0.25 };

    #[test]
    fn starts_low_peaks_and_ends_lower() {
        assert!((CYCLE.learning_rate(0.0) - 4e-5).abs() < 1e-12);
        assert!((CYCLE.learning_rate(0.25) - 1e-3).abs() < 1e-12);
        assert!((CYCLE.learning_rate(1.0) - 1e-7).abs() < 1e-12);
        // Half-way down the cosine.
        assert!((CYCLE.learning_rate(0.625) - (1e-3 + 1e-7) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn rises_then_falls() {
        let rates: Vec<f64> = (0..=40).map(|i| CYCLE.learning_rate(f64::from(i) / 40.0)).collect();
        assert!(rates[..=10].windows(2).all(|pair| pair[0] < pair[1]));
        assert!(rates[10..].windows(2).all(|pair| pair[0] > pair[1]));
    }
}
