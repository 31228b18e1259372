//! Generated parts as negatives in the scenes of teaching.
//!
//! None of these parts is a shipped part, and their seeds are separate from those of the parts for all measurements.

use sdg_demonstration::{AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, SceneStyle};
use sdg_part_generator::{Part, PhotoConfig, demonstration};

use super::side_by_side::side_by_side;
use crate::error::Result;
use crate::models::Network;
use crate::sighting::{best_agreement, sightings};
use crate::taught::TaughtDemonstration;
use crate::verification::{SearchedImage, search};

/// Photos of the size of the network's input.
const PHOTO: PhotoConfig = PhotoConfig { width: 320, height: 240, fill: [0.4, 0.6] };

/// First seed of the other parts, far from those of the parts for measurements and pretraining.
const FIRST_SEED: u64 = 1 << 48;

/// Generates up to `count` parts for training, and a third as many that are held out.
pub(super) fn draw(count: usize, seed: u64) -> [Vec<Demonstration>; 2] {
    let first = FIRST_SEED.wrapping_add(seed.wrapping_mul(10_000));
    let one = |i: usize| demonstration(&Part::generate(first.wrapping_add(i as u64)), &PHOTO, 0);
    let all: Vec<Demonstration> = (0..count + count.div_ceil(3))
        .map(one)
        .filter(|demonstration| demonstration.annotation.outline.is_some())
        .collect();
    let held_back = all.len() - all.len() * 3 / 4;
    let (held_back, to_learn) = all.split_at(held_back);
    [to_learn.to_vec(), held_back.to_vec()]
}

/// Number of pictures of other parts on which the network's score is calibrated, so that there are about as many
/// pictures without the part as with it. Derived from this reason, not measured.
const NUM_PICTURES: u64 = 16;

/// The scores of a network in pictures of other parts without the part.
#[derive(Default)]
pub(super) struct OnOtherParts {
    /// The network's highest score in each picture.
    pub(super) highest: Vec<f64>,
    /// The network's score at the sighting of best agreement in each picture that has one; 0 without a box.
    pub(super) best_agreement: Vec<f64>,
}

/// Applies a network to pictures of other parts; empty without other parts.
///
/// # Errors
/// As for [`Augmenter::new`]; an image that is invalid for the network.
pub(super) fn shown(
    demonstrations: &[Demonstration],
    others: &[Demonstration],
    network: &Network,
    seed: u64,
) -> Result<OnOtherParts> {
    let mut shown = OnOtherParts::default();
    if others.is_empty() {
        return Ok(shown);
    }
    let style = SceneStyle { positive_share: 0.0, other_part_share: 1.0, ..SceneStyle::default() };
    let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
    let augmenter = Augmenter::new(demonstrations, config, seed)?.with_other_parts(others)?;
    let taught = demonstrations.iter().map(TaughtDemonstration::new).collect::<Result<Vec<_>>>()?;
    let numbers: Vec<u64> = (0..NUM_PICTURES).collect();
    let seen = side_by_side(&numbers, |&number| {
        let sample = augmenter.held_out(number);
        let proposals = network.proposals(&sample.image, &taught)?;
        let highest = proposals.candidates.first().map_or(0.0, |candidate| candidate.network_score);
        let searched = SearchedImage::new(&sample.image, &taught);
        let sightings = sightings(&proposals, &search(&searched), &searched);
        Ok((highest, best_agreement(&sightings).map(|sighting| sighting.network_score)))
    })?;
    for (highest, best_agreement) in seen {
        shown.highest.push(highest);
        shown.best_agreement.extend(best_agreement);
    }
    Ok(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_back_is_not_learnt_with() {
        let [to_learn, held_back] = draw(9, 4);
        assert_eq!((to_learn.len(), held_back.len()), (9, 3));
        assert!(held_back.iter().all(|other| to_learn.iter().all(|one| one.image != other.image)));
        assert_eq!(draw(9, 4)[0][0].image, to_learn[0].image);
        assert_eq!(draw(0, 4), [vec![], vec![]]);
    }
}
