//! The settings of the detector and the descriptor.

use crate::SiftError;

/// Settings of [`Sift`](crate::Sift).
///
/// The defaults are Lowe's, with two exceptions: `contrast_threshold` has the value and the scale of OpenCV, and
/// descriptors are normalised as in RootSIFT.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SiftConfig {
    /// Whether the scale space begins at twice the image's size, which finds the smallest blobs: about four times
    /// the keypoints for four times the work.
    pub double_first_octave: bool,
    /// Scales per octave at which extrema are searched.
    pub intervals: usize,
    /// Blur of the first level of each octave, σ in pixels of that octave.
    pub base_sigma: f64,
    /// Blur assumed to be present in the camera's image, σ in pixels of the image.
    pub input_sigma: f64,
    /// Minimum contrast of an extremum, |D| times `intervals` (OpenCV's convention), as a fraction of the range
    /// from black to white.
    pub contrast_threshold: f64,
    /// Maximum ratio of the principal curvatures; an extremum with a larger ratio is an edge.
    pub edge_ratio: f64,
    /// Maximum number of features, strongest contrast first; `None` keeps all. A point with two orientations counts
    /// twice.
    pub max_features: Option<usize>,
    /// How descriptors are normalised.
    pub normalization: DescriptorNormalization,
}

/// How a descriptor's histogram becomes a vector of unit length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DescriptorNormalization {
    /// To unit length, clipped at 0.2, to unit length again.
    ///
    /// # Source
    /// Lowe 2004, section 6.1.
    Clipped,
    /// As `Clipped`; then each number is divided by the sum of all numbers and replaced by its square root. The
    /// Euclidean distance is then proportional to the Hellinger distance of the histograms.
    ///
    /// # Source
    /// Arandjelović and Zisserman 2012 (RootSIFT).
    Root,
}

impl Default for SiftConfig {
    fn default() -> Self {
        Self {
            double_first_octave: true,
            intervals: 3,
            base_sigma: 1.6,
            input_sigma: 0.5,
            contrast_threshold: 0.04,
            edge_ratio: 10.0,
            max_features: None,
            normalization: DescriptorNormalization::Root,
        }
    }
}

impl SiftConfig {
    /// Checks all settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub(crate) fn check(&self) -> Result<(), SiftError> {
        let refuse = |name, expected, found| Err(SiftError::BadSetting { name, expected, found });
        if !(1..=16).contains(&self.intervals) {
            return refuse("intervals", "from 1 to 16", self.intervals as f64);
        }
        if !(0.0..=8.0).contains(&self.input_sigma) {
            return refuse("input_sigma", "from 0 to 8", self.input_sigma);
        }
        if !(0.5..=16.0).contains(&self.base_sigma) {
            return refuse("base_sigma", "from 0.5 to 16", self.base_sigma);
        }
        if !(self.contrast_threshold >= 0.0 && self.contrast_threshold.is_finite()) {
            return refuse("contrast_threshold", "at least 0", self.contrast_threshold);
        }
        if !(self.edge_ratio >= 1.0 && self.edge_ratio.is_finite()) {
            return refuse("edge_ratio", "at least 1", self.edge_ratio);
        }
        Ok(())
    }

    /// σ of a level of the scale space, in pixels of its octave; `level` may be between two levels.
    pub(crate) fn sigma_of_level(&self, level: f64) -> f64 {
        self.base_sigma * (level / self.intervals as f64).exp2()
    }
}
