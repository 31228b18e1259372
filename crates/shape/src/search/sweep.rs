//! All poses of a bank tried at all places of an image.
//!
//! ```text
//! tables ─ per stretch of places, per variant: add a shifted table row per point ─ best variant of each place and sector
//!        ─ local maxima ─ starts, the best first
//! ```
//! A place keeps its best variant for each quarter of the turn, so that a part which looks much the same turned by
//! half a turn keeps both for the finer levels to decide.

use pulp::{Arch, Simd, WithSimd};

use crate::parallel;
use crate::search::bank::Bank;
use crate::search::responses::{BLOCK, FULL, Responses};

/// Places that one thread takes at a time, in blocks of [`BLOCK`]. Chosen for time; results do not depend on it.
const STRETCH: usize = 1024;
/// Looks added up in bytes before they are carried over into 16 bits. Derived.
const LOOKS_PER_BYTE: usize = 255 / FULL as usize;
/// Parts of the turn that each keep their own best. Two would be enough for half a turn; four were chosen by hand, not
/// measured.
const NUM_SECTORS: usize = 4;
/// A start is the best within this many places. Chosen by hand, not measured.
const PEAK_RADIUS: isize = 2;

/// A place, a variant, and how well they agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// Column and row of the place.
    pub(crate) place: [usize; 2],
    pub(crate) variant_idx: usize,
    /// Share of the most that can be had, in `[0, 1]`.
    pub(crate) response: f64,
}

/// The best `count` local maxima, best first, none below `least_response`.
pub(crate) fn sweep(responses: &Responses, bank: &Bank, count: usize, least_response: f64) -> Vec<Start> {
    let (width, height) = (responses.width, responses.height);
    if width == 0 || height == 0 || bank.num_points == 0 {
        return Vec::new();
    }
    let first = responses.idx_of(0, 0);
    let end = responses.idx_of(width - 1, height - 1) + 1;
    let shifts: Vec<Vec<(usize, isize)>> = bank.variants.iter().map(|v| v.shifts(responses.stride())).collect();
    let stretches: Vec<usize> = (first..end).step_by(STRETCH).collect();
    let arch = Arch::new();
    let swept = parallel::map(&stretches, |&at| {
        arch.dispatch(SweepStretch { responses, shifts: &shifts, at, len: STRETCH.min(end - at) })
    });

    let full = f64::from(FULL) * bank.num_points as f64;
    let least = (least_response * full).ceil() as i16;
    let mut starts: Vec<Start> = Vec::new();
    for sector in 0..NUM_SECTORS {
        let best = |x: isize, y: isize| -> i16 {
            if x < 0 || y < 0 || x >= width as isize || y >= height as isize {
                return -1;
            }
            let offset = responses.idx_of(x as usize, y as usize) - first;
            swept[offset / STRETCH].sums[sector][offset % STRETCH]
        };
        for y in 0..height as isize {
            for x in 0..width as isize {
                let here = best(x, y);
                if here >= least && is_peak(&best, x, y, here) {
                    let offset = responses.idx_of(x as usize, y as usize) - first;
                    starts.push(Start {
                        place: [x as usize, y as usize],
                        variant_idx: usize::from(swept[offset / STRETCH].variants[sector][offset % STRETCH]),
                        response: f64::from(here) / full,
                    });
                }
            }
        }
    }
    // A stable sort: equal ones stay in the order of sectors and rows, whatever the threads did.
    starts.sort_by(|a, b| b.response.total_cmp(&a.response));
    starts.truncate(count);
    starts
}

fn is_peak(best: &impl Fn(isize, isize) -> i16, x: isize, y: isize, here: i16) -> bool {
    for dy in -PEAK_RADIUS..=PEAK_RADIUS {
        for dx in -PEAK_RADIUS..=PEAK_RADIUS {
            let there = best(x + dx, y + dy);
            // Of equal neighbours the first is kept.
            if there > here || (there == here && (dy, dx) < (0, 0)) {
                return false;
            }
        }
    }
    true
}

/// The best of each place of a stretch, per sector.
struct Swept {
    sums: [Vec<i16>; NUM_SECTORS],
    variants: [Vec<u16>; NUM_SECTORS],
}

/// All variants at the places from `at` on.
struct SweepStretch<'a> {
    responses: &'a Responses,
    shifts: &'a [Vec<(usize, isize)>],
    at: usize,
    len: usize,
}

impl WithSimd for SweepStretch<'_> {
    type Output = Swept;

    /// Plain loops over blocks that stay in registers; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Swept {
        let Self { responses, shifts, at, len } = self;
        let mut swept = Swept {
            sums: [(); NUM_SECTORS].map(|()| vec![-1; len.next_multiple_of(BLOCK)]),
            variants: [(); NUM_SECTORS].map(|()| vec![0; len.next_multiple_of(BLOCK)]),
        };
        // Neighbouring variants look at nearly the same bytes: block by block, those stay in the first-level cache.
        for start in (0..len).step_by(BLOCK) {
            let from = (at + start) as isize;
            for (variant_idx, looks) in shifts.iter().enumerate() {
                let mut sums = [0i16; BLOCK];
                for some in looks.chunks(LOOKS_PER_BYTE) {
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
                let sector = variant_idx * NUM_SECTORS / shifts.len();
                let best = &mut swept.sums[sector][start..][..BLOCK];
                let variants = &mut swept.variants[sector][start..][..BLOCK];
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

    /// One look at a time, with a case for the border.
    fn naive(responses: &Responses, bank: &Bank, x: usize, y: usize, variant_idx: usize) -> u32 {
        // Rows this far apart tell a shift's x and y.
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
        let starts = sweep(&responses, &bank, 1000, 0.0);
        let full = f64::from(FULL) * bank.num_points as f64;
        let in_sector = |idx: usize| idx * NUM_SECTORS / bank.variants.len();
        for start in &starts {
            let [x, y] = start.place;
            let here = |idx: usize| naive(&responses, &bank, x, y, idx);
            let best =
                (0..bank.variants.len()).filter(|&idx| in_sector(idx) == in_sector(start.variant_idx)).map(here).max();
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
