//! Errors of inputs from the page.

/// The reason why a model could not be opened or an image could not be searched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum WebError {
    /// An error of the model file, or of the search.
    #[error(transparent)]
    Grasp(#[from] sdg_grasp::GraspError),
    /// A file that is not an image, is damaged, or is too large.
    #[error(transparent)]
    Image(#[from] sdg_demonstration::PictureError),
    /// The number of bytes does not match the size.
    #[error("expected {width} × {height} pixels of four bytes, found {found} bytes")]
    Pixels { width: u32, height: u32, found: usize },
}
