//! Places where the part may be: as the network proposes, and as the search finds.

use sdg_shape::parallel;

use crate::facts::TurnSource;
use crate::model::are_outlines_of_same_part;
use crate::models::{Candidate, Proposals};
use crate::verification::{Overlay, Scene, search, verify};

/// Boxes that overlap so much are taken for the same part's. Chosen by hand, not measured.
pub(crate) const SAME_PART_IOU: f64 = 0.5;

/// A place where the part may be, before it is scored.
pub(crate) struct Sighting<'a> {
    pub(crate) overlay: Overlay<'a>,
    /// 0 where the network proposes nothing.
    pub(crate) network_score: f64,
    /// The network's scores of the keypoints; empty where the search found the place.
    pub(crate) keypoint_scores: Vec<f64>,
    pub(crate) turn_source: TurnSource,
}

/// The one that agrees best, whatever its score.
#[cfg(feature = "teach")]
pub(crate) fn best_agreement<'s, 'a>(sightings: &'s [Sighting<'a>]) -> Option<&'s Sighting<'a>> {
    sightings.iter().max_by(|a, b| a.overlay.agreement.total_cmp(&b.overlay.agreement))
}

/// All such places in an image: first those that a network proposes, then those that the search finds. A place may come twice.
pub(crate) fn sightings<'a>(proposals: &Proposals, scene: &Scene<'a>) -> Vec<Sighting<'a>> {
    let found = search(scene);
    let proposed = parallel::map(&proposals.candidates, |candidate| {
        let overlay = found_already(candidate, &found).copied().or_else(|| verify(candidate, scene))?;
        Some(Sighting {
            overlay,
            network_score: candidate.network_score,
            keypoint_scores: candidate.keypoints.iter().map(|(_, score)| *score).collect(),
            turn_source: candidate.turn_source,
        })
    });
    let searched = found.iter().map(|overlay| Sighting {
        overlay: *overlay,
        network_score: proposals.score_at(&overlay.outline().bounds()),
        keypoint_scores: Vec::new(),
        turn_source: TurnSource::Search,
    });
    proposed.into_iter().flatten().chain(searched).collect()
}

/// The pose that the search found of the part that the candidate shows, where it agrees so well that refining the candidate's
/// own pose, most of the time that model C took, would end there.
fn found_already<'f, 'a>(candidate: &Candidate, found: &'f [Overlay<'a>]) -> Option<&'f Overlay<'a>> {
    let of_same_part = found.iter().filter(|overlay| {
        let demonstration = overlay.demonstration;
        overlay.demonstration_idx == candidate.demonstration_idx
            && overlay.agreement >= demonstration.check().search.shape.settling.sure_agreement
            && are_outlines_of_same_part(&demonstration.outline(&candidate.image_from_cutout), &overlay.outline())
    });
    of_same_part.max_by(|a, b| a.agreement.total_cmp(&b.agreement))
}
