//! Pairs of rendered sets: photos and pictures of the same parts in physically different light.

use std::collections::BTreeMap;
use std::path::Path;

use rand::Rng;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64Mcg;
use sdg_grasp::fitting::{PAIR_RECORD_BYTES, pair_facts, pair_of};
use sdg_shape::Pair;

use crate::drawn::Result;
use crate::edits::edited;
use crate::pairs::changed;

/// One part in this many is held out, if parts are held out.
const HELD_OUT: usize = 4;
/// Fraction of examples drawn from the correct ones, if the part also has wrong ones. Chosen by hand.
const RIGHT_SHARE: f64 = 0.55;
/// Fraction of examples whose photo is another picture of the part. Chosen by hand.
const OTHER_PHOTO_SHARE: f64 = 0.6;
/// Fraction of correct examples that an edit of the photo makes wrong. Chosen by hand.
const EDITED_SHARE: f64 = 0.25;

/// Examples of one part.
#[derive(Default)]
struct OfPart {
    right: Vec<Pair>,
    /// Indices of the correct examples whose picture can serve as a photo.
    clear: Vec<usize>,
    wrong: Vec<Pair>,
}

/// Examples of rendered parts.
pub struct Rendered {
    training: Vec<OfPart>,
    held_out: Vec<OfPart>,
}

impl Rendered {
    /// No examples.
    pub const EMPTY: Self = Self { training: Vec::new(), held_out: Vec::new() };

    /// Reads a file of `rendered_pairs`; with `holds_out`, every fourth part is kept out of training.
    pub fn read(path: &Path, holds_out: bool) -> Result<Self> {
        let bytes = std::fs::read(path)?;
        let mut parts: BTreeMap<u16, OfPart> = BTreeMap::new();
        for record in bytes.chunks_exact(PAIR_RECORD_BYTES) {
            let facts = pair_facts(record);
            let part = parts.entry(facts.part_idx).or_default();
            if facts.is_right && facts.is_clear {
                part.clear.push(part.right.len());
            }
            if facts.is_right { &mut part.right } else { &mut part.wrong }.push(pair_of(record));
        }
        let mut read = Self::EMPTY;
        for (idx, part) in parts.into_values().filter(|part| !part.right.is_empty()).enumerate() {
            let is_held_out = holds_out && idx % HELD_OUT == HELD_OUT - 1;
            if is_held_out { &mut read.held_out } else { &mut read.training }.push(part);
        }
        Ok(read)
    }

    pub fn is_empty(&self) -> bool {
        self.training.is_empty()
    }

    /// A training example; each part is drawn equally often.
    pub fn sample(&self, rng: &mut Pcg64Mcg) -> (Pair, bool) {
        let part = self.training.choose(rng).expect("some part is trained on");
        let mut is_right = part.wrong.is_empty() || rng.random_bool(RIGHT_SHARE);
        let of_it = if is_right { &part.right } else { &part.wrong };
        let mut pair = of_it.choose(rng).expect("parts without correct examples are left out").clone();
        if !part.clear.is_empty() && rng.random_bool(OTHER_PHOTO_SHARE) {
            let other = &part.right[*part.clear.choose(rng).expect("it is not empty")];
            pair.photo.clone_from(&other.picture);
        }
        if is_right
            && rng.random_bool(EDITED_SHARE)
            && let Some(edited) = edited(&pair, rng)
        {
            (pair, is_right) = (edited, false);
        }
        (changed(&pair, rng), is_right)
    }

    /// The held-out examples, unchanged.
    pub fn held_out(&self) -> impl Iterator<Item = (&Pair, bool)> {
        self.held_out.iter().flat_map(|part| {
            part.right.iter().map(|pair| (pair, true)).chain(part.wrong.iter().map(|pair| (pair, false)))
        })
    }
}
