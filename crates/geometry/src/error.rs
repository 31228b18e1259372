//! The error type of this crate.

/// The reason why a shape or a camera cannot be made or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum GeometryError {
    /// A coordinate or a parameter of a camera is NaN or infinite.
    #[error("expected finite coordinates, found {value} in {what}")]
    NotFinite {
        /// The shape or the parameters that contain the value.
        what: &'static str,
        value: f64,
    },
    /// A box without area.
    #[error("expected a box with positive width and height, found {width} × {height} pixels")]
    EmptyBox { width: f64, height: f64 },
    /// A polygon of fewer than three vertices or without area.
    #[error(
        "expected a polygon of at least 3 vertices with an area, found {vertices} vertices and {area} square pixels"
    )]
    DegeneratePolygon {
        vertices: usize,
        /// Area found, in square pixels.
        area: f64,
    },
    /// Run lengths that do not add up to the mask's size.
    #[error("expected run lengths with a sum of {expected} pixels, found {found}")]
    RunLengthMismatch {
        expected: u64,
        /// The sum of the runs.
        found: u64,
    },
    /// Intrinsics that describe no camera.
    #[error(
        "expected a positive focal length and a size of at least one pixel, found fx {fx}, fy {fy}, {width} × {height}"
    )]
    BadIntrinsics {
        /// Horizontal focal length, in pixels.
        fx: f64,
        /// Vertical focal length, in pixels.
        fy: f64,
        width: u32,
        height: u32,
    },
}
