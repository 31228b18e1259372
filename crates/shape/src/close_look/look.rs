//! The result of a close look.

/// Measurements of a close look at a pose. For the photo itself `bare`, `no_rim` and `added` are 0, and `fit` is about
/// 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloseLook {
    /// [`crate::Likeness::log_odds`].
    pub likeness: f64,
    /// [`crate::Details::log_odds`]; also `None` where the other measurements already exclude the part.
    pub details: Option<f64>,
    /// Share of the part where the picture shows its table and the photo does not, in `[0, 1]`.
    pub bare: f64,
    /// Mean correlation of signed gradients in windows, in `[-1, 1]`.
    pub fit: f64,
    /// Share of the outline without an edge of its direction.
    pub no_rim: f64,
    /// Mean energy of the edges inside the outline that are absent from the photo.
    pub added: f64,
    /// The mirror image compared with the photo; `None` where the two are equal, for a part of revolution, and where
    /// the pose is not plausible.
    pub mirrored: Option<RivalFit>,
}

impl CloseLook {
    /// Whether the pose is good enough for a comparison with rivals; worse poses are refused anyway. Chosen by hand to
    /// save time.
    pub(crate) fn is_plausible(&self) -> bool {
        self.fit >= 0.45 && self.bare < 0.25 && self.no_rim < 0.35
    }
}

/// The fit of a rival compared with the fit of the photo, where the two differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalFit {
    /// Mean correlation of the photo's edges that the rival lacks, minus that of the rival's edges that the photo
    /// lacks; below 0 the rival fits better.
    pub margin: f64,
    /// Mean correlation of the rival's edges that the photo lacks.
    pub fit: f64,
    /// Extent of the differences between rival and photo, as a share of the photo's edges; if it is small, the margin
    /// is weak evidence.
    pub share: f64,
}
