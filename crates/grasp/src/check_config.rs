//! Settings of the search, the refinement and the score, with the origin of each value.
//!
//! `cargo run --release -p sdg-grasp --example fit_constants` refits the fitted values of this file on generated parts.
//! docs/decisions/010-constants.md lists these and all other constants of this crate with their origin, and
//! docs/decisions/007-score.md explains the score.

use std::ops::RangeInclusive;

use sdg_shape::SearchConfig;

use crate::error::{GraspError, Result};
use crate::evidence_kind::EvidenceKind;

/// The settings of the search, of the comparison of demonstration and image, and of the score.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CheckConfig {
    /// The settings of the search over a whole image and, in `search.shape`, of every comparison of demonstration and
    /// image. `search.scales` is the size tolerance.
    pub search: SearchConfig,
    /// The weights of the evidence.
    pub score: ScoreConfig,
    /// Maximum number of detections listed for a picture.
    pub max_detections: usize,
}

impl CheckConfig {
    /// Default range of a part's size relative to the nominal size. The size varies from 0.81 to 1.14 in hand-held
    /// photographs of one part, and from 0.75 to 1.3 for other camera heights; the range was chosen from these values.
    pub const DEFAULT_SIZE_TOLERANCE: RangeInclusive<f64> = 0.75..=1.35;
    /// Size range for a camera at the same distance as for the photo, as in the simulated workcell. If the size may
    /// shrink to four fifths, a lever that resembles the pendulum reaches an agreement of 0.66.
    pub const FIXED_HEIGHT_TOLERANCE: RangeInclusive<f64> = 0.97..=1.03;
    /// Size range in a plan view, where the size is known. It is wide enough that look-alikes of another size are
    /// found, and then refused because of the size.
    pub const KNOWN_SIZE_TOLERANCE: RangeInclusive<f64> = 0.9..=1.11;
    /// Size range of held-out samples for a model that knows its part's size: parts of other sizes are refused. Chosen
    /// by hand.
    pub const KNOWN_SAMPLE_SIZES: RangeInclusive<f64> = 0.97..=1.03;
    /// Default maximum number of detections in one picture. Chosen by hand.
    pub const DEFAULT_MAX_DETECTIONS: usize = 100;

    /// The values of [`Default`], as a constant.
    ///
    /// The search's minimum agreement was chosen by hand: 99 of 100 correct poses exceed it.
    pub const DEFAULT: Self = Self {
        search: {
            let mut search = SearchConfig::DEFAULT;
            search.scales = Self::DEFAULT_SIZE_TOLERANCE;
            search.min_agreement = 0.2;
            search.max_matches = Self::DEFAULT_MAX_DETECTIONS;
            search
        },
        score: ScoreConfig::DEFAULT,
        max_detections: Self::DEFAULT_MAX_DETECTIONS,
    };

    /// Checks the score and the size tolerance.
    ///
    /// # Errors
    /// [`GraspError::InvalidConfig`] for a value of `score` or a size tolerance out of range; the rest of `search` is
    /// checked when a search is made from it.
    pub(crate) fn check(&self) -> Result<()> {
        let (low, high) = (*self.search.scales.start(), *self.search.scales.end());
        let finite = self.score.terms().iter().all(|(_, term)| {
            [term.weight, term.neutral, term.range[0], term.range[1]].iter().all(|value| value.is_finite())
                && term.range[0] <= term.range[1]
        });
        let checks = [
            ("size tolerance", "from 0.5 to 1", low, (0.5..=1.0).contains(&low)),
            ("size tolerance", "up to 1 to 2", high, (1.0..=2.0).contains(&high)),
            ("score.bias", "a finite number", self.score.bias, self.score.bias.is_finite()),
            ("score", "finite weights and ranges that do not end before they begin", f64::NAN, finite),
        ];
        for (name, expected, found, ok) in checks {
            if !ok {
                return Err(GraspError::InvalidConfig { name, expected, found });
            }
        }
        Ok(())
    }
}

impl Default for CheckConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Converts one kind of evidence to log-odds: the value is clamped to `range`, and its difference from `neutral` is
/// multiplied by `weight`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Log-odds per unit of the value.
    pub weight: f64,
    /// The value that contributes nothing; for most fitted terms half-way between the medians of correct and wrong
    /// poses.
    pub neutral: f64,
    /// The range to which values are clamped, which limits the influence of this evidence.
    pub range: [f64; 2],
}

