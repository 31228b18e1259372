//! One score from all evidence.
//!
//! ```text
//! network score ────────────────┐
//! edges, surface, hue ──────────┤
//! visible, likeness, details ───┼─ log-odds of each, bounded ─ sum ─ logistic ─ score; 0.5 decides
//! size, fraction outside ───────┤
//! resemblance ──────────────────┤  agreement of other objects with this part: measured during teaching
//! table, rim, added, mirror ────┘  contradictions of the part
//! ```
//! Each kind of evidence is wrong in some pictures: gloss spoils edges and surface, a covering hand hides half of the
//! part, the network also detects other parts. Therefore each kind adds log-odds within bounds, so that a pose is
//! accepted despite one wrong kind if all other evidence supports it. Only these contradictions can each reject a pose
//! alone: bare table where the part should be, more edges than the part has, a better fit of its mirror image, and
//! clearly different details. Most weights come from a logistic regression on generated parts ([`crate::fitting`]).

use sdg_shape::{CloseLook, Evidence, RivalFit};
use serde::Serialize;

use crate::check_config::{ScoreConfig, Term};
use crate::evidence_kind::{Advice, EvidenceKind};

/// The log-odds that each kind of evidence adds to a detection: above 0 it supports the part, below 0 it speaks against
/// it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contributions {
    /// The network's score at the pose, or the absence of a candidate there; `None` without a network.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network: Option<f64>,
    /// Agreement of the demonstration's edges with the image.
    pub edges: f64,
    /// Correlation of the colours inside the outline; 0 if the demonstration's surface is plain.
    pub surface: f64,
    /// Closeness of the hue to the demonstration's.
    pub hue: f64,
    /// Fraction of the part in regions that agree.
    pub visible: f64,
    /// Difference in size from the best detection in the picture, or from the part if its size is known.
    pub size: f64,
    /// Fraction of the part outside the picture.
    pub outside: f64,
    /// Resemblance of other objects to this part.
    pub resemblance: f64,
    /// The log-odds of the small network whose input is photo and picture laid over each other. If edges and surface
    /// agree too little, the network is not evaluated, and this is the minimum.
    pub likeness: f64,
    /// The output of the network that distinguishes parts from their look-alikes; 0 if the network is undecided or was
    /// not evaluated.
    pub details: f64,
    /// Table where the part should be.
    pub table: f64,
    /// Fraction of the outline without an edge.
    pub rim: f64,
    /// Edges inside the outline that are absent from the photo.
    pub added: f64,
    /// The difference by which the mirror image fits better, where it differs from the photo.
    pub mirror: f64,
}

impl Contributions {
    /// The log-odds of each kind, in the order of the fields.
    pub fn by_kind(&self) -> impl Iterator<Item = (EvidenceKind, f64)> {
        let network = self.network.map(|network| (EvidenceKind::Network, network));
        network.into_iter().chain([
            (EvidenceKind::Edges, self.edges),
            (EvidenceKind::Surface, self.surface),
            (EvidenceKind::Hue, self.hue),
            (EvidenceKind::Visible, self.visible),
            (EvidenceKind::Size, self.size),
            (EvidenceKind::Outside, self.outside),
            (EvidenceKind::Resemblance, self.resemblance),
            (EvidenceKind::Likeness, self.likeness),
            (EvidenceKind::Details, self.details),
            (EvidenceKind::Table, self.table),
            (EvidenceKind::Rim, self.rim),
            (EvidenceKind::Added, self.added),
            (EvidenceKind::Mirror, self.mirror),
        ])
    }

