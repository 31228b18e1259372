//! The observations of a template's edge points in a picture: the gradient crests near each point along its normal.
//!
//! Points are stored in groups of [`LANES`], coordinate by coordinate, so that the fits ([`crate::consensus`]) process
//! a group at once. All sums are computed in the same order on every machine.

use pulp::{Simd, WithSimd};
use wide::f32x4;

use crate::edge_points::parabola_peak;
use crate::gradient_field::GradientLevel;
use crate::lanes::{LANES, in_lanes, larger};

/// Search distance of an edge point along its normal in the first round, in level pixels. Chosen by hand, not measured.
pub(crate) const FIRST_REACH: usize = 6;
/// Search distance in later rounds.
pub(crate) const LATER_REACH: usize = 3;
/// Maximum number of crests per point. Chosen by hand, not measured.
pub(crate) const MAX_CRESTS: usize = 3;
/// Minimum alignment of a crest's direction, which noise reduces. Chosen by hand, not measured.
const MIN_TRUST: f32 = 0.2;
/// Number of samples along a normal, with one beyond the search distance at both ends; derived.
const MAX_SAMPLES: usize = 2 * FIRST_REACH + 3;
const _: () = assert!(MAX_SAMPLES <= 2 * LANES, "two groups hold the samples of a normal");

/// An edge point laid over a level of the image, in its pixels.
pub(crate) struct EdgePlace<const N: usize> {
    pub(crate) at: [f32; 2],
    pub(crate) normal: [f32; 2],
    /// (cos 2φ, sin 2φ) of the normal.
    pub(crate) double: [f32; 2],
    /// How far the point moves along its normal for each coordinate of a pose.
    pub(crate) row: [f32; N],
    pub(crate) weight: f32,
}

/// A group of points; unused ones have no weight.
#[derive(Clone, Copy)]
pub(crate) struct Group<const N: usize> {
    pub(crate) rows: [[f32; LANES]; N],
    pub(crate) weights: [f32; LANES],
    /// Distance of each crest along the normal.
    pub(crate) distances: [[f32; LANES]; MAX_CRESTS],
    /// Trust in each crest: the alignment of its direction with the edge point's; 0 means no crest.
    pub(crate) trusts: [[f32; LANES]; MAX_CRESTS],
}

/// The points with a crest.
pub(crate) struct Sightings<const N: usize> {
    pub(crate) groups: Vec<Group<N>>,
}

impl<const N: usize> Sightings<N> {
    /// Samples along the normal at every place, up to `reach` pixels in both directions; beyond the border there are no
    /// crests.
    pub(crate) fn gather(level: &GradientLevel, places: &[EdgePlace<N>], reach: usize) -> Self {
        in_lanes(Gather { level, places, reach })
    }
}

struct Gather<'a, const N: usize> {
    level: &'a GradientLevel,
    places: &'a [EdgePlace<N>],
    reach: usize,
}

impl<const N: usize> WithSimd for Gather<'_, N> {
    type Output = Sightings<N>;

    /// Plain loops; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sightings<N> {
        let Self { level, places, reach } = self;
        let empty = Group {
            rows: [[0.0; LANES]; N],
            weights: [0.0; LANES],
            distances: [[0.0; LANES]; MAX_CRESTS],
            trusts: [[0.0; LANES]; MAX_CRESTS],
        };
        let mut groups: Vec<Group<N>> = Vec::with_capacity(places.len().div_ceil(LANES));
        let mut lane = LANES;
        for place in places {
            let samples = seen(level, place, reach);
            let Some(crests) = crests(&samples, level.floor(), place.double, reach) else { continue };
            if lane == LANES {
                groups.push(empty);
                lane = 0;
            }
            if let Some(group) = groups.last_mut() {
                for k in 0..N {
                    group.rows[k][lane] = place.row[k];
                }
                group.weights[lane] = place.weight;
                for (k, (distance, trust)) in crests.into_iter().enumerate() {
                    group.distances[k][lane] = distance;
                    group.trusts[k][lane] = trust;
                }
            }
            lane += 1;
        }
        Sightings { groups }
    }
}

const STEPS: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// The samples along a normal from one end to the other.
type Samples = [f32x4; 2 * LANES];

#[inline(always)]
fn seen<const N: usize>(level: &GradientLevel, place: &EdgePlace<N>, reach: usize) -> Samples {
    let middle = (reach + 1) as f32;
    let mut samples = [f32x4::ZERO; 2 * LANES];
    for (group, out) in samples.chunks_exact_mut(LANES).enumerate() {
        let first = (group * LANES) as f32 - middle;
        let t: [f32; LANES] = std::array::from_fn(|k| first + STEPS[k]);
        let count = (2 * reach + 3).saturating_sub(group * LANES).min(LANES);
        let [x, y] = [0, 1].map(|i| t.map(|t| place.at[i] + t * place.normal[i]));
        level.bilinear_all(&x, &y, &mut out[..count]);
    }
    samples
}

