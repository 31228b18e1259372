//! The similarity with the most inliers among matches.
//!
//! Every match already gives the part's rotation and scale. A pair of matches is tried only if both agree with the
//! line between them, and a match counts only if it agrees in position, rotation and scale. The expected number of
//! false alarms, not a fixed count, decides whether the agreement exceeds chance.

use nalgebra::Point2;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{RngCore, SeedableRng};
use sdg_geometry::PlanarSimilarity;

use crate::{SiftError, SiftKeypoint};

/// Settings of the search for a similarity.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RansacConfig {
    /// Seed of the random pairs.
    pub seed: u64,
    /// Maximum number of random pairs of matches; if fewer pairs are possible, all are tried.
    pub max_draws: usize,
    /// Maximum distance between the predicted and the found position of a keypoint, in pixels; the found keypoint's σ
    /// if that is larger.
    pub tolerance_px: f64,
    /// Maximum difference between a match's rotation and the similarity's, in radians.
    pub max_turn_difference: f64,
    /// Maximum factor between a match's scale and the similarity's.
    pub max_scale_factor: f64,
    /// Minimum and maximum scale of the part relative to its template.
    pub scale_range: (f64, f64),
    /// Maximum expected number of equally good agreements by chance.
    pub max_false_alarms: f64,
}

impl Default for RansacConfig {
    fn default() -> Self {
        Self {
            seed: 0,
            max_draws: 4000,
            tolerance_px: 3.0,
            max_turn_difference: 25f64.to_radians(),
            max_scale_factor: 1.5,
            scale_range: (0.4, 2.5),
            max_false_alarms: 1e-3,
        }
    }
}

impl RansacConfig {
    /// Checks all settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub(crate) fn check(&self) -> Result<(), SiftError> {
        let refuse = |name, expected, found| Err(SiftError::BadSetting { name, expected, found });
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        if !is_positive(self.tolerance_px) {
            return refuse("tolerance_px", "above 0", self.tolerance_px);
        }
        if !is_positive(self.max_turn_difference) {
            return refuse("max_turn_difference", "above 0", self.max_turn_difference);
        }
        if !(self.max_scale_factor > 1.0 && self.max_scale_factor.is_finite()) {
            return refuse("max_scale_factor", "above 1", self.max_scale_factor);
        }
        if !is_positive(self.max_false_alarms) {
            return refuse("max_false_alarms", "above 0", self.max_false_alarms);
        }
        let (least, most) = self.scale_range;
        if !is_positive(least) {
            return refuse("scale_range.0", "above 0", least);
        }
        if !(most > least && most.is_finite()) {
            return refuse("scale_range.1", "above scale_range.0", most);
        }
        Ok(())
    }
}

/// A similarity and the matches that agree with it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimilarityFit {
    /// The pose of the template in the image, by least squares over the inliers.
    pub image_from_template: PlanarSimilarity,
    /// Indices of the matches that agree.
    pub inliers: Vec<usize>,
    /// The root mean square of the inliers' distances, in pixels.
    pub residual_px: f64,
    /// Decimal logarithm of the expected number of equally good agreements by chance.
    pub log10_false_alarms: f64,
}

/// Similar keypoints: one in the template, one in the image.
pub type KeypointPair = (SiftKeypoint, SiftKeypoint);

/// Finds the similarity; `None` if no more matches agree than are expected by chance.
///
/// `search_area` is the area that contains the image's keypoints, in square pixels.
///
/// # Source
/// Fischler and Bolles 1981 for the random pairs, Chum, Matas and Kittler 2003 for refining the best ones, Moisan and
/// Stival 2004 for the number of false alarms.
pub fn fit_similarity(pairs: &[KeypointPair], search_area: f64, config: &RansacConfig) -> Option<SimilarityFit> {
    let search = Search { pairs, config };
    let mut best: Option<Hypothesis> = None;
    let mut try_pair = |i: usize, j: usize| {
        let Some(drawn) = search.hypothesis(i, j) else { return };
        let mut candidate = search.evaluate(drawn);
        if best.as_ref().is_none_or(|best| candidate.cost < best.cost) {
            // Two close matches determine a similarity poorly; all matches that agree with it determine it well.
            for _ in 0..4 {
                let Some(refined) = search.least_squares(&candidate.inliers) else { break };
                let refined = search.evaluate(refined);
                if refined.cost >= candidate.cost {
                    break;
                }
                candidate = refined;
            }
            best = Some(candidate);
        }
    };

    let n = pairs.len();
    if n * n.saturating_sub(1) / 2 <= config.max_draws {
        for i in 0..n {
            (i + 1..n).for_each(|j| try_pair(i, j));
        }
    } else {
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
        let mut draw = |n: usize| ((u128::from(rng.next_u64()) * n as u128) >> 64) as usize;
        for _ in 0..config.max_draws {
            let (i, j) = (draw(n), draw(n - 1));
            try_pair(i, if j >= i { j + 1 } else { j });
        }
    }

    let best = best?;
    let image_from_template = search.least_squares(&best.inliers)?;
    let log10_false_alarms = search.log10_false_alarms(&best.inliers, search_area);
    if log10_false_alarms > config.max_false_alarms.log10() {
        return None;
    }
    let squares: f64 = best.inliers.iter().map(|&i| search.distance(&image_from_template, i).powi(2)).sum();
    let residual_px = (squares / best.inliers.len() as f64).sqrt();
    Some(SimilarityFit { image_from_template, inliers: best.inliers, residual_px, log10_false_alarms })
}