    /// The strongest evidence against the part; without evidence against it, the weakest for it.
    fn weakest(&self) -> Option<(EvidenceKind, f64)> {
        self.by_kind().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The strongest evidence against the part; `None` if there is none.
    pub fn strongest_objection(&self) -> Option<EvidenceKind> {
        let (kind, log_odds) = self.weakest()?;
        (log_odds < 0.0).then_some(kind)
    }

    /// The evidence against the part: first the strongest objection, then the kinds whose log-odds are clearly below
    /// their maximum with `config`, the greatest loss first. A kind without differences that can be shown in the
    /// picture counts only if its log-odds are below 0.
    pub fn objections(&self, config: &ScoreConfig) -> Vec<EvidenceKind> {
        /// Smaller losses also occur in clear views. Chosen by hand.
        const MIN_LOSS: f64 = 0.5;
        let strongest = self.strongest_objection();
        let mut lost: Vec<(EvidenceKind, f64)> = self
            .by_kind()
            .filter(|(kind, log_odds)| Some(*kind) != strongest && (kind.is_local() || *log_odds < 0.0))
            .map(|(kind, log_odds)| (kind, config.most_of(kind) - log_odds))
            .filter(|(_, loss)| *loss >= MIN_LOSS)
            .collect();
        lost.sort_by(|a, b| b.1.total_cmp(&a.1));
        strongest.into_iter().chain(lost.into_iter().map(|(kind, _)| kind)).collect()
    }

    /// The further demonstration, or the setting, that would help if this is the part after all; `light` is the
    /// brightness over that of the demonstration. `None` if neither would help.
    pub(crate) fn advice(&self, light: f64, config: &ScoreConfig) -> Option<Advice> {
        // Outside this range of `light` the illumination differs. Chosen by hand, not measured.
        const DARKER: f64 = 0.6;
        const BRIGHTER: f64 = 1.6;
        let on_light = if light < DARKER {
            Some(Advice::DarkerPhoto)
        } else if light > BRIGHTER {
            Some(Advice::BrighterPhoto)
        } else {
            None
        };
        match self.strongest_objection()? {
            EvidenceKind::Size if config.is_size_known => Some(Advice::CheckLengths),
            EvidenceKind::Size => Some(Advice::OneHeight),
            EvidenceKind::Outside | EvidenceKind::Network | EvidenceKind::Resemblance => None,
            EvidenceKind::Visible => on_light.or(Some(Advice::Uncover)),
            EvidenceKind::Edges
            | EvidenceKind::Surface
            | EvidenceKind::Hue
            | EvidenceKind::Likeness
            | EvidenceKind::Details
            | EvidenceKind::Table
            | EvidenceKind::Rim
            | EvidenceKind::Added
            | EvidenceKind::Mirror => on_light.or(Some(Advice::OtherSide)),
        }
    }
}

/// The known facts of a detection before it is scored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clues {
    pub(crate) demonstration_idx: usize,
    pub(crate) evidence: Evidence,
    /// ln of the size in the image over that in this demonstration's photo, in pixels.
    pub(crate) log_size: f64,
    /// ln of the ratio of two likelihoods of the network's output, on the part and elsewhere; `None` without a network.
    pub(crate) network: Option<f64>,
    /// Mean agreement of other objects with the part.
    pub(crate) resemblance: f64,
}

/// Minimum [`RivalFit::share`]; below it, the rival does not count.
const MIN_RIVALS_SHARE: f64 = 0.03;

/// Minimum score of the size reference. Chosen by hand, not measured.
const MIN_REFERENCE_SCORE: f64 = 0.3;

/// The scores of all detections in one picture and their contributions. If the part's size is unknown, each detection
/// is first scored alone, then relative to the size of the best one with the same demonstration, since the parts of one
/// picture are equally far from the camera. Photos may have been taken at different distances, so that sizes relative
/// to different photos are not compared.
pub(crate) fn judge_picture(clues: &[Clues], config: &ScoreConfig) -> Vec<(f64, Contributions)> {
    if config.is_size_known {
        return clues.iter().map(|clues| judge(clues, Some(0.0), config)).collect();
    }
    let alone: Vec<(f64, &Clues)> = clues.iter().map(|clues| (judge(clues, None, config).0, clues)).collect();
    let surest = |demonstration_idx: usize| {
        let of_it = alone.iter().filter(|(_, other)| other.demonstration_idx == demonstration_idx);
        let sure = of_it.filter(|(score, _)| *score >= MIN_REFERENCE_SCORE);
        sure.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, clues)| clues.log_size)
    };
    clues.iter().map(|clues| judge(clues, surest(clues.demonstration_idx), config)).collect()
}

