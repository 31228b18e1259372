//! Pairs of photo and aligned picture: drawn, stored, and randomly changed for training.

use std::collections::BTreeSet;
use std::path::Path;

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_files::write_atomically;
use sdg_grasp::fitting::{PAIR_RECORD_BYTES as RECORD, PairFacts, append_pair, likeness_examples, pair_facts, pair_of};
use sdg_part_generator::{Condition, SceneConfig};
use sdg_shape::{Pair, SIDE};

use crate::drawn::{Result, absent, draw_parts};

/// Pixels of a pair.
pub const AREA: usize = SIDE * SIDE;
/// Parts drawn together: all of them are in memory with their pictures.
const PARTS_AT_ONCE: usize = 20;
/// Picture sizes, used alternately.
const SIZES: [[u32; 2]; 2] = [[640, 480], [320, 240]];

/// The use of an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    Training,
    HeldOut,
}

/// Examples as bytes, one after the other.
pub struct Pairs {
    bytes: Vec<u8>,
}

/// Half range of the logarithm of the exposure. Chosen by hand.
const EXPOSURE: f32 = 0.5;
/// Half range of the logarithm of gamma. Chosen by hand.
const GAMMA: f32 = 0.4;
/// Half range of the logarithm of each colour's gain. Chosen by hand.
const TINT: f32 = 0.1;
/// Maximum standard deviation of the noise. Chosen by hand.
const NOISE: f32 = 0.02;

impl Pairs {
    /// No examples.
    pub const EMPTY: Self = Self { bytes: Vec::new() };

    /// Generates the missing parts and searches for them; held-out parts use another seed than training parts.
    pub fn drawn_up_to(self, parts: usize, held_out: usize, seed: u64, say: &mut dyn FnMut(String)) -> Result<Self> {
        let once = |condition| (SceneConfig::only(condition), 1);
        let kinds: Vec<(SceneConfig, u64)> = Condition::ALL
            .map(once)
            .into_iter()
            .chain([Condition::Cover, Condition::LookAlikes].map(once))
            .chain([(absent(Condition::LookAlikes), 2), (absent(Condition::Clutter), 1), (SceneConfig::default(), 3)])
            .collect();
        let kept = self.chunks();
        let mut bytes = self.bytes;
        for (stream, count) in [(Stream::Training, parts), (Stream::HeldOut, held_out)] {
            for begin in (0..count).step_by(PARTS_AT_ONCE) {
                let chunk_idx = begin / PARTS_AT_ONCE;
                if kept.contains(&(stream as u8, chunk_idx)) {
                    continue;
                }
                let seed = seed.wrapping_mul(1000).wrapping_add(500 * stream as u64 + chunk_idx as u64);
                let drawn = draw_parts(PARTS_AT_ONCE.min(count - begin), SIZES[chunk_idx % SIZES.len()], &kinds, seed)?;
                for (i, part) in drawn.iter().enumerate() {
                    for example in likeness_examples(part)? {
                        let facts = PairFacts {
                            stream: stream as u8,
                            part_idx: u16::try_from(begin + i)?,
                            is_right: example.is_right,
                            is_clear: false,
                        };
                        append_pair(&mut bytes, facts, &example.pair);
                    }
                }
                say(format!("{stream:?}: {} parts, {} examples", begin + drawn.len(), bytes.len() / RECORD));
            }
        }
        Ok(Self { bytes }.sorted())
    }

    /// The groups of [`PARTS_AT_ONCE`] parts that are present, as stream and index of the group.
    fn chunks(&self) -> BTreeSet<(u8, usize)> {
        let chunk = |facts: PairFacts| (facts.stream, usize::from(facts.part_idx) / PARTS_AT_ONCE);
        self.bytes.chunks_exact(RECORD).map(pair_facts).map(chunk).collect()
    }

