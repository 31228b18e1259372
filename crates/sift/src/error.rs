//! Errors of the input of SIFT.

/// The reason why features could not be computed or a rotation could not be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum SiftError {
    /// A setting outside its range.
    #[error("expected {name} {expected}, found {found}")]
    BadSetting {
        name: &'static str,
        /// The accepted range.
        expected: &'static str,
        found: f64,
    },
    /// A number of intensities other than width × height.
    #[error("expected {expected} intensities for {width} × {height} pixels, found {found}")]
    WrongLength {
        width: u32,
        height: u32,
        expected: u64,
        /// The number of intensities found.
        found: u64,
    },
    /// An intensity that is NaN or infinite.
    #[error("expected finite intensities, found {value} at pixel ({x}, {y})")]
    NotFinite { x: u32, y: u32, value: f32 },
    /// A mask whose size differs from its image's.
    #[error(
        "expected a mask of {image_width} × {image_height} pixels, the size of its image, found {mask_width} × {mask_height}"
    )]
    MaskSize {
        /// Width of the image, in pixels.
        image_width: u32,
        /// Height of the image, in pixels.
        image_height: u32,
        /// Width of the mask, in pixels.
        mask_width: u32,
        /// Height of the mask, in pixels.
        mask_height: u32,
    },
    /// A template that shows neither texture nor an outline.
    #[error(
        "expected a template with at least {expected} keypoints or a mask with an area, found {found} keypoints and no mask"
    )]
    BareTemplate { expected: usize, found: usize },
}
