//! Runs each model on every part's photo: it must find the part in its own photo, and nothing in the other photos.

use anyhow::{Context, Result};
use image::RgbImage;
use rayon::prelude::*;
use sdg_grasp::{Device, Verification};

use super::part_store::PartStore;
use crate::labelled_pictures::DEFAULT_MIN_SCORE;

/// The best score of each model on each photo.
#[derive(Debug, Clone)]
pub struct CrossCheck {
    /// `scores[model][photo]`, in the order of the parts; zero if nothing was found.
    pub scores: Vec<Vec<f64>>,
}

/// Two parts; the model of at least one of them accepts the photo of the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookAlikePair {
    /// Indices of the two parts.
    pub parts: [usize; 2],
    /// Score of the first part's model on the second part's photo, and the reverse.
    pub scores: [f64; 2],
}

impl CrossCheck {
    /// Runs every model on every photo; `done` is called after each model.
    ///
    /// # Errors
    /// Models cannot be read, or detection fails.
    pub fn run(store: &PartStore, names: &[&str], photos: &[RgbImage], done: &(dyn Fn(&str) + Sync)) -> Result<Self> {
        let row = |name: &&str| -> Result<Vec<f64>> {
            let model = sdg_inputs::read_model(&store.model_file(name), &Device::flex())?;
            let best = |photo: &RgbImage| -> Result<f64> {
                let found = model.detect(photo, Verification::ByShape).with_context(|| (*name).to_owned())?;
                Ok(found.iter().map(|detection| detection.score).fold(0.0, f64::max))
            };
            let scores = photos.iter().map(best).collect::<Result<Vec<f64>>>()?;
            done(name);
            Ok(scores)
        };
        Ok(Self { scores: names.par_iter().map(row).collect::<Result<_>>()? })
    }

    /// Whether a model finds its part in its own photo.
    pub fn finds_own(&self, part: usize) -> bool {
        self.scores[part][part] >= DEFAULT_MIN_SCORE
    }

    /// The pairs that would be confused, in order of decreasing score.
    pub fn look_alikes(&self) -> Vec<LookAlikePair> {
        let num_parts = self.scores.len();
        let pairs = (0..num_parts).flat_map(|a| (a + 1..num_parts).map(move |b| [a, b]));
        let scored =
            |[a, b]: [usize; 2]| LookAlikePair { parts: [a, b], scores: [self.scores[a][b], self.scores[b][a]] };
        let mut pairs: Vec<LookAlikePair> = pairs.map(scored).filter(|pair| pair.best() >= DEFAULT_MIN_SCORE).collect();
        pairs.sort_by(|a, b| b.best().total_cmp(&a.best()));
        pairs
    }
}

impl LookAlikePair {
    fn best(&self) -> f64 {
        self.scores[0].max(self.scores[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_looks_alike_where_either_model_accepts_the_other() {
        let scores = vec![vec![0.9, 0.1, 0.6], vec![0.2, 0.4, 0.0], vec![0.3, 0.8, 0.95]];
        let check = CrossCheck { scores };
        let pairs = check.look_alikes();
        assert_eq!(pairs.iter().map(|pair| pair.parts).collect::<Vec<_>>(), [[1, 2], [0, 2]]);
        assert_eq!(pairs[0].scores, [0.0, 0.8]);
        assert_eq!([0, 1, 2].map(|part| check.finds_own(part)), [true, false, true]);
    }
}
