//! Generated parts as negatives in the scenes that a part is taught on.
//!
//! They are none of the shipped parts, and not the ones that anything is measured on: a seed of their own draws them.

use sdg_demonstration::{AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, SceneStyle};
use sdg_part_generator::{Part, PhotoConfig, demonstration};

use crate::error::Result;
use crate::models::Network;
use crate::taught::TaughtDemonstration;

/// Photos as large as the network's input.
const PHOTO: PhotoConfig = PhotoConfig { width: 320, height: 240, fill: [0.4, 0.6] };

/// Seeds of other parts start here, far from those of parts to measure and to pretrain on.
const FIRST_SEED: u64 = 1 << 48;

/// So many parts to learn with, and a third as many others to hold back.
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

/// Pictures of other parts that the network's score is calibrated on: with them there are about as many without the part
/// as with it. Chosen by that reasoning, not measured.
const NUM_PICTURES: u64 = 24;

/// The network's highest score in each picture of other parts without the part; no pictures where there are no others.
///
/// # Errors
/// As [`Augmenter::new`]; an image that the network refuses.
pub(super) fn highest_scores(
    demonstrations: &[Demonstration],
    others: &[Demonstration],
    network: &Network,
    seed: u64,
) -> Result<Vec<f64>> {
    if others.is_empty() {
        return Ok(Vec::new());
    }
    let style = SceneStyle { positive_share: 0.0, other_part_share: 1.0, ..SceneStyle::default() };
    let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
    let augmenter = Augmenter::new(demonstrations, config, seed)?.with_other_parts(others)?;
    let taught = demonstrations.iter().map(TaughtDemonstration::new).collect::<Result<Vec<_>>>()?;
    let highest = |i: u64| {
        let best = network.proposals(&augmenter.held_out(i).image, &taught)?.candidates.into_iter().next();
        Ok(best.map_or(0.0, |candidate| candidate.network_score))
    };
    (0..NUM_PICTURES).map(highest).collect()
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
