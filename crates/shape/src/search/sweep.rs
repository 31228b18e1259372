//! Tries all poses of a bank at all places of an image.
//!
//! ```text
//! tables ─ per stretch of places, per variant: add a shifted table row per point ─ best variant of each place and group
//!        ─ local maxima ─ starts, the best of each scale in turn
//! ```
//! A group is one scale within a range of angles of 90°, and a place keeps the best variant of each group. A part that
//! is similar after a rotation by 180° therefore keeps both angles, and the finer levels decide. A part in clutter or
//! noise keeps all scales: there the smallest scale agrees best almost everywhere because its points are closest
//! together.

use pulp::{Simd, WithSimd};

use crate::lanes::in_lanes;
use crate::parallel;
use crate::search::bank::Bank;
use crate::search::responses::{BLOCK, FULL, Responses};

/// Places that one thread takes at a time, in blocks of [`BLOCK`]. Chosen to save time; it does not change results.
const STRETCH: usize = 1024;
/// Reads summed in bytes before they are carried into 16 bits. Derived.
const READS_PER_BYTE: usize = 255 / FULL as usize;
/// Number of ranges of angles, each with its own best variant of every scale. Two would be enough for parts that are
/// similar after 180°; four were chosen by hand, not measured.
const NUM_SECTORS: usize = 4;
/// A start is the maximum within this many places. Chosen by hand, not measured.
const PEAK_RADIUS: usize = 2;

/// A place, a variant, and their agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// Column and row of the place.
    pub(crate) place: [usize; 2],
    pub(crate) variant_idx: usize,
    /// Share of the largest possible sum, in `[0, 1]`.
    pub(crate) response: f64,
}

/// The `count` best local maxima, none below `min_response`: first the best of each scale, then the second of each.
/// With an area, only its places are tried.
pub(crate) fn sweep(
    responses: &Responses,
    bank: &Bank,
    area: Option<&Area>,
    count: usize,
    min_response: f64,
) -> Vec<Start> {
    let (width, height) = (responses.width, responses.height);
    if width == 0 || height == 0 || bank.num_points == 0 {
        return Vec::new();
    }
    let first = responses.idx_of(0, 0);
    let end = responses.idx_of(width - 1, height - 1) + 1;
    let shifts: Vec<Vec<(usize, isize)>> = bank.variants.iter().map(|v| v.shifts(responses.stride())).collect();
    let groups = Groups::of(bank);
    let stretches: Vec<usize> = (first..end).step_by(STRETCH).collect();
    let swept = parallel::map(&stretches, |&at| {
        let blocks: Vec<usize> =
            (at..end.min(at + STRETCH)).step_by(BLOCK).filter(|&at| Area::has(area, at - first)).collect();
        in_lanes(SweepStretch { responses, shifts: &shifts, groups: &groups, at, blocks: &blocks })
    });

    let full = f64::from(FULL) * bank.num_points as f64;
    let least = (min_response * full).ceil() as i16;
    let of_groups: Vec<usize> = (0..groups.count).collect();
    let mut starts = parallel::map(&of_groups, |&group| {
        let field = PeakField::new(responses, |offset| swept[offset / STRETCH].sums_from(group, offset % STRETCH));
        let start = |(place, sum): ([usize; 2], i16)| {
            let offset = responses.idx_of(place[0], place[1]) - first;
            Start {
                place,
                variant_idx: usize::from(swept[offset / STRETCH].variants[group][offset % STRETCH]),
                response: f64::from(sum) / full,
            }
        };
        field.peaks(least).map(start).collect::<Vec<_>>()
    })
    .concat();
    // Stable sorts keep equal ones in the order of groups and rows, independent of the threads.
    starts.sort_by(|a, b| b.response.total_cmp(&a.response));
    let mut of_scale = vec![0; bank.num_scales];
    let with_rank = |start: Start| {
        let rank: &mut usize = &mut of_scale[start.variant_idx % bank.num_scales];
        *rank += 1;
        (*rank, start)
    };
    let mut ranked: Vec<(usize, Start)> = starts.into_iter().map(with_rank).collect();
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.truncate(count);
    ranked.into_iter().map(|(_, start)| start).collect()
}

/// A part of the places, in blocks of [`BLOCK`] adjacent places.
#[derive(Debug)]
pub(crate) struct Area {
    blocks: Vec<bool>,
}

impl Area {
    pub(crate) fn none_of(responses: &Responses) -> Self {
        let len = responses.height * responses.stride();
        Self { blocks: vec![false; len.div_ceil(BLOCK)] }
    }

