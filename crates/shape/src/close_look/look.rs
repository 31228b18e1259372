//! What a close look gives.

/// What a close look at a pose measures. All are 0 for the photo itself, but for the fits, which are 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloseLook {
    /// [`crate::Likeness::log_odds`].
    pub likeness: f64,
    /// [`crate::Details::log_odds`]; `None`, too, where the rest leaves no doubt that it is not the part.
    pub details: Option<f64>,
    /// Share of the part where the picture shows its table and the photo does not, in `[0, 1]`.
    pub bare: f64,
    /// Mean correlation of signed gradients in windows, in `[-1, 1]`.
    pub fit: f64,
    /// Share of the outline with no edge of its direction.
    pub no_rim: f64,
    /// Mean energy of the edges inside the outline that the photo does not have.
    pub added: f64,
    /// How the mirror image fits instead; `None` where the photo is its own mirror image.
    pub mirrored: Option<RivalFit>,
}

impl CloseLook {
    /// Whether the pose is worth asking for rivals: others are refused. Chosen by hand, for time.
    pub(crate) fn is_plausible(&self) -> bool {
        self.fit >= 0.45 && self.bare < 0.25 && self.no_rim < 0.35
    }
}

/// How a rival fits a picture compared with the photo, where the two differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalFit {
    /// Mean correlation of the photo's edges that the rival lacks, less that of the rival's that the photo lacks: below 0 the rival fits
    /// better.
    pub margin: f64,
    /// Mean correlation of the rival's edges that the photo lacks.
    pub fit: f64,
    /// How much of the photo's edges they differ in: with little, the margin says little.
    pub share: f64,
}
