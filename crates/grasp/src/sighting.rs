//! Places where the part may be, from the network's candidates and from the search.

use sdg_shape::parallel;

use crate::facts::TurnSource;
use crate::models::{PoseCandidate, Proposals};
use crate::same_part::are_outlines_of_same_part;
#[cfg(feature = "teach")]
use crate::verification::search;
use crate::verification::{PlacedDemonstration, SearchedImage, verify};

/// A place where the part may be, before it is scored.
pub(crate) struct Sighting<'a> {
    pub(crate) placed: PlacedDemonstration<'a>,
    /// The network's score; 0 if the network has no box there.
    pub(crate) network_score: f64,
    /// The network's scores of the keypoints; empty for a place found by the search.
    pub(crate) keypoint_scores: Vec<f64>,
    pub(crate) turn_source: TurnSource,
}

/// The sighting with the highest agreement, regardless of its score.
#[cfg(feature = "teach")]
pub(crate) fn best_agreement<'s, 'a>(sightings: &'s [Sighting<'a>]) -> Option<&'s Sighting<'a>> {
    sightings.iter().max_by(|a, b| a.placed.agreement.total_cmp(&b.placed.agreement))
}

/// All sightings in an image: first the network's candidates, then `found`, the matches of the search. A place may
/// occur twice.
pub(crate) fn sightings<'a>(
    proposals: &Proposals,
    found: &[PlacedDemonstration<'a>],
    image: &SearchedImage<'a>,
) -> Vec<Sighting<'a>> {
    let proposed = parallel::map(&proposals.candidates, |candidate| proposed(candidate, found, image));
    proposed.into_iter().flatten().chain(found.iter().map(|placed| searched(placed, proposals))).collect()
}

/// As [`sightings`], but with the network's candidates only down to the first correct one: verifying the others takes
/// longer than the search and does not change the network's score on the part.
#[cfg(feature = "teach")]
pub(crate) fn sightings_to_first<'a>(
    proposals: &Proposals,
    image: &SearchedImage<'a>,
    is_right: impl Fn(&Sighting<'a>) -> bool,
) -> Vec<Sighting<'a>> {
    let found = search(image);
    let mut all = Vec::new();
    for sighting in proposals.candidates.iter().filter_map(|candidate| proposed(candidate, &found, image)) {
        let is_right = is_right(&sighting);
        all.push(sighting);
        if is_right {
            break;
        }
    }
    all.extend(found.iter().map(|placed| searched(placed, proposals)));
    all
}

fn proposed<'a>(
    candidate: &PoseCandidate,
    found: &[PlacedDemonstration<'a>],
    image: &SearchedImage<'a>,
) -> Option<Sighting<'a>> {
    let placed = found_already(candidate, found).copied().or_else(|| verify(candidate, image))?;
    Some(Sighting {
        placed,
        network_score: candidate.network_score,
        keypoint_scores: candidate.keypoints.iter().map(|(_, score)| *score).collect(),
        turn_source: candidate.turn_source,
    })
}

fn searched<'a>(placed: &PlacedDemonstration<'a>, proposals: &Proposals) -> Sighting<'a> {
    Sighting {
        placed: *placed,
        network_score: proposals.score_at(&placed.outline().bounds()),
        keypoint_scores: Vec::new(),
        turn_source: TurnSource::Search,
    }
}

/// The pose found by the search on the candidate's part, if its agreement is so high that the refinement of the
/// candidate's pose would converge to it. This saves the refinement, which took most of model C's time.
fn found_already<'f, 'a>(
    candidate: &PoseCandidate,
    found: &'f [PlacedDemonstration<'a>],
) -> Option<&'f PlacedDemonstration<'a>> {
    let of_same_part = found.iter().filter(|placed| {
        let demonstration = placed.demonstration;
        placed.demonstration_idx == candidate.demonstration_idx
            && placed.agreement >= demonstration.check().search.shape.refinement.sure_agreement
            && are_outlines_of_same_part(&demonstration.outline(&candidate.image_from_cutout), &placed.outline())
    });
    of_same_part.max_by(|a, b| a.agreement.total_cmp(&b.agreement))
}
