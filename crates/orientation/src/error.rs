//! What can be wrong with the inputs of this crate.

use thiserror::Error;

/// An input that the orientation CNN cannot work with. Each message says what was expected and found.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OrientationError {
    /// A setting is outside its range, or two contradict each other.
    #[error("orientation CNN: {field} must be {expected}, found {found}")]
    Config {
        /// The setting's name.
        field: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// An image has no pixels.
    #[error("an image to crop needs at least 1x1 pixels, found {width}x{height}")]
    EmptyImage {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A box that nothing can be cropped by.
    #[error("a box to crop by needs finite corners and a positive area, found ({x1}, {y1}) to ({x2}, {y2})")]
    BadBox {
        /// Left edge.
        x1: f64,
        /// Upper edge.
        y1: f64,
        /// Right edge.
        x2: f64,
        /// Lower edge.
        y2: f64,
    },
    /// A crop of another size than the network's input.
    #[error("the orientation CNN reads crops of {expected}x{expected} pixels, found {width}x{height}")]
    CropSize {
        /// The network's input.
        expected: u32,
        /// Width of the crop.
        width: u32,
        /// Height of the crop.
        height: u32,
    },
    /// A demonstration that cannot be taught.
    #[cfg(feature = "training")]
    #[error(transparent)]
    Demonstration(#[from] sdg_demonstration::Error),
    /// Parameters to start from that are another network's.
    #[cfg(feature = "training")]
    #[error("weights to start the orientation CNN from: expected those of this network, found another {name}")]
    Start {
        /// The first parameter that does not fit.
        name: String,
    },
    /// A loss that is NaN or infinite.
    #[cfg(feature = "training")]
    #[error("the orientation loss became {loss} at step {step}; a lower learning rate than {learning_rate:e} may help")]
    Diverged {
        /// The step, from zero.
        step: usize,
        /// The loss.
        loss: f64,
        /// The learning rate of that step.
        learning_rate: f64,
    },
}

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, OrientationError>;