/// Distance and trust of the nearest crests of the gradient's component along the normal; `None` for no crest.
#[inline(always)]
fn crests(samples: &Samples, floor: f32, double: [f32; 2], reach: usize) -> Option<[(f32, f32); MAX_CRESTS]> {
    let len = 2 * reach + 3;
    let middle = (reach + 1) as f32;
    // The squared gradient has the same crests as the gradient, so square roots are computed only at crests.
    let mut squares = [0.0f32; 2 * LANES];
    let mut trusts = [0.0f32; 2 * LANES];
    for (k, sample) in samples.iter().enumerate() {
        let [dx, dy, energy, _] = sample.to_array();
        trusts[k] = larger(dx * double[0] + dy * double[1], 0.0);
        squares[k] = trusts[k] * (energy + floor);
    }
    // Most samples are not crests: all are compared at once, because single branches are often mispredicted.
    let mut is_crest = [0u32; 2 * LANES];
    for k in 1..2 * LANES - 1 {
        let is_highest = (squares[k] >= squares[k - 1]) & (squares[k] > squares[k + 1]);
        is_crest[k] = if is_highest & (trusts[k] >= MIN_TRUST) { 1 << k } else { 0 };
    }
    // The last sample and the unused places do not count as crests.
    let mut left = is_crest.into_iter().fold(0, |bits, bit| bits | bit) & ((1 << (len - 1)) - 1);
    let mut crests = [(0.0f32, 0.0f32); MAX_CRESTS];
    let mut count = 0;
    while left != 0 {
        let k = left.trailing_zeros() as usize;
        left &= left - 1;
        let [before, here, after] = [squares[k - 1], squares[k], squares[k + 1]].map(f32::sqrt);
        let crest = (k as f32 - middle + parabola_peak(before, here, after), trusts[k]);
        if count < MAX_CRESTS {
            crests[count] = crest;
            count += 1;
        } else if let Some(furthest) = crests.iter_mut().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
            && crest.0.abs() < furthest.0.abs()
        {
            *furthest = crest;
        }
    }
    (count > 0).then_some(crests)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GradientField;
    use image::{Rgb, RgbImage};

    #[test]
    fn samples_read_in_lanes_have_the_bits_of_those_read_one_by_one() {
        let image = RgbImage::from_fn(41, 37, |x, y| Rgb([(x * x + y) as u8, (3 * y * x) as u8, (x + 7 * y) as u8]));
        let field = GradientField::new(&image);
        let level = field.level(0);
        // Inside, near each border, on it and beyond.
        for (x, y) in (-4..=90).flat_map(|x| (-4..=82).map(move |y| (x as f32 * 0.4691, y as f32 * 0.4873))) {
            let mut samples = [f32x4::ZERO; LANES];
            let inside = level.bilinear_all(&[x; LANES], &[y; LANES], &mut samples);
            let expected = level.bilinear(x, y);
            assert_eq!(inside, [if expected.is_some() { 1.0 } else { 0.0 }; LANES], "{x}, {y}");
            let [dx, dy, energy] = expected.unwrap_or_default();
            assert!(samples.iter().all(|sample| sample.to_array()[..3] == [dx, dy, energy]), "{x}, {y}: {samples:?}");
        }
    }

    /// One sample after the other.
    fn crests_one_by_one(samples: &Samples, floor: f32, double: [f32; 2], reach: usize) -> Vec<(f32, f32)> {
        let trust = |k: usize| (samples[k].to_array()[0] * double[0] + samples[k].to_array()[1] * double[1]).max(0.0);
        let square = |k: usize| trust(k) * (samples[k].to_array()[2] + floor);
        let is_crest = |k: &usize| square(*k) >= square(k - 1) && square(*k) > square(k + 1) && trust(*k) >= MIN_TRUST;
        let place = |k: usize| {
            let [before, here, after] = [k - 1, k, k + 1].map(|k| square(k).sqrt());
            (k as f32 - (reach + 1) as f32 + parabola_peak(before, here, after), trust(k))
        };
        let mut all: Vec<(f32, f32)> = (1..2 * reach + 2).filter(is_crest).map(place).collect();
        // Of more than three crests, the nearest three are kept.
        all.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        all.truncate(MAX_CRESTS);
        all
    }

    #[test]
    fn crests_found_at_once_are_those_found_one_by_one() {
        let mut bits = 1u32;
        let mut random = move || {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (bits >> 8) as f32 / (1 << 24) as f32
        };
        let mut counts = [0; MAX_CRESTS + 1];
        for round in 0..2000 {
            let reach = if round % 2 == 0 { FIRST_REACH } else { LATER_REACH };
            let mut samples = [f32x4::ZERO; 2 * LANES];
            for sample in &mut samples[..2 * reach + 3] {
                // Equal neighbours occur, too.
                let energy = (4.0 * random()).floor();
                *sample = f32x4::new([random() - 0.3, random() - 0.5, energy, 0.0]);
            }
            let mut found: Vec<_> = crests(&samples, 0.5, [0.8, 0.6], reach).into_iter().flatten().collect();
            found.retain(|(_, trust)| *trust > 0.0);
            // Of two equally near crests, the earlier is first.
            found.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()).then(a.0.total_cmp(&b.0)));
            let expected = crests_one_by_one(&samples, 0.5, [0.8, 0.6], reach);
            assert_eq!(found, expected, "round {round}");
            counts[found.len()] += 1;
        }
        assert!(counts.iter().all(|count| *count > 10), "{counts:?}");
    }
}
