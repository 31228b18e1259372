//! Places where the part may be: as the network proposes, and as the search finds.

use crate::facts::TurnSource;
use crate::models::Proposals;
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
    let proposed = proposals.candidates.iter().filter_map(|candidate| {
        Some(Sighting {
            overlay: verify(candidate, scene)?,
            network_score: candidate.network_score,
            keypoint_scores: candidate.keypoints.iter().map(|(_, score)| *score).collect(),
            turn_source: candidate.turn_source,
        })
    });
    let mut sightings: Vec<Sighting> = proposed.collect();
    for overlay in search(scene) {
        let bounds = overlay.demonstration.outline(&overlay.image_from_cutout).bounds();
        sightings.push(Sighting {
            overlay,
            network_score: proposals.score_at(&bounds),
            keypoint_scores: Vec::new(),
            turn_source: TurnSource::Search,
        });
    }
    sightings
}