/// The weights of the evidence; see [`crate::Contributions`] for the terms.
///
/// Most terms were fitted on 160 generated parts, none of which is a shipped part, a photographed part or a training
/// part of the likeness: `fit_constants --parts 160 --size 640x480,320x240 --seed 11 --only score`
/// (docs/decisions/007-score.md). The terms from `details` to `mirror` come from nine tuned sets of datasets/split.toml
/// and 16 rendered parts (docs/decisions/025-acceptance.md, 026-details.md). Ranges, hue, size and bias were set by
/// hand; with these ranges only details, table, added and mirror can each reject a pose regardless of the other terms.
/// The network's weight was fitted on models C of ten generated parts. The network's output counts only against a pose,
/// because a network also detects look-alikes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScoreConfig {
    /// Whether pictures have known lengths. If they do, a detection's size is compared with the demonstration's,
    /// otherwise with the size of the best detection in the picture.
    pub is_size_known: bool,
    /// Log-odds if all evidence is neutral.
    pub bias: f64,
    /// Term of [`sdg_shape::Evidence::edges`].
    pub edges: Term,
    /// Term of [`sdg_shape::Evidence::surface`].
    pub surface: Term,
    /// Term of [`sdg_shape::Evidence::hue_shift`].
    pub hue: Term,
    /// Term of [`sdg_shape::Evidence::visible`].
    pub visible: Term,
    /// Term of the squared difference of ln sizes between a detection and the best one in the picture.
    pub size: Term,
    /// Term of [`sdg_shape::Evidence::outside`].
    pub outside: Term,
    /// Term of the mean agreement of other objects with the part.
    pub resemblance: Term,
    /// Term of [`sdg_shape::CloseLook::likeness`].
    pub likeness: Term,
    /// Term of [`sdg_shape::CloseLook::details`] where the value speaks against a pose.
    pub details: Term,
    /// Term of [`sdg_shape::CloseLook::details`] where the value supports a pose. Values between the ranges of
    /// `details` and `details_for` are neutral.
    pub details_for: Term,
    /// Term of [`sdg_shape::CloseLook::bare`].
    pub table: Term,
    /// Term of [`sdg_shape::CloseLook::no_rim`].
    pub rim: Term,
    /// Term of [`sdg_shape::CloseLook::added`].
    pub added: Term,
    /// Term of the difference by which [`sdg_shape::CloseLook::mirrored`] fits better than the photo.
    pub mirror: Term,
    /// Term of the network's log-likelihood ratio: ln of the ratio of two likelihoods of the network's output, on the
    /// part and elsewhere.
    pub network: Term,
}

impl ScoreConfig {
    /// The values of [`Default`], as a constant.
    pub const DEFAULT: Self = SCORE;

    /// The weights for pictures with known lengths, where a wrong size outweighs all but the strongest other evidence.
    pub(crate) fn of_known_size(self) -> Self {
        Self { is_size_known: true, size: KNOWN_SIZE, ..self }
    }

    /// The weights for pictures with known lengths but unknown heights: every size within the search range is neutral.
    pub(crate) fn of_any_height(self) -> Self {
        Self { is_size_known: true, size: term(0.0, 0.0, 0.0, 0.01), ..self }
    }

    /// The largest positive contribution of a kind of evidence.
    pub(crate) fn most_of(&self, kind: EvidenceKind) -> f64 {
        match kind {
            EvidenceKind::Network => self.network.most(),
            EvidenceKind::Edges => self.edges.most(),
            EvidenceKind::Surface => self.surface.most(),
            EvidenceKind::Hue => self.hue.most(),
            EvidenceKind::Visible => self.visible.most(),
            EvidenceKind::Size => self.size.most(),
            EvidenceKind::Outside => self.outside.most(),
            EvidenceKind::Resemblance => self.resemblance.most(),
            EvidenceKind::Likeness => self.likeness.most(),
            EvidenceKind::Details => self.details.most() + self.details_for.most(),
            EvidenceKind::Table => self.table.most(),
            EvidenceKind::Rim => self.rim.most(),
            EvidenceKind::Added => self.added.most(),
            EvidenceKind::Mirror => self.mirror.most(),
        }
    }

    /// Every term of the score, by name.
    pub fn terms(&self) -> [(&'static str, Term); 15] {
        [
            ("network", self.network),
            ("edges", self.edges),
            ("surface", self.surface),
            ("hue", self.hue),
            ("visible", self.visible),
            ("size", self.size),
            ("outside", self.outside),
            ("resemblance", self.resemblance),
            ("likeness", self.likeness),
            ("details", self.details),
            ("details_for", self.details_for),
            ("table", self.table),
            ("rim", self.rim),
            ("added", self.added),
            ("mirror", self.mirror),
        ]
    }
}

impl Default for ScoreConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Term {
    /// The log-odds of a value: the value clamped to the range, minus the neutral value, times the weight.
    pub(crate) fn log_odds(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        self.weight * (value.clamp(low, high) - self.neutral)
    }

    /// The largest log-odds of any value.
    fn most(&self) -> f64 {
        self.range.map(|value| self.log_odds(value)).into_iter().fold(f64::MIN, f64::max)
    }
}

const fn term(weight: f64, neutral: f64, low: f64, high: f64) -> Term {
    Term { weight, neutral, range: [low, high] }
}

/// Term of the squared ln of the ratio of a size to the demonstration's. A refined pose has a size error of about 2.5 %
/// if a slanted view shows a part's walls. The weight is half of the inverse square of that error; differences above
/// 10 % count as 10 %. Chosen by hand from six rendered pictures.
const KNOWN_SIZE: Term = term(-800.0, 0.0, 0.0, 0.01);

const SCORE: ScoreConfig = ScoreConfig {
    is_size_known: false,
    bias: 0.3,
    edges: term(2.64, 0.62, 0.3, 0.95),
    surface: term(0.87, 0.33, 0.0, 0.7),
    hue: term(-8.0, 0.1, 0.1, 0.35),
    visible: term(6.73, 0.66, 0.27, 0.77),
    size: term(-98.0, 0.0, 0.0, 0.029),
    outside: term(-2.15, 0.0, 0.0, 0.34),
    resemblance: term(-2.74, 0.36, 0.2, 0.45),
    likeness: term(0.777, -0.1, -2.0, 6.0),
    details: term(1.5, -2.0, -7.5, -2.0),
    details_for: term(0.5, 0.0, 0.0, 2.0),
    network: term(0.8, 0.0, -1.0, 0.0),
    table: term(-9.0, 0.0, 0.0, 1.0),
    rim: term(-4.0, 0.05, 0.05, 1.0),
    added: term(-10.0, 0.0, 0.0, 1.0),
    mirror: term(-55.0, 0.07, 0.07, 1.0),
};
