//! The kinds of evidence by name, and the advice that follows from them.

/// A kind of evidence of [`crate::Contributions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EvidenceKind {
    /// The network's score.
    Network,
    /// Agreement of edges.
    Edges,
    /// Correlation of the surface.
    Surface,
    /// Difference in hue.
    Hue,
    /// Visible fraction of the part.
    Visible,
    /// Difference in size.
    Size,
    /// Fraction of the part outside the picture.
    Outside,
    /// Resemblance of other objects.
    Resemblance,
    /// Score of the network that decides whether photo and picture show the same part.
    Likeness,
    /// Score of the network that distinguishes parts from their look-alikes.
    Details,
    /// Table where the part should be.
    Table,
    /// Outline without an edge.
    Rim,
    /// Edges that are absent from the photo.
    Added,
    /// A better fit of the mirror image.
    Mirror,
}

impl EvidenceKind {
    /// The name, as in `evidence` of JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Edges => "edges",
            Self::Surface => "surface",
            Self::Hue => "hue",
            Self::Visible => "visible",
            Self::Size => "size",
            Self::Outside => "outside",
            Self::Resemblance => "resemblance",
            Self::Likeness => "likeness",
            Self::Details => "details",
            Self::Table => "table",
            Self::Rim => "rim",
            Self::Added => "added",
            Self::Mirror => "mirror",
        }
    }

    /// The reason, in words, if this evidence speaks against a detection.
    pub fn objection(self) -> &'static str {
        match self {
            Self::Network => "the network does not detect the part there",
            Self::Edges => "too few of the part's edges are found",
            Self::Surface => "the surface looks different: another side, print, gloss or light",
            Self::Hue => "it has another colour: another part, or other light",
            Self::Visible => "too little of it is visible",
            Self::Size => "it has another size",
            Self::Outside => "too much of it lies outside the picture",
            Self::Resemblance => "other objects look similar to this part",
            Self::Likeness => "photo and picture, laid over each other, do not show the same part",
            Self::Details => "a feature or print of the part is missing, or is elsewhere",
            Self::Table => "bare table is seen where the part should be",
            Self::Rim => "a part of its outline is missing",
            Self::Added => "there is more inside its outline than in the photo",
            Self::Mirror => "the mirror image fits better",
        }
    }

    /// Whether this evidence comes from differences that can be shown in the picture. Such evidence is also listed as
    /// an objection if it supports the part clearly less than it could.
    pub(crate) fn is_local(self) -> bool {
        !matches!(self, Self::Network | Self::Resemblance | Self::Likeness | Self::Details)
    }
}

/// The advice for a refused detection that is the part after all; the caller puts it into words, with the names of its
/// options or buttons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advice {
    /// Parts at one height, or a further photo from this distance: the part has another size than the surest one in the
    /// picture.
    OneHeight,
    /// With a calibrated camera: a check of the camera file and of the height of the marks.
    CheckLengths,
    /// A further photo in the picture's light, in which the part is darker than in the demonstration.
    DarkerPhoto,
    /// A further photo in the picture's light, in which the part is brighter than in the demonstration.
    BrighterPhoto,
    /// Uncover the part, or take a further photo from this side.
    Uncover,
    /// A further photo from this side.
    OtherSide,
}