/// As [`judge_picture`], for a picture of a sequence; `earlier_log_sizes` are the sizes of parts in earlier pictures, by
/// demonstration, as [`Clues::log_size`].
pub(crate) fn judge_picture_of_sequence(
    clues: &[Clues],
    earlier_log_sizes: &[(usize, f64)],
    config: &ScoreConfig,
) -> Vec<(f64, Contributions)> {
    if config.is_size_known || earlier_log_sizes.is_empty() {
        return judge_picture(clues, config);
    }
    let earlier = |clues: &Clues| {
        earlier_log_sizes.iter().find(|(idx, _)| *idx == clues.demonstration_idx).map(|(_, log_size)| *log_size)
    };
    clues.iter().map(|clues| judge(clues, earlier(clues), config)).collect()
}

fn judge(clues: &Clues, reference_log_size: Option<f64>, config: &ScoreConfig) -> (f64, Contributions) {
    let seen = &clues.evidence;
    let off_size = reference_log_size.map_or(0.0, |reference| (clues.log_size - reference).powi(2));
    // Without a close look these terms contribute 0.
    let closely =
        |term: &Term, value: &dyn Fn(&CloseLook) -> f64| seen.close.map_or(0.0, |close| term.log_odds(value(&close)));
    let contributions = Contributions {
        network: clues.network.map(|score| config.network.log_odds(score)),
        edges: config.edges.log_odds(seen.edges),
        surface: seen.surface.map_or(0.0, |surface| config.surface.log_odds(surface)),
        hue: config.hue.log_odds(seen.hue_shift),
        visible: config.visible.log_odds(seen.visible),
        size: config.size.log_odds(off_size),
        outside: config.outside.log_odds(seen.outside),
        resemblance: config.resemblance.log_odds(clues.resemblance),
        likeness: config.likeness.log_odds(seen.close.map_or(f64::NEG_INFINITY, |close| close.likeness)),
        details: seen
            .close
            .and_then(|close| close.details)
            .map_or(0.0, |details| config.details.log_odds(details) + config.details_for.log_odds(details)),
        table: closely(&config.table, &|close| close.bare),
        rim: closely(&config.rim, &|close| close.no_rim),
        added: closely(&config.added, &|close| close.added),
        mirror: closely(&config.mirror, &|close| close.mirrored.map_or(0.0, rivals_gain)),
    };
    (score(&contributions, config), contributions)
}

/// A verdict whose evidence has another contribution of the size.
pub(crate) fn with_size(evidence: Contributions, size: f64, config: &ScoreConfig) -> (f64, Contributions) {
    let contributions = Contributions { size, ..evidence };
    (score(&contributions, config), contributions)
}

fn score(contributions: &Contributions, config: &ScoreConfig) -> f64 {
    let log_odds = config.bias + contributions.by_kind().map(|(_, log_odds)| log_odds).sum::<f64>();
    1.0 / (1.0 + (-log_odds).exp())
}

