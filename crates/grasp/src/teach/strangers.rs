//! Scenes of things that are not the part: how much of the demonstration is seen in them all the same.
//!
//! How well a demonstration agrees with what it is not depends on the part: a ring agrees with anything round, a housing
//! full of edges with nothing. Composed scenes tell by how much before a single real one was seen. Their highest
//! agreement varies with the seed more than parts differ, and was no guide; their mean is one. Over the eight shipped
//! parts it was 0.26 to 0.39 in 60 composed scenes each, within 0.04 of that in as many of the simulator's pictures, where
//! the highest wrong agreement lay 0.03 to 0.17 above it. At 0.2 above, 10 of 960 right poses are refused; 0.545 for all
//! parts, as agreement was measured then, refused 83.

use sdg_demonstration::{AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, Sample, SceneStyle};

use crate::calibration::Calibration;
use crate::error::Result;
use crate::models::{Network, instant};
use crate::taught::TaughtDemonstration;
use crate::verification::{Scene, better_way_round, verify};

/// Scenes without the part.
pub(crate) struct Strangers {
    scenes: Vec<Sample>,
}

impl Strangers {
    /// Composes `count` scenes of the demonstrations' size.
    ///
    /// # Errors
    /// As [`Augmenter::new`].
    pub(crate) fn new(demonstrations: &[Demonstration], seed: u64, count: u64) -> Result<Self> {
        // Pieces of the part itself agree with it, and lie on no table.
        let style = SceneStyle { positive_share: 0.0, mutant_share: 0.0, ..SceneStyle::default() };
        let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
        let augmenter = Augmenter::new(demonstrations, config, seed)?;
        Ok(Self { scenes: (0..count).map(|i| augmenter.held_out(i)).collect() })
    }

    /// Where the agreement decides: above what strangers have, as the network proposes them and as they are searched for.
    ///
    /// # Errors
    /// An image that the network refuses.
    pub(super) fn calibrate(
        &self,
        network: Option<&Network>,
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Calibration> {
        let config = demonstrations.first().map(|first| first.check().threshold).unwrap_or_default();
        Ok(config.calibration(&self.agreements(network, demonstrations)?))
    }

    /// The highest agreement in each scene in which anything agrees at all.
    ///
    /// # Errors
    /// An image that the network refuses.
    pub(crate) fn agreements(
        &self,
        network: Option<&Network>,
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Vec<f64>> {
        let mut highest = Vec::with_capacity(self.scenes.len());
        for sample in &self.scenes {
            let scene = Scene::new(&sample.image, demonstrations);
            // At any size: what another size costs is there to part strangers further from the part, not to lower the bar.
            let mut agreements = Vec::new();
            for overlay in instant::search(demonstrations, &scene) {
                agreements.push(overlay.agreement_at_any_size);
                if network.is_some() {
                    // It may propose the same place, and what it proposes is refined from both ways round.
                    let refined = better_way_round(overlay.demonstration, &overlay.image_from_cutout, &scene);
                    agreements.push(refined.agreement_at_any_size);
                }
            }
            for candidate in network.map_or(Ok(Vec::new()), |n| n.candidates(&sample.image, demonstrations))? {
                let overlay = verify(&demonstrations[candidate.demonstration_idx], &candidate, &scene);
                agreements.push(overlay.agreement_at_any_size);
            }
            highest.extend(agreements.into_iter().reduce(f64::max));
        }
        Ok(highest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;

    #[test]
    fn the_threshold_stands_above_strangers_and_below_the_part() {
        let demonstrations = [demonstration()];
        let taught = [TaughtDemonstration::new(&demonstrations[0]).unwrap()];
        let strangers = Strangers::new(&demonstrations, 3, 12).unwrap();
        let calibration = strangers.calibrate(None, &taught).unwrap();
        let best = |image| {
            let found = instant::search(&taught, &Scene::new(image, &taught));
            found.iter().map(|overlay| calibration.apply(overlay.agreement)).fold(0.0, f64::max)
        };
        let scores: Vec<f64> = strangers.scenes.iter().map(|sample| best(&sample.image)).collect();
        // Some resemble it, or there would be nothing to tell apart.
        assert!(scores.iter().any(|&score| score > 0.0) && scores.iter().all(|&score| score < 0.5), "{scores:?}");
        assert!(best(&demonstrations[0].image) > 0.95);
    }
}
