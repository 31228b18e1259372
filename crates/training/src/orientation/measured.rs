//! Errors of angles.

use sdg_geometry::median;
use sdg_orientation::{OrientationCnn, OrientationError};

use super::labelled_crop::LabelledCrop;

/// Maximum angle error of a good grasp, in degrees.
pub const HIT_DEGREES: f64 = 10.0;

/// Errors of a network on some crops, in degrees. Angles that are equal by the part's symmetry count as equal.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleErrors {
    degrees: Vec<f64>,
}

impl AngleErrors {
    /// Errors in degrees, in any order.
    pub fn new(degrees: Vec<f64>) -> Self {
        Self { degrees }
    }

    /// Evaluates the network on crops with known angles.
    ///
    /// # Errors
    /// A crop whose size differs from the network's input.
    pub fn measure<'a>(
        network: &OrientationCnn,
        crops: impl IntoIterator<Item = &'a LabelledCrop>,
    ) -> Result<Self, OrientationError> {
        let classes = network.config().classes;
        let error = |crop: &LabelledCrop| -> Result<f64, OrientationError> {
            Ok(classes.distance(network.predict(&crop.crop)?.angle, crop.angle).to_degrees())
        };
        Ok(Self::new(crops.into_iter().map(error).collect::<Result<_, _>>()?))
    }

    /// Number of crops.
    pub fn count(&self) -> usize {
        self.degrees.len()
    }

    /// Fraction within [`HIT_DEGREES`]; zero without crops.
    pub fn hit_rate(&self) -> f64 {
        let hits = self.degrees.iter().filter(|error| **error <= HIT_DEGREES).count();
        hits as f64 / self.degrees.len().max(1) as f64
    }

    /// Median in degrees; infinite without crops.
    pub fn median_degrees(&self) -> f64 {
        median(self.degrees.iter().copied()).unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_by_hand() {
        let errors = AngleErrors::new(vec![3.0, 1.0, 170.0, 10.0]);
        assert_eq!((errors.count(), errors.hit_rate(), errors.median_degrees()), (4, 0.75, 6.5));
        let none = AngleErrors::new(vec![]);
        assert_eq!((none.hit_rate(), none.median_degrees()), (0.0, f64::INFINITY));
    }
}