/// The matches that agree with a similarity, and the sum of all matches' squared distances, in tolerances and clipped
/// at one.
struct Hypothesis {
    inliers: Vec<usize>,
    cost: f64,
}

struct Search<'a> {
    pairs: &'a [KeypointPair],
    config: &'a RansacConfig,
}

impl Search<'_> {
    /// The similarity determined by two matches, if it is plausible.
    fn hypothesis(&self, i: usize, j: usize) -> Option<PlanarSimilarity> {
        let (from, to) = ([self.pairs[i].0, self.pairs[j].0], [self.pairs[i].1, self.pairs[j].1]);
        let drawn = PlanarSimilarity::fit(&from.map(|k| k.position), &to.map(|k| k.position))?;
        let (least, most) = self.config.scale_range;
        let plausible = (least..=most).contains(&drawn.scale) && [i, j].iter().all(|&k| self.poses_agree(&drawn, k));
        plausible.then_some(drawn)
    }

    fn evaluate(&self, pose: PlanarSimilarity) -> Hypothesis {
        let mut inliers = Vec::new();
        let mut cost = 0.0;
        for k in 0..self.pairs.len() {
            let distance = self.distance(&pose, k) / self.tolerance(k);
            if distance < 1.0 && self.poses_agree(&pose, k) {
                inliers.push(k);
                cost += distance * distance;
            } else {
                cost += 1.0;
            }
        }
        Hypothesis { inliers, cost }
    }

    fn least_squares(&self, inliers: &[usize]) -> Option<PlanarSimilarity> {
        let from: Vec<Point2<f64>> = inliers.iter().map(|&i| self.pairs[i].0.position).collect();
        let to: Vec<Point2<f64>> = inliers.iter().map(|&i| self.pairs[i].1.position).collect();
        let fitted = PlanarSimilarity::fit(&from, &to)?;
        let (least, most) = self.config.scale_range;
        (least..=most).contains(&fitted.scale).then_some(fitted)
    }

    /// Whether a match's own rotation and scale agree with the pose.
    fn poses_agree(&self, pose: &PlanarSimilarity, k: usize) -> bool {
        let (from, to) = &self.pairs[k];
        let factor = to.sigma / (from.sigma * pose.scale);
        (to.angle - from.angle).distance(pose.angle) <= self.config.max_turn_difference
            && factor.max(1.0 / factor) <= self.config.max_scale_factor
    }

    fn distance(&self, pose: &PlanarSimilarity, k: usize) -> f64 {
        let (from, to) = &self.pairs[k];
        (pose.apply(&from.position) - to.position).norm()
    }

    fn tolerance(&self, k: usize) -> f64 {
        self.config.tolerance_px.max(self.pairs[k].1.sigma)
    }

    /// Decimal logarithm of the number of subsets of this size times the probability that all matches of a subset
    /// agree by chance.
    fn log10_false_alarms(&self, inliers: &[usize], search_area: f64) -> f64 {
        // Matches of one keypoint with several directions, or of one blob at two scales, count once.
        let mut distinct: Vec<usize> = Vec::new();
        for &i in inliers {
            let apart = |&other: &usize| {
                let (a, b) = (&self.pairs[i], &self.pairs[other]);
                (a.0.position - b.0.position).norm() > 1.5 && (a.1.position - b.1.position).norm() > 1.5
            };
            if distinct.iter().all(apart) {
                distinct.push(i);
            }
        }
        let (n, k) = (self.pairs.len(), distinct.len());
        if k < 3 {
            return f64::INFINITY;
        }
        let turn = (self.config.max_turn_difference / std::f64::consts::PI).min(1.0);
        let (least, most) = self.config.scale_range;
        let scale = (2.0 * self.config.max_scale_factor.ln() / (most / least).ln()).min(1.0);
        let chance = |i: usize| {
            let area = std::f64::consts::PI * self.tolerance(i).powi(2);
            (area / search_area.max(area) * turn * scale).log10()
        };
        let log10_choose = |n: usize, k: usize| (0..k).map(|i| ((n - i) as f64 / (i + 1) as f64).log10()).sum::<f64>();
        // Two of the matches determined the pose, so their agreement in position carries no information.
        let surprising: f64 = distinct[2..].iter().map(|&i| chance(i)).sum();
        (n as f64 - 2.0).log10() + log10_choose(n, k) + log10_choose(k, 2) + surprising
    }
}

