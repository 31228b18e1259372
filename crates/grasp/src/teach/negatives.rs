//! Scenes without the part, in which the agreement of other objects with the demonstration is measured.
//!
//! The agreement of a demonstration with other objects depends on the part: a ring agrees with everything round, a
//! housing with many edges agrees with no other object. It is therefore measured in composed scenes during teaching.
//! The maximum over the scenes varies more with the seed than between parts, so the mean over the scenes is used: for
//! the paper's eight parts the mean was 0.26 to 0.39 in 60 composed scenes each; in 60 of the simulator's pictures it
//! differed by at most 0.04.

use sdg_demonstration::{
    Annotation, AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, Sample, SceneStyle,
};
use sdg_picture::halved;

use super::side_by_side::side_by_side;
#[cfg(feature = "fitting")]
use crate::check_config::CheckConfig;
use crate::check_config::ScoreConfig;
use crate::decimal::decimal;
use crate::error::Result;
use crate::models::{Network, Proposals};
use crate::sighting::{best_agreement, sightings};
use crate::sizes::scaling;
use crate::taught::TaughtDemonstration;
use crate::verification::{SearchedImage, search};

/// Minimum number of scenes with any agreement for a mean. Chosen by hand, not measured.
const MIN_SCENES: usize = 3;

/// Scenes without the part, and the demonstrations that are searched in them at the default size tolerance, not the
/// model's.
pub(crate) struct NegativeScenes {
    scenes: Vec<Sample>,
    demonstrations: Vec<TaughtDemonstration>,
}

/// Photos with more pixels are halved before scenes are composed from them. Chosen to save time: model S must be taught
/// in a second.
const MAX_PIXELS: u64 = 2_000_000;

/// Minimum length of the part in a halved photo, as in a photo for teaching: shorter ones have too few edges to compare.
const MIN_PART_PX: f64 = 20.0;

impl NegativeScenes {
    /// Composes `count` scenes of the demonstrations' size.
    ///
    /// # Errors
    /// As for [`Augmenter::new`]; a demonstration from which nothing can be taught.
    pub(crate) fn new(demonstrations: &[Demonstration], seed: u64, count: u64) -> Result<Self> {
        // No pieces of the part: they agree with it, but do not occur on a table.
        let style = SceneStyle { positive_share: 0.0, mutant_share: 0.0, ..SceneStyle::default() };
        let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
        let demonstrations: Vec<Demonstration> = demonstrations.iter().map(shrunk).collect();
        let augmenter = Augmenter::new(&demonstrations, config, seed)?;
        let numbers: Vec<u64> = (0..count).collect();
        let scenes = side_by_side(&numbers, |&number| Ok(augmenter.held_out(number)))?;
        let demonstrations = demonstrations.iter().map(TaughtDemonstration::new).collect::<Result<_>>()?;
        Ok(Self { scenes, demonstrations })
    }

    /// The place most similar to the part in each scene, from the network's candidates and from the search.
    ///
    /// # Errors
    /// An image that is invalid for the network.
    pub(crate) fn observe(&self, network: Option<&Network>) -> Result<Resemblances> {
        self.observe_with(network, &self.demonstrations)
    }

    /// As [`Self::observe`], with other comparison settings.
    ///
    /// # Errors
    /// As for [`Self::observe`]; a configuration out of range.
    #[cfg(feature = "fitting")]
    pub(crate) fn observe_as(&self, check: &CheckConfig) -> Result<Resemblances> {
        let changed = |demonstration: &TaughtDemonstration| demonstration.clone().with_check(check.clone());
        self.observe_with(None, &self.demonstrations.iter().map(changed).collect::<Result<Vec<_>>>()?)
    }

    fn observe_with(&self, network: Option<&Network>, demonstrations: &[TaughtDemonstration]) -> Result<Resemblances> {
        let highest = side_by_side(&self.scenes, |sample| {
            let searched = SearchedImage::new(&sample.image, demonstrations);
            let proposals = network.map_or(Ok(Proposals::default()), |n| n.proposals(&sample.image, demonstrations))?;
            let sightings = sightings(&proposals, &search(&searched), &searched);
            Ok(best_agreement(&sightings).map(|best| (best.placed.agreement, best.network_score)))
        })?;
        Ok(Resemblances { highest: highest.into_iter().flatten().collect() })
    }
}

/// The demonstration, halved until its photo is small enough or the part would be too small.
fn shrunk(demonstration: &Demonstration) -> Demonstration {
    let mut shrunk = demonstration.clone();
    let is_large = |shrunk: &Demonstration| {
        let part = &shrunk.annotation.bbox;
        u64::from(shrunk.image.width()) * u64::from(shrunk.image.height()) > MAX_PIXELS
            && part.width().max(part.height()) >= 2.0 * MIN_PART_PX
    };
    while is_large(&shrunk) {
        let half = scaling(0.5);
        let Annotation { label, bbox, grasp, jaw_width, outline } = shrunk.annotation;
        shrunk = Demonstration {
            image: halved(&shrunk.image),
            annotation: Annotation {
                label,
                bbox: bbox.scaled(0.5, 0.5),
                grasp: grasp.map(|grasp| grasp.transformed(&half)),
                jaw_width: jaw_width.map(|width| 0.5 * width),
                outline: outline.map(|outline| outline.transformed(&half)),
            },
        };
    }
    shrunk
}

/// The place most similar to the part in each scene with any agreement: agreement and the network's score.
pub(crate) struct Resemblances {
    highest: Vec<(f64, f64)>,
}

impl Resemblances {
    /// The resemblance of other objects to the part: the mean of the agreements, or a neutral value for too few scenes.
    pub(crate) fn resemblance(&self) -> f64 {
        if self.highest.len() < MIN_SCENES {
            return ScoreConfig::DEFAULT.resemblance.neutral;
        }
        decimal(self.highest.iter().map(|(agreement, _)| agreement).sum::<f64>() / self.highest.len() as f64)
    }

    /// The network's scores.
    pub(crate) fn network_scores(&self) -> impl Iterator<Item = f64> {
        self.highest.iter().map(|(_, network_score)| *network_score)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;

    #[test]
    fn other_things_resemble_the_part_less_than_it_resembles_itself() {
        let demonstrations = [demonstration()];
        let taught = [TaughtDemonstration::new(&demonstrations[0]).unwrap()];
        let negatives = NegativeScenes::new(&demonstrations, 3, 12).unwrap();
        let resemblance = negatives.observe(None).unwrap().resemblance();
        let best = |image| {
            search(&SearchedImage::new(image, &taught)).iter().map(|placed| placed.agreement).fold(0.0, f64::max)
        };
        let agreements: Vec<f64> = negatives.scenes.iter().map(|sample| best(&sample.image)).collect();
        // Some objects resemble the part; otherwise the test would be meaningless.
        assert!(
            resemblance > 0.1 && agreements.iter().all(|&agreement| agreement < 0.6),
            "{resemblance} {agreements:?}"
        );
        assert!(best(&demonstrations[0].image) > 0.9);
    }
}
