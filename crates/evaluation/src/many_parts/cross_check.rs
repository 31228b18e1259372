//! Runs each model on every part's photo: it must find the part in its own photo, and nothing in the other photos.

use anyhow::{Context, Result, bail};
use image::RgbImage;
use rayon::prelude::*;
use sdg_grasp::{Device, Verification};

use super::folder::PartDemonstrations;
use super::part_store::PartStore;
use crate::labelled_pictures::DEFAULT_MIN_SCORE;

/// Maximum number of photos in memory: 0.6 GB of photos of 12 megapixels.
pub(super) const PHOTOS_AT_ONCE: usize = 16;

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
    /// Runs every model on the first photo of every part. [`PHOTOS_AT_ONCE`] photos are read at a time, and `seen` gets
    /// each of them in order; after every model, `done` gets its name and the number of these photos.
    ///
    /// # Errors
    /// Photos or models cannot be read, or detection fails; or `is_interrupted` returned true.
    pub fn run(
        store: &PartStore,
        parts: &[&PartDemonstrations],
        is_interrupted: &(dyn Fn() -> bool + Sync),
        seen: &mut dyn FnMut(&RgbImage),
        done: &(dyn Fn(&str, usize) + Sync),
    ) -> Result<Self> {
        Self::run_in_rounds(store, parts, PHOTOS_AT_ONCE, is_interrupted, seen, done)
    }

    fn run_in_rounds(
        store: &PartStore,
        parts: &[&PartDemonstrations],
        photos_at_once: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        seen: &mut dyn FnMut(&RgbImage),
        done: &(dyn Fn(&str, usize) + Sync),
    ) -> Result<Self> {
        let mut scores = vec![Vec::with_capacity(parts.len()); parts.len()];
        for round in parts.chunks(photos_at_once) {
            let photos = round.iter().map(|part| part.first_photo()).collect::<Result<Vec<RgbImage>>>()?;
            for photo in &photos {
                seen(photo);
            }
            let row = |part: &&PartDemonstrations| -> Result<Vec<f64>> {
                if is_interrupted() {
                    bail!("interrupted: run the same command again to compare the parts");
                }
                let model = sdg_inputs::read_model(&store.model_file(&part.name), &Device::flex())?;
                let best = |photo: &RgbImage| -> Result<f64> {
                    let found = model.detect(photo, Verification::ByShape).with_context(|| part.name.clone())?;
                    Ok(found.iter().map(|detection| detection.score).fold(0.0, f64::max))
                };
                let scores = photos.iter().map(best).collect::<Result<Vec<f64>>>()?;
                done(&part.name, photos.len());
                Ok(scores)
            };
            let rows = parts.par_iter().map(row).collect::<Result<Vec<Vec<f64>>>>()?;
            for (all, of_round) in scores.iter_mut().zip(rows) {
                all.extend(of_round);
            }
        }
        Ok(Self { scores })
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
    use std::ops::ControlFlow;
    use std::path::Path;

    use sdg_grasp::{ModelKind, TeachOptions, teach};

    use super::*;
    use crate::many_parts::{PartOutcome, PartRecord};

    #[test]
    fn photos_read_one_after_the_other_have_the_scores_of_photos_read_at_once() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations");
        let folder = tempfile::tempdir().unwrap();
        let store = PartStore::open(folder.path()).unwrap();
        let parts = ["key", "rod_end"].map(|name| {
            let files = vec![(shipped.join(name).join("image.png"), shipped.join(name).join("annotation.json"))];
            let part = PartDemonstrations { name: name.to_owned(), files, symmetry: None };
            let mut options = TeachOptions::new(1);
            options.kind = ModelKind::S;
            let taught = teach(&part.read().unwrap(), &options, &mut |_| ControlFlow::Continue(())).unwrap();
            let outcome = PartOutcome::Failed { why: "not tested".to_owned() };
            let record = PartRecord { key: serde_json::Value::Null, outcome };
            store.write(name, Some(taught.model.to_bytes().unwrap().as_slice()), &record).unwrap();
            part
        });
        let parts: Vec<&PartDemonstrations> = parts.iter().collect();
        let [one_by_one, at_once] = [1, 2].map(|photos_at_once| {
            let mut num_seen = 0;
            let mut seen = |photo: &RgbImage| num_seen += usize::from(photo.dimensions() == (640, 480));
            let done = |_: &str, photos: usize| assert_eq!(photos, photos_at_once);
            let check = CrossCheck::run_in_rounds(&store, &parts, photos_at_once, &|| false, &mut seen, &done).unwrap();
            assert_eq!(num_seen, 2);
            check
        });
        assert_eq!(one_by_one.scores, at_once.scores);
        let interrupted = CrossCheck::run(&store, &parts, &|| true, &mut |_| (), &|_, _| ()).unwrap_err();
        assert!(interrupted.to_string().starts_with("interrupted"), "{interrupted}");
        assert!(at_once.finds_own(0) && at_once.finds_own(1) && at_once.look_alikes().is_empty(), "{at_once:?}");
    }

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