#[cfg(test)]
mod tests {
    use sdg_geometry::Angle;

    use super::*;

    fn keypoint(x: f64, y: f64, sigma: f64, degrees: f64) -> SiftKeypoint {
        SiftKeypoint { position: Point2::new(x, y), sigma, angle: Angle::from_degrees(degrees), contrast: 0.1 }
    }

    /// `right` correct matches under `pose`, each with an error of up to half a pixel, and `wrong` ones at random
    /// positions.
    fn pairs(pose: &PlanarSimilarity, right: usize, wrong: usize, seed: u64) -> Vec<KeypointPair> {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut uniform = |low: f64, high: f64| low + (high - low) * (rng.next_u64() as f64 / u64::MAX as f64);
        let mut made = Vec::new();
        for i in 0..right + wrong {
            let from = keypoint(uniform(0.0, 100.0), uniform(0.0, 100.0), uniform(1.0, 2.0), uniform(-180.0, 180.0));
            let to = if i < right {
                let moved = pose.apply(&from.position);
                let (x, y) = (moved.x + uniform(-0.5, 0.5), moved.y + uniform(-0.5, 0.5));
                let turned = from.angle.degrees() + pose.angle.degrees() + uniform(-8.0, 8.0);
                keypoint(x, y, from.sigma * pose.scale * uniform(0.9, 1.1), turned)
            } else {
                keypoint(uniform(0.0, 640.0), uniform(0.0, 480.0), uniform(1.0, 2.0), uniform(-180.0, 180.0))
            };
            made.push((from, to));
        }
        made
    }

    const IMAGE_AREA: f64 = 640.0 * 480.0;

    #[test]
    fn the_pose_stands_out_of_nine_wrong_in_ten() {
        let pose = PlanarSimilarity { scale: 1.3, angle: Angle::from_degrees(150.0), tx: 300.0, ty: 200.0 };
        let fit = fit_similarity(&pairs(&pose, 20, 180, 1), IMAGE_AREA, &RansacConfig::default()).unwrap();
        assert!(fit.inliers.len() >= 20 && fit.inliers.iter().filter(|&&i| i >= 20).count() <= 1);
        assert!(fit.image_from_template.angle.distance(pose.angle).to_degrees() < 0.5);
        assert!((fit.image_from_template.scale / pose.scale - 1.0).abs() < 0.01);
        assert!(fit.residual_px < 0.6 && fit.log10_false_alarms < -20.0);
    }

    #[test]
    fn chance_is_not_mistaken_for_a_pose() {
        let nowhere = PlanarSimilarity::IDENTITY;
        for seed in 0..30 {
            for wrong in [3, 10, 40, 150] {
                let found = fit_similarity(&pairs(&nowhere, 0, wrong, seed), IMAGE_AREA, &RansacConfig::default());
                assert_eq!(found, None, "seed {seed}, {wrong} matches");
            }
        }
    }

    #[test]
    fn one_place_seen_many_times_is_one_witness() {
        let all_alike = vec![(keypoint(10.0, 10.0, 2.0, 0.0), keypoint(50.0, 50.0, 2.0, 30.0)); 40];
        assert_eq!(fit_similarity(&all_alike, IMAGE_AREA, &RansacConfig::default()), None);
    }

    #[test]
    fn the_same_seed_gives_the_same_pose() {
        let pose = PlanarSimilarity { scale: 0.8, angle: Angle::from_degrees(-40.0), tx: 100.0, ty: 100.0 };
        let pairs = pairs(&pose, 30, 300, 5);
        let fit = |seed| fit_similarity(&pairs, IMAGE_AREA, &RansacConfig { seed, ..RansacConfig::default() });
        assert_eq!(fit(3), fit(3));
        assert_eq!(fit_similarity(&[], IMAGE_AREA, &RansacConfig::default()), None);
    }
}
