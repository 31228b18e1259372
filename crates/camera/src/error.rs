//! What can be wrong with a camera.

/// Why there is no frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {}

impl CameraError {
    /// Whether the camera may deliver frames again: the next call tries.
    pub fn is_passing(&self) -> bool {
        false
    }
}