    /// The records in the order in which the parts are generated.
    fn sorted(self) -> Self {
        let mut records: Vec<&[u8]> = self.bytes.chunks_exact(RECORD).collect();
        records.sort_by_key(|record| (pair_facts(record).stream, pair_facts(record).part_idx));
        Self { bytes: records.concat() }
    }

    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path)?;
        if bytes.is_empty() || bytes.len() % RECORD != 0 {
            return Err(format!("{}: expected records of {RECORD} bytes, found {}", path.display(), bytes.len()).into());
        }
        Ok(Self { bytes })
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        Ok(write_atomically(path, &self.bytes)?)
    }

    /// Number of all examples.
    pub fn len(&self) -> usize {
        self.bytes.len() / RECORD
    }

    /// Indices of the examples of a stream.
    pub fn of(&self, stream: Stream) -> Vec<usize> {
        (0..self.len()).filter(|&idx| pair_facts(self.record(idx)).stream == stream as u8).collect()
    }

    /// Numbers of correct and wrong examples of a stream.
    pub fn counts(&self, stream: Stream) -> (usize, usize) {
        let of_it = self.of(stream);
        let right = of_it.iter().filter(|&&idx| self.is_right(idx)).count();
        (right, of_it.len() - right)
    }

    pub fn is_right(&self, idx: usize) -> bool {
        pair_facts(self.record(idx)).is_right
    }

    fn record(&self, idx: usize) -> &[u8] {
        &self.bytes[idx * RECORD..][..RECORD]
    }

    /// The unchanged pair.
    pub fn pair(&self, idx: usize) -> Pair {
        pair_of(self.record(idx))
    }

    /// The pair as changed by [`changed`].
    pub fn changed_pair(&self, idx: usize, rng: &mut Pcg64Mcg) -> Pair {
        changed(&self.pair(idx), rng)
    }
}

/// Rotates and mirrors both images together, and changes the light of each differently.
pub fn changed(pair: &Pair, rng: &mut Pcg64Mcg) -> Pair {
    let pair = turned(pair, rng);
    Pair { photo: in_other_light(&pair.photo, 0.6, rng), picture: in_other_light(&pair.picture, 1.0, rng), ..pair }
}

/// Rotates both images by the same angle about the centre, and mirrors both or neither.
fn turned(pair: &Pair, rng: &mut Pcg64Mcg) -> Pair {
    let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
    let mirror = if rng.random_bool(0.5) { -1.0 } else { 1.0 };
    let middle = 0.5 * (SIDE as f32 - 1.0);
    let places: Vec<[f32; 2]> = (0..AREA)
        .map(|i| {
            let [x, y] = [i % SIDE, i / SIDE].map(|k| k as f32 - middle);
            [mirror * (cos * x - sin * y) + middle, sin * x + cos * y + middle]
        })
        .collect();
    let inside = |at: &[f32; 2]| {
        let [x, y] = at.map(|k| k.round());
        let limit = SIDE as f32;
        (x >= 0.0 && y >= 0.0 && x < limit && y < limit) && pair.inside[y as usize * SIDE + x as usize]
    };
    Pair {
        photo: places.iter().map(|at| between(&pair.photo, at)).collect(),
        picture: places.iter().map(|at| between(&pair.picture, at)).collect(),
        inside: places.iter().map(inside).collect(),
    }
}

/// The colour between four pixels; `None` where the nearest has none.
pub fn between(colors: &[Option<[f32; 3]>], [x, y]: &[f32; 2]) -> Option<[f32; 3]> {
    let at = |x: f32, y: f32| {
        let is_inside = x >= 0.0 && y >= 0.0 && x < SIDE as f32 && y < SIDE as f32;
        if is_inside { colors[y as usize * SIDE + x as usize] } else { None }
    };
    let nearest = at(x.round(), y.round())?;
    let (left, top) = (x.floor(), y.floor());
    let (along, below) = (x - left, y - top);
    let corner = |dx: f32, dy: f32| at(left + dx, top + dy).unwrap_or(nearest);
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let weights = [(1.0 - along) * (1.0 - below), along * (1.0 - below), (1.0 - along) * below, along * below];
    Some(std::array::from_fn(|c| corners.iter().zip(weights).map(|(corner, weight)| weight * corner[c]).sum()))
}

/// Changes exposure, gamma and tint, and adds noise; `strength` scales the changes but not the noise.
fn in_other_light(colors: &[Option<[f32; 3]>], strength: f32, rng: &mut Pcg64Mcg) -> Vec<Option<[f32; 3]>> {
    let mut range = |most: f32| rng.random_range(-most..most) * strength;
    let (gain, gamma) = (range(EXPOSURE).exp(), range(GAMMA).exp());
    let tint = [range(TINT), range(TINT), range(TINT)].map(f32::exp);
    let noise = rng.random_range(0.0..NOISE);
    colors
        .iter()
        .map(|color| {
            color.map(|color| {
                let mut channel = 0;
                color.map(|value| {
                    let lit = (value.max(1e-3).powf(gamma) * gain * tint[channel]).min(1.0);
                    channel += 1;
                    // The sum of three uniform numbers is nearly normal, with a standard deviation of 1.
                    let normal: f32 = (0..3).map(|_| rng.random_range(-1.0f32..1.0)).sum();
                    lit + noise * normal
                })
            })
        })
        .collect()
}