    /// Adds the blocks with places at most `radius` columns and rows from `center`.
    pub(crate) fn add(&mut self, responses: &Responses, center: [usize; 2], radius: usize) {
        let near = |at: usize, end: usize| at.saturating_sub(radius)..(at + radius + 1).min(end);
        let first = responses.idx_of(0, 0);
        let columns = near(center[0], responses.width);
        for y in near(center[1], responses.height).filter(|_| !columns.is_empty()) {
            let [from, to] = [columns.start, columns.end - 1].map(|x| (responses.idx_of(x, y) - first) / BLOCK);
            self.blocks[from..=to].fill(true);
        }
    }

    /// The share of the blocks that belong to the area.
    #[cfg(test)]
    pub(crate) fn share(&self) -> f64 {
        self.blocks.iter().filter(|&&is_swept| is_swept).count() as f64 / self.blocks.len() as f64
    }

    /// Whether the block that begins at an offset belongs to the area; without an area, every block does.
    fn has(area: Option<&Self>, offset: usize) -> bool {
        area.is_none_or(|area| area.blocks[offset / BLOCK])
    }
}

/// The variants that compete with each other at a place.
struct Groups {
    count: usize,
    /// The group of every variant.
    idxs: Vec<usize>,
}

impl Groups {
    fn of(bank: &Bank) -> Self {
        let (num_variants, num_scales) = (bank.variants.len(), bank.num_scales);
        let group = |idx: usize| idx * NUM_SECTORS / num_variants * num_scales + idx % num_scales;
        Self { count: NUM_SECTORS * num_scales, idxs: (0..num_variants).map(group).collect() }
    }
}

/// The sums of one group at all places, with a border of lowest values.
struct PeakField {
    width: usize,
    height: usize,
    sums: Vec<i16>,
}

impl PeakField {
    /// `sums_from` returns the sums from an offset on, relative to the first place; none in a stretch that is not
    /// swept.
    fn new<'a>(responses: &Responses, sums_from: impl Fn(usize) -> &'a [i16]) -> Self {
        let (width, height) = (responses.width, responses.height);
        let stride = width + 2 * PEAK_RADIUS;
        let mut sums = vec![-1; stride * (height + 2 * PEAK_RADIUS)];
        let first = responses.idx_of(0, 0);
        for (y, row) in sums.chunks_exact_mut(stride).skip(PEAK_RADIUS).take(height).enumerate() {
            let mut at = responses.idx_of(0, y) - first;
            let mut left = &mut row[PEAK_RADIUS..][..width];
            while !left.is_empty() {
                let some = sums_from(at);
                let len = if some.is_empty() { STRETCH - at % STRETCH } else { some.len() };
                let (now, later) = left.split_at_mut(len.min(left.len()));
                if !some.is_empty() {
                    now.copy_from_slice(&some[..now.len()]);
                }
                at += now.len();
                left = later;
            }
        }
        Self { width, height, sums }
    }

    /// Places, row by row, whose sum is at least `least` and the maximum within [`PEAK_RADIUS`].
    fn peaks(&self, least: i16) -> impl Iterator<Item = ([usize; 2], i16)> {
        let stride = self.width + 2 * PEAK_RADIUS;
        let rows = self.sums.chunks_exact(stride).skip(PEAK_RADIUS).take(self.height).enumerate();
        rows.flat_map(move |(y, row)| {
            let places = row[PEAK_RADIUS..][..self.width].iter().enumerate();
            places.filter_map(move |(x, &here)| (here >= least && self.is_peak(x, y, here)).then_some(([x, y], here)))
        })
    }

    fn is_peak(&self, x: usize, y: usize, here: i16) -> bool {
        let side = 2 * PEAK_RADIUS + 1;
        let row = |dy: usize| &self.sums[(y + dy) * (self.width + 2 * PEAK_RADIUS) + x..][..side];
        let is_before = |dy: usize, dx: usize| (dy, dx) < (PEAK_RADIUS, PEAK_RADIUS);
        // Of equal neighbours the first is kept.
        let is_beaten = |dy: usize, dx: usize, there: i16| there > here || (there == here && is_before(dy, dx));
        !(0..side).any(|dy| row(dy).iter().enumerate().any(|(dx, &there)| is_beaten(dy, dx, there)))
    }
}

/// The best sum at each place of a stretch and its variant, per group; empty if no place of the stretch is swept.
struct Swept {
    sums: Vec<Vec<i16>>,
    variants: Vec<Vec<u16>>,
}

impl Swept {
    fn sums_from(&self, group: usize, offset: usize) -> &[i16] {
        self.sums.get(group).map_or(&[], |sums| &sums[offset..])
    }
}

/// All variants at the places from `at` on, in the blocks that begin at `blocks`.
struct SweepStretch<'a> {
    responses: &'a Responses,
    shifts: &'a [Vec<(usize, isize)>],
    groups: &'a Groups,
    at: usize,
    blocks: &'a [usize],
}

