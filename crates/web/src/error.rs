//! Errors in the inputs that a page hands over.

/// Why a model could not be opened or an image not be looked at.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum WebError {
    /// The model file, or the look itself.
    #[error(transparent)]
    Grasp(#[from] sdg_grasp::GraspError),
    /// An image file that is none, is damaged, or is enormous.
    #[error(transparent)]
    Image(#[from] sdg_demonstration::PictureError),
    /// Pixels of another number than the size says.
    #[error("expected {width} × {height} pixels of four bytes, found {found} bytes")]
    Pixels { width: u32, height: u32, found: usize },
}
