//! What can be wrong with a shape.

/// Why a shape could not be made or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A coordinate is NaN or infinite.
    #[error("expected finite coordinates, found {value} in {what}")]
    NotFinite {
        /// The shape and the coordinate.
        what: &'static str,
        /// The value found.
        value: f64,
    },
    /// A box without area.
    #[error("expected a box with positive width and height, found {width} × {height} pixels")]
    EmptyBox {
        /// Width found, in pixels.
        width: f64,
        /// Height found, in pixels.
        height: f64,
    },
    /// A polygon of fewer than three vertices or without area.
    #[error(
        "expected a polygon of at least 3 vertices with an area, found {vertices} vertices and {area} square pixels"
    )]
    DegeneratePolygon {
        /// Vertices found.
        vertices: usize,
        /// Area found, in square pixels.
        area: f64,
    },
    /// Run lengths that do not add up to the mask's size.
    #[error("expected run lengths of {expected} pixels in all, found {found}")]
    RunLengthMismatch {
        /// Width × height.
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
        /// Image width, in pixels.
        width: u32,
        /// Image height, in pixels.
        height: u32,
    },
}