/// The difference by which the rival (the mirror image) fits better than the photo; 0 if the two differ too little. The
/// difference is weighted by the fit of the rival, because a part in other light or rolled about its own axis fits
/// neither.
pub(crate) fn rivals_gain(rival: RivalFit) -> f64 {
    /// The rival has no weight if its fit is below the first value, and full weight above the second value. Chosen on
    /// the tuned sets and parts.
    const FITS: [f64; 2] = [0.5, 0.7];
    let explains = ((rival.fit - FITS[0]) / (FITS[1] - FITS[0])).clamp(0.0, 1.0);
    if rival.share < MIN_RIVALS_SHARE { 0.0 } else { -rival.margin * explains }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A close look at the part itself, with this likeness.
    pub(crate) fn look(likeness: f64) -> CloseLook {
        CloseLook { likeness, details: Some(1.5), bare: 0.0, fit: 0.75, no_rim: 0.02, added: 0.0, mirrored: None }
    }

    /// A clear view of the part: the medians of correct poses on generated parts.
    fn clear() -> Clues {
        let evidence = Evidence {
            edges: 0.79,
            surface: Some(0.46),
            hue_shift: 0.05,
            visible: 1.0,
            outside: 0.0,
            close: Some(look(2.0)),
        };
        Clues { demonstration_idx: 0, evidence, log_size: 0.0, network: None, resemblance: 0.34 }
    }

    fn score(clues: Clues) -> f64 {
        judge(&clues, None, &ScoreConfig::DEFAULT).0
    }

    #[test]
    fn another_size_changes_the_score_as_if_judged_with_it() {
        let config = ScoreConfig::DEFAULT;
        let larger = Clues { log_size: 0.15, ..clear() };
        let [alone, beside] = [None, Some(0.0)].map(|reference| judge(&larger, reference, &config));
        assert!(beside.0 < alone.0);
        assert_eq!(with_size(alone.1, beside.1.size, &config), beside);
        assert_eq!(with_size(beside.1, 0.0, &config), alone);
    }

    #[test]
    fn a_clear_view_is_accepted_and_another_part_is_not() {
        assert!(score(clear()) > 0.7, "{}", score(clear()));
        let other = Evidence {
            edges: 0.41,
            surface: Some(0.11),
            hue_shift: 0.3,
            visible: 0.52,
            outside: 0.0,
            close: Some(look(-2.6)),
        };
        assert!(score(Clues { evidence: other, ..clear() }) < 0.1);
    }

    #[test]
    fn what_contradicts_the_part_rejects_alone_and_what_is_merely_missing_does_not() {
        let best = |term: &Term| term.range.map(|value| term.log_odds(value)).into_iter().fold(f64::MIN, f64::max);
        let worst = |term: &Term| term.range.map(|value| term.log_odds(value)).into_iter().fold(f64::MAX, f64::min);
        let config = ScoreConfig::DEFAULT;
        // Model S has no network: the other terms must suffice.
        for asked in [true, false] {
            let terms: Vec<_> = config.terms().into_iter().filter(|(name, _)| asked || *name != "network").collect();
            for (name, term) in &terms {
                let others: f64 = terms.iter().filter(|(other, _)| other != name).map(|(_, term)| best(term)).sum();
                let contradicts = ["table", "added", "mirror"].contains(name);
                assert_eq!(config.bias + others + worst(term) < 0.0, contradicts, "{name}, network asked: {asked}");
            }
        }
    }

    #[test]
    fn each_kind_of_evidence_pulls_its_way() {
        let changed = |change: fn(&mut Clues)| {
            let mut clues = clear();
            change(&mut clues);
            score(clues) - score(clear())
        };
        assert!(changed(|c| c.evidence.edges = 0.9) > 0.0 && changed(|c| c.evidence.edges = 0.4) < 0.0);
        assert!(changed(|c| c.evidence.surface = Some(0.7)) > 0.0);
        assert!(changed(|c| c.evidence.hue_shift = 0.8) < 0.0);
        assert!(changed(|c| c.evidence.close = Some(look(-2.0))) < 0.0 && changed(|c| c.evidence.visible = 0.5) < 0.0);
        assert!(changed(|c| c.evidence.outside = 0.3) < 0.0 && changed(|c| c.resemblance = 0.45) < 0.0);
        assert!(changed(|c| c.network = Some(-0.9)) < 0.0);
        // Networks also propose look-alikes of the part.
        assert_eq!(changed(|c| c.network = Some(0.9)), 0.0);
    }

    #[test]
    fn sizes_relative_to_different_photos_are_not_compared() {
        let [one, other] = [0, 1].map(|idx| Clues { demonstration_idx: idx, log_size: 0.18 * idx as f64, ..clear() });
        let sizes = |clues: &[Clues]| {
            let judged = judge_picture(clues, &ScoreConfig::DEFAULT);
            judged.iter().map(|(_, evidence)| evidence.size).collect::<Vec<_>>()
        };
        assert_eq!(sizes(&[one, other]), [0.0; 2]);
        assert!(sizes(&[one, Clues { demonstration_idx: 0, ..other }]).iter().any(|size| *size < -1.0));
        // In a sequence, the reference is the size of earlier parts found with the same photo.
        let in_sequence = judge_picture_of_sequence(&[one, other], &[(1, 0.0)], &ScoreConfig::DEFAULT);
        assert!(in_sequence[0].1.size == 0.0 && in_sequence[1].1.size < -1.0);
    }

    #[test]
    fn parts_of_one_picture_have_the_size_of_the_surest() {
        let poorer = Evidence { edges: 0.6, visible: 0.85, ..clear().evidence };
        let near = Clues { evidence: poorer, log_size: 0.22, ..clear() };
        let far = Clues { log_size: 0.0, ..near };
        let sure = Clues { log_size: 0.2, ..clear() };
        let judged = judge_picture(&[far, sure, near], &ScoreConfig::DEFAULT);
        assert_eq!(judged[1].1.size, 0.0);
        assert!(judged[0].0 < judged[2].0 - 0.2, "{judged:?}");
        // Alone, each determines its own reference size.
        assert_eq!(judge_picture(&[far], &ScoreConfig::DEFAULT)[0].1.size, 0.0);
    }

    #[test]
    fn the_photo_that_would_help_depends_on_the_objection_and_the_light() {
        let config = ScoreConfig::DEFAULT;
        let of = |clues: Clues, light: f64| judge(&clues, None, &config).1.advice(light, &config);
        let plain = Clues { evidence: Evidence { surface: Some(0.0), edges: 0.5, ..clear().evidence }, ..clear() };
        assert_eq!(of(plain, 1.0), Some(Advice::OtherSide));
        assert_eq!([of(plain, 0.4), of(plain, 2.0)], [Some(Advice::DarkerPhoto), Some(Advice::BrighterPhoto)]);
        let covered = Clues { evidence: Evidence { visible: 0.2, ..clear().evidence }, ..clear() };
        assert_eq!(of(covered, 1.0), Some(Advice::Uncover));
        let cut = Clues { evidence: Evidence { outside: 0.4, ..clear().evidence }, ..clear() };
        assert_eq!(of(cut, 1.0), None);
        // The size that decides is that of the surest part, or with a calibrated camera that of the photo.
        let larger = Clues { log_size: 0.2, ..clear() };
        let of_size = |config: ScoreConfig| judge(&larger, Some(0.0), &config).1.advice(1.0, &config);
        assert_eq!(of_size(config), Some(Advice::OneHeight));
        assert_eq!(of_size(config.of_known_size()), Some(Advice::CheckLengths));
    }

    #[test]
    fn the_strongest_objection_comes_first() {
        let hidden = Clues { evidence: Evidence { visible: 0.2, ..clear().evidence }, ..clear() };
        let (_, contributions) = judge(&hidden, None, &ScoreConfig::DEFAULT);
        assert_eq!(contributions.strongest_objection(), Some(EvidenceKind::Visible));
        let covered =
            Clues { evidence: Evidence { close: Some(look(-1.5)), edges: 0.6, ..hidden.evidence }, ..clear() };
        let config = ScoreConfig::DEFAULT;
        let objections = |clues: &Clues| judge(clues, None, &config).1.objections(&config);
        assert_eq!(objections(&hidden)[0], EvidenceKind::Visible);
        // First the strongest objection, then the evidence that supports the part less than it could.
        let of_covered = objections(&covered);
        assert!(
            of_covered.contains(&EvidenceKind::Visible) && of_covered.contains(&EvidenceKind::Edges),
            "{of_covered:?}"
        );
        assert_eq!(
            objections(&Clues { evidence: Evidence { edges: 0.79, ..clear().evidence }, ..clear() }).first(),
            None
        );
    }
}
