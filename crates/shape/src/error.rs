//! Errors of templates, configurations and weights.

/// Why a template could not be made, or why a configuration or weights cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ShapeError {
    /// The outline is not an area: too few vertices, or a coordinate that is not finite.
    #[error("expected an outline of at least 3 finite vertices, found {found}")]
    OutlineDegenerate {
        /// The number of vertices, or the vertex that is not finite.
        found: String,
    },
    /// The outline and the image overlap too little.
    #[error(
        "expected an outline at least {expected_px} px long inside the {width}x{height} image, found {found_width_px:.1} x {found_height_px:.1} px"
    )]
    OutlineTooSmall {
        /// Minimum length of the longer side of its box, in pixels.
        expected_px: f64,
        width: u32,
        height: u32,
        /// Width of the outline's part inside the image, in pixels.
        found_width_px: f64,
        /// Height of the outline's part inside the image, in pixels.
        found_height_px: f64,
    },
    /// The part has too few edges for recognition.
    #[error(
        "expected at least {expected} edge points inside the outline, found {found}: the part hardly differs from its \
         surroundings; photograph it on a plain background of another brightness, or correct its marks"
    )]
    TooFewEdges { expected: usize, found: usize },
    /// A file does not contain the weights of the network that reads it.
    #[error("weights of the comparing network: {0}")]
    Weights(String),
    /// A configuration value lies outside its range.
    #[error("expected {name} {expected}, found {found}")]
    InvalidConfig {
        name: &'static str,
        /// The accepted range, in words.
        expected: &'static str,
        found: f64,
    },
}
