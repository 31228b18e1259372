//! Pairs of similar features, found by comparing all with all.
//!
//! A kd-tree does not help in 128 dimensions: a query visits nearly every leaf. The crate's README compares it with
//! this search; `examples/matching_bench.rs` measures the figures.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::features::Descriptor;
use crate::{DESCRIPTOR_LENGTH, Features};

/// Number of queries that are compared at a time.
const TILE: usize = 4;
/// Number of candidates that are compared at a time; the products with the queries fill half of the AVX2 registers.
const LANES: usize = 16;

/// A feature of one image and the most similar feature of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureMatch {
    /// Index in the first set of features.
    pub query_idx: usize,
    /// Index in the second set of features.
    pub train_idx: usize,
    /// Euclidean distance of the two descriptors, from 0 to √2.
    pub distance: f32,
    /// `distance` divided by the distance to the second nearest descriptor; 1 if both distances are 0.
    pub ratio: f32,
}

/// Matches each feature of `query` with the nearest feature of `train`, if it is nearer than `ratio` times the
/// second nearest.
///
/// Matches are in the order of `query`. Several queries may match the same feature of `train`. If `train` has fewer
/// than two features, there is no ratio, so there are no matches.
///
/// # Source
/// Lowe 2004, section 7.1, with a ratio of 0.8.
pub fn match_features(query: &Features, train: &Features, ratio: f32) -> Vec<FeatureMatch> {
    if train.len() < 2 {
        return Vec::new();
    }
    let arch = Arch::new();
    let panels = panels(&train.descriptors);
    let tiles: Vec<Vec<FeatureMatch>> = query
        .descriptors
        .par_chunks(TILE)
        .enumerate()
        .map(|(tile, queries)| {
            let nearest = arch.dispatch(NearestTwo { queries, panels: &panels, num_train: train.len() });
            let pairs = queries.iter().zip(nearest).enumerate();
            pairs
                .map(|(i, (descriptor, [first, second]))| {
                    let to = |train_idx: usize| distance(descriptor, &train.descriptors[train_idx]);
                    let (near, far) = (to(first), to(second));
                    FeatureMatch {
                        query_idx: tile * TILE + i,
                        train_idx: first,
                        distance: near,
                        // If both nearest descriptors equal the query's, the match is ambiguous, so its ratio is
                        // one.
                        ratio: if far > 0.0 { near / far } else { 1.0 },
                    }
                })
                .filter(|found| found.ratio < ratio)
                .collect()
        })
        .collect();
    tiles.into_iter().flatten().collect()
}

/// Euclidean distance of two descriptors.
pub(crate) fn distance(a: &Descriptor, b: &Descriptor) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}

/// Sixteen descriptors, transposed, so that no dot product needs a sum over the lanes of a register.
type Panel = [[f32; LANES]; DESCRIPTOR_LENGTH];

/// All descriptors in panels; the last panel is filled up with zeros.
fn panels(descriptors: &[Descriptor]) -> Vec<Panel> {
    let panel = |descriptors: &[Descriptor]| {
        let mut panel = [[0.0; LANES]; DESCRIPTOR_LENGTH];
        for (lane, descriptor) in descriptors.iter().enumerate() {
            for (row, &value) in panel.iter_mut().zip(descriptor) {
                row[lane] = value;
            }
        }
        panel
    };
    descriptors.chunks(LANES).map(panel).collect()
}

/// The indices of the two descriptors nearest to each query, nearest first. All are unit vectors, so the largest dot
/// product has the smallest distance.
struct NearestTwo<'a> {
    queries: &'a [Descriptor],
    panels: &'a [Panel],
    num_train: usize,
}