impl WithSimd for SweepStretch<'_> {
    type Output = Swept;

    /// Plain loops over blocks that stay in registers; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Swept {
        let Self { responses, shifts, groups, at, blocks } = self;
        let num_groups = if blocks.is_empty() { 0 } else { groups.count };
        let mut swept =
            Swept { sums: vec![vec![-1; STRETCH]; num_groups], variants: vec![vec![0; STRETCH]; num_groups] };
        // Neighbouring variants read nearly the same bytes; block by block, these bytes stay in the first-level cache.
        for &block in blocks {
            let (start, from) = (block - at, block as isize);
            for (variant_idx, looks) in shifts.iter().enumerate() {
                let mut sums = [0i16; BLOCK];
                for some in looks.chunks(READS_PER_BYTE) {
                    let mut bytes = [0u8; BLOCK];
                    for &(table, shift) in some {
                        let row = &responses.table(table)[(from + shift) as usize..][..BLOCK];
                        for (sum, &value) in bytes.iter_mut().zip(row) {
                            *sum = sum.wrapping_add(value);
                        }
                    }
                    for (sum, &byte) in sums.iter_mut().zip(&bytes) {
                        *sum += i16::from(byte);
                    }
                }
                let group = groups.idxs[variant_idx];
                let best = &mut swept.sums[group][start..][..BLOCK];
                let variants = &mut swept.variants[group][start..][..BLOCK];
                for ((best, variant), &sum) in best.iter_mut().zip(variants).zip(&sums) {
                    let is_better = sum > *best;
                    *best = if is_better { sum } else { *best };
                    *variant = if is_better { variant_idx as u16 } else { *variant };
                }
            }
        }
        swept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GradientField;
    use crate::edge_points::EdgePoint;
    use image::{Rgb, RgbImage};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn noise(rng: &mut Pcg64Mcg) -> GradientField {
        GradientField::new(&RgbImage::from_fn(70, 52, |_, _| Rgb([0; 3].map(|_| rng.random_range(0..=255u8)))))
    }

    fn random_bank(rng: &mut Pcg64Mcg) -> Bank {
        let points: Vec<EdgePoint> = (0..30)
            .map(|_| {
                let (sin, cos) = rng.random_range(0.0..6.3f32).sin_cos();
                EdgePoint {
                    offset: [rng.random_range(-12.0..12.0), rng.random_range(-8.0..8.0)],
                    normal: [cos, sin],
                    double: [cos * cos - sin * sin, 2.0 * cos * sin],
                    weight: 1.0 / 30.0,
                }
            })
            .collect();
        Bank::new(&points, 64, 1.0, [-0.1, 0.1])
    }

    /// One read at a time, with a border case.
    fn naive(responses: &Responses, bank: &Bank, x: usize, y: usize, variant_idx: usize) -> u32 {
        // Rows this far apart make a shift's x and y distinguishable.
        const APART: isize = 1000;
        bank.variants[variant_idx]
            .shifts(APART as usize)
            .into_iter()
            .map(|(table, shift)| {
                let dy = (shift + APART / 2).div_euclid(APART);
                let (x, y) = (x as isize + shift - dy * APART, y as isize + dy);
                let is_inside = x >= 0 && y >= 0 && x < responses.width as isize && y < responses.height as isize;
                if is_inside { u32::from(responses.table(table)[responses.idx_of(x as usize, y as usize)]) } else { 0 }
            })
            .sum()
    }

    #[test]
    fn finds_what_looking_one_by_one_finds() {
        let rng = &mut Pcg64Mcg::seed_from_u64(4);
        let (field, bank) = (noise(rng), random_bank(rng));
        let responses = Responses::new(field.level(0), bank.reach);
        let starts = sweep(&responses, &bank, None, 1000, 0.0);
        let full = f64::from(FULL) * bank.num_points as f64;
        let groups = Groups::of(&bank);
        assert!(bank.num_scales > 1, "one scale tells no groups apart");
        for start in &starts {
            let [x, y] = start.place;
            let here = |idx: usize| naive(&responses, &bank, x, y, idx);
            let best = (0..bank.variants.len())
                .filter(|&idx| groups.idxs[idx] == groups.idxs[start.variant_idx])
                .map(here)
                .max();
            assert_eq!(Some((start.response * full).round() as u32), best);
            assert_eq!(Some(here(start.variant_idx)), best);
        }
        let best_anywhere = (0..35 * 26)
            .flat_map(|at| (0..bank.variants.len()).map(move |idx| (at % 35, at / 35, idx)))
            .map(|(x, y, idx)| naive(&responses, &bank, x, y, idx))
            .max();
        assert_eq!(Some((starts[0].response * full).round() as u32), best_anywhere);
    }
}