impl WithSimd for NearestTwo<'_> {
    type Output = Vec<[usize; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<[usize; 2]> {
        let last = self.queries.len() - 1;
        // A tile that is not full repeats its last query.
        let queries: [&Descriptor; TILE] = std::array::from_fn(|i| &self.queries[i.min(last)]);
        let mut best = [[(f32::MIN, 0usize); 2]; TILE];
        for (i, panel) in self.panels.iter().enumerate() {
            let first = i * LANES;
            let filled = LANES.min(self.num_train - first);
            for (best, products) in best.iter_mut().zip(products(queries, panel)) {
                for (lane, &product) in products[..filled].iter().enumerate() {
                    if product > best[1].0 {
                        let found = (product, first + lane);
                        *best = if product > best[0].0 { [found, best[0]] } else { [best[0], found] };
                    }
                }
            }
        }
        best[..self.queries.len()].iter().map(|best| best.map(|(_, train_idx)| train_idx)).collect()
    }
}

/// The dot products of each query with each descriptor of a panel.
#[inline(always)]
fn products(queries: [&Descriptor; TILE], panel: &Panel) -> [[f32; LANES]; TILE] {
    // Four variables for four arrays: as one array of arrays they would be kept in memory.
    let [mut a, mut b, mut c, mut d] = [[0.0f32; LANES]; TILE];
    for (k, row) in panel.iter().enumerate() {
        let [qa, qb, qc, qd] = queries.map(|query| query[k]);
        for lane in 0..LANES {
            a[lane] += qa * row[lane];
            b[lane] += qb * row[lane];
            c[lane] += qc * row[lane];
            d[lane] += qd * row[lane];
        }
    }
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;
    use sdg_geometry::Angle;

    use super::*;
    use crate::SiftKeypoint;

    /// Features whose descriptors are the given angles on a circle in the first two dimensions.
    fn features(angles: &[f32]) -> Features {
        let descriptor = |angle: &f32| {
            let mut made = [0.0; DESCRIPTOR_LENGTH];
            (made[0], made[1]) = (angle.cos(), angle.sin());
            made
        };
        let anywhere = SiftKeypoint { position: Point2::origin(), sigma: 1.0, angle: Angle::ZERO, contrast: 1.0 };
        Features { keypoints: vec![anywhere; angles.len()], descriptors: angles.iter().map(descriptor).collect() }
    }

    #[test]
    fn the_ratio_test_refuses_the_undecided() {
        // The first query is 0.1 rad from one descriptor and 0.9 rad from the other, the second halfway between them.
        let found = match_features(&features(&[0.1, 0.5]), &features(&[0.0, 1.0]), 0.8);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].query_idx, found[0].train_idx), (0, 0));
        let chord = |angle: f32| 2.0 * (angle / 2.0).sin();
        assert!((found[0].distance - chord(0.1)).abs() < 1e-6);
        assert!((found[0].ratio - chord(0.1) / chord(0.9)).abs() < 1e-5);
    }

    #[test]
    fn agrees_with_a_search_one_by_one() {
        let spread =
            |n: usize, step: f32| features(&(0..n).map(|i| (i as f32 * step).rem_euclid(1.5)).collect::<Vec<_>>());
        for (n, m) in [(1, 2), (4, 9), (7, 30), (33, 5)] {
            let (query, train) = (spread(n, 0.7301), spread(m, 0.3137));
            let found = match_features(&query, &train, 1.0);
            for found in found {
                let to = |i: usize| distance(&query.descriptors[found.query_idx], &train.descriptors[i]);
                let nearest = (0..m).map(to).fold(f32::MAX, f32::min);
                assert!(to(found.train_idx) <= nearest + 1e-5);
            }
        }
    }

    #[test]
    fn nothing_to_compare_is_no_match() {
        let (none, one, two) = (features(&[]), features(&[0.3]), features(&[0.3, 0.9]));
        assert_eq!(match_features(&none, &two, 0.8), []);
        assert_eq!(match_features(&two, &none, 0.8), []);
        assert_eq!(match_features(&two, &one, 0.8), []);
        // With two identical descriptors a match is ambiguous.
        assert_eq!(match_features(&one, &features(&[0.3, 0.3]), 0.8), []);
    }
}
