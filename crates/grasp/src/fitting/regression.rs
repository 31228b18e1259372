//! The score's weights, by logistic regression.
//!
//! Only the best correct pose of an instance and the best wrong pose of a picture count, as in the loss. Therefore the
//! regression is repeated, each time on the poses that the previous weights rank first. Instances, pictures and parts
//! have the same weights as in the loss of [`crate::fitting`].
//!
//! Legend: `x` the values of a pose's terms, clamped to their ranges; `w` the weights, the bias last; `y` 1 for
//! correct.

use nalgebra::{SMatrix, SVector};
use sdg_geometry::upper_median;
use sdg_shape::Evidence;

use super::loss::COST_OF_WRONG;
use super::observation::{PartObservations, PictureObservations};
use crate::check_config::{ScoreConfig, Term};
use crate::verdict::{judge_picture, rivals_gain};

/// Number of fitted terms: all except the network's, which is not used here.
const NUM_TERMS: usize = 14;
/// Weights and bias.
type Weights = SVector<f64, { NUM_TERMS + 1 }>;

/// Rounds of choosing poses and fitting; each round but the last moves the weights half-way, to avoid oscillation
/// between two choices.
const NUM_ROUNDS: usize = 16;
/// Newton steps of one regression.
const NUM_STEPS: usize = 12;
/// Ridge penalty, for terms of standard deviation 1: keeps the weight of a term without information finite. Chosen by
/// hand.
const RIDGE: f64 = 2e-4;
/// Minimum fraction of instances with a correct pose among the found poses. Parts with less, which are nearly
/// symmetric, carry no information about the score.
const MIN_COVERAGE: f64 = 0.6;

/// A pose used for the regression.
struct Example {
    x: SVector<f64, NUM_TERMS>,
    is_right: bool,
    weight: f64,
}

/// The weights that fit `parts` best, starting from `from`, whose ranges are kept; `from` itself if there are not both
/// correct and wrong poses.
pub(super) fn fit_score(parts: &[PartObservations], from: &ScoreConfig) -> ScoreConfig {
    let parts: Vec<&PartObservations> = parts.iter().filter(|part| part.coverage() >= MIN_COVERAGE).collect();
    let mut config = *from;
    for round in 0..NUM_ROUNDS {
        let examples = examples(&parts, &config);
        if examples.iter().all(|example| example.is_right) || !examples.iter().any(|example| example.is_right) {
            return *from;
        }
        let fitted = regression(&examples);
        let present = weights_of(&config);
        let next = if round + 1 == NUM_ROUNDS { fitted } else { 0.5 * (present + fitted) };
        config = with_weights(&config, &next);
    }
    neutral_in_the_middle(&parts, &config)
}

/// The best correct pose of each instance, and the best wrong pose of each picture.
fn examples(parts: &[&PartObservations], config: &ScoreConfig) -> Vec<Example> {
    let mut examples = Vec::new();
    for part in parts {
        let num_instances: usize = part.pictures.iter().map(|picture| picture.num_instances).sum();
        let of_right = 1.0 / (num_instances as f64).max(1.0);
        let of_wrong = COST_OF_WRONG / part.pictures.len() as f64;
        for picture in &part.pictures {
            let values = values(picture, config);
            let scores: Vec<f64> =
                judge_picture(&picture.clues(), config).into_iter().map(|(score, _)| score).collect();
            let best = |instance_idx: Option<usize>| {
                let of_it = (0..scores.len()).filter(|&i| picture.poses[i].instance_idx == instance_idx);
                of_it.max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
            };
            for instance_idx in (0..picture.num_instances).map(Some).chain([None]) {
                if let Some(i) = best(instance_idx) {
                    let is_right = instance_idx.is_some();
                    let weight = if is_right { of_right } else { of_wrong };
                    examples.push(Example { x: values[i], is_right, weight });
                }
            }
        }
    }
    examples
}

/// The terms' values of every pose of a picture.
fn values(picture: &PictureObservations, config: &ScoreConfig) -> Vec<SVector<f64, NUM_TERMS>> {
    let clues = picture.clues();
    // A pose's squared size difference follows from its contribution.
    let judged = judge_picture(&clues, config);
    clues
        .iter()
        .zip(judged)
        .map(|(clues, (_, contributions))| {
            let Evidence { edges, surface, hue_shift, visible, outside, close } = clues.evidence;
            let off_size = if config.size.weight == 0.0 { 0.0 } else { contributions.size / config.size.weight };
            let surface = surface.unwrap_or(config.surface.neutral);
            let (resemblance, likeness) = (clues.resemblance, close.map_or(f64::NEG_INFINITY, |close| close.likeness));
            let details = close.and_then(|close| close.details);
            let [details, details_for] =
                [config.details, config.details_for].map(|term| details.unwrap_or(term.neutral));
            let closely = close.map_or([0.0; 4], |close| {
                [close.bare, close.no_rim, close.added, close.mirrored.map_or(0.0, rivals_gain)]
            });
            let [bare, no_rim, added, mirrored] = closely;
            let raw = [
                edges,
                surface,
                hue_shift,
                visible,
                off_size,
                outside,
                resemblance,
                likeness,
                details,
                details_for,
                bare,
                no_rim,
                added,
                mirrored,
            ];
            let terms = terms(config);
            SVector::from_fn(|k, _| raw[k].clamp(terms[k].range[0], terms[k].range[1]))
        })
        .collect()
}

/// The fitted terms, in the order of [`values`].
fn terms(config: &ScoreConfig) -> [Term; NUM_TERMS] {
    let ScoreConfig { edges, surface, hue, visible, size, outside, resemblance, likeness, details, .. } = *config;
    let ScoreConfig { details_for, table, rim, added, mirror, .. } = *config;
    [
        edges,
        surface,
        hue,
        visible,
        size,
        outside,
        resemblance,
        likeness,
        details,
        details_for,
        table,
        rim,
        added,
        mirror,
    ]
}

fn terms_mut(config: &mut ScoreConfig) -> [&mut Term; NUM_TERMS] {
    let ScoreConfig {
        edges,
        surface,
        hue,
        visible,
        size,
        outside,
        resemblance,
        likeness,
        details,
        details_for,
        table,
        rim,
        added,
        mirror,
        ..
    } = config;
    [
        edges,
        surface,
        hue,
        visible,
        size,
        outside,
        resemblance,
        likeness,
        details,
        details_for,
        table,
        rim,
        added,
        mirror,
    ]
}

/// Weights, and the bias for neutral values of 0.
fn weights_of(config: &ScoreConfig) -> Weights {
    let terms = terms(config);
    let offset: f64 = terms.iter().map(|term| term.weight * term.neutral).sum();
    Weights::from_fn(|k, _| if k < NUM_TERMS { terms[k].weight } else { config.bias - offset })
}

fn with_weights(config: &ScoreConfig, weights: &Weights) -> ScoreConfig {
    let mut made = *config;
    let mut offset = 0.0;
    for (k, term) in terms_mut(&mut made).into_iter().enumerate() {
        term.weight = weights[k];
        offset += term.weight * term.neutral;
    }
    made.bias = weights[NUM_TERMS] + offset;
    made
}

/// Weighted logistic regression by Newton's method, on standardised values.
fn regression(examples: &[Example]) -> Weights {
    let total: f64 = examples.iter().map(|example| example.weight).sum();
    let mean = examples.iter().map(|example| example.x * example.weight).sum::<SVector<f64, NUM_TERMS>>() / total;
    let variance = examples
        .iter()
        .map(|example| (example.x - mean).component_mul(&(example.x - mean)) * example.weight)
        .sum::<SVector<f64, NUM_TERMS>>()
        / total;
    let deviation = variance.map(|v| v.sqrt().max(1e-9));
    let standardised = |x: &SVector<f64, NUM_TERMS>| {
        Weights::from_fn(|k, _| if k < NUM_TERMS { (x[k] - mean[k]) / deviation[k] } else { 1.0 })
    };
    let mut w = Weights::zeros();
    for _ in 0..NUM_STEPS {
        let mut gradient = Weights::zeros();
        let mut hessian = SMatrix::<f64, { NUM_TERMS + 1 }, { NUM_TERMS + 1 }>::identity() * 1e-9;
        for k in 0..NUM_TERMS {
            gradient[k] += 2.0 * RIDGE * w[k];
            hessian[(k, k)] += 2.0 * RIDGE;
        }
        for example in examples {
            let z = standardised(&example.x);
            let p = 1.0 / (1.0 + (-w.dot(&z)).exp());
            let y = f64::from(u8::from(example.is_right));
            let share = example.weight / total;
            gradient += z * (share * (p - y));
            hessian += z * z.transpose() * (share * p * (1.0 - p));
        }
        let Some(cholesky) = hessian.cholesky() else { break };
        // A long step overshoots in the flat part of the logistic.
        let step = cholesky.solve(&gradient);
        w -= step * (4.0 / step.amax()).min(1.0);
    }
    let mut weights = Weights::zeros();
    for k in 0..NUM_TERMS {
        weights[k] = w[k] / deviation[k];
        weights[NUM_TERMS] -= weights[k] * mean[k];
    }
    weights[NUM_TERMS] += w[NUM_TERMS];
    weights
}

/// `config` with other neutral values but unchanged scores. A neutral value is half-way between the medians of correct
/// and wrong poses, so that a positive contribution supports the part. For resemblance it is the median of all poses,
/// for size and outside 0 (their best value), and for the terms from details on an end of the range.
fn neutral_in_the_middle(parts: &[&PartObservations], config: &ScoreConfig) -> ScoreConfig {
    let examples = examples(parts, config);
    let median = |k: usize, right: Option<bool>| {
        let of_kind = examples.iter().filter(|example| right.is_none_or(|right| example.is_right == right));
        upper_median(of_kind.map(|example| example.x[k])).unwrap_or(0.0)
    };
    let weights = weights_of(config);
    let mut made = *config;
    for (k, term) in terms_mut(&mut made).into_iter().enumerate() {
        term.neutral = match k {
            0..=3 | 7 => 0.5 * (median(k, Some(true)) + median(k, Some(false))),
            6 => median(k, None),
            // `details` only counts against a part, below the end of its range; the terms after it count from the start
            // of their range.
            8 => term.range[1],
            9.. => term.range[0],
            _ => 0.0,
        };
        term.neutral = (term.neutral * 100.0).round() / 100.0;
    }
    with_weights(&made, &weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitting::observation::PoseObservation;
    use crate::verdict::Clues;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use crate::verdict::tests::look;

    /// Correct poses have more edges than wrong ones on average; all other terms carry no information.
    fn part(rng: &mut Pcg64Mcg) -> PartObservations {
        let mut pose = |edges: f64, instance_idx| {
            let mut noise = || rng.random_range(-0.15..0.15);
            let evidence = Evidence {
                edges: edges + noise(),
                surface: Some(0.4 + noise()),
                hue_shift: 0.0,
                visible: 0.8 + noise(),
                outside: 0.0,
                close: Some(look(2.0)),
            };
            let clues = Clues { demonstration_idx: 0, evidence, log_size: 0.0, network: None, resemblance: 0.33 };
            PoseObservation { clues, instance_idx }
        };
        let pictures = (0..40)
            .map(|_| PictureObservations {
                num_instances: 1,
                poses: vec![pose(0.6, Some(0)), pose(0.4, None), pose(0.3, None)],
            })
            .collect();
        PartObservations { pictures }
    }

    #[test]
    fn the_term_that_tells_right_from_wrong_gets_the_weight() {
        let rng = &mut Pcg64Mcg::seed_from_u64(3);
        let parts = [part(rng), part(rng)];
        let fitted = fit_score(&parts, &ScoreConfig::DEFAULT);
        let [edges, surface, _, visible, ..] = terms(&fitted).map(|term| term.weight);
        assert!(edges > 5.0, "{fitted:?}");
        assert!([surface, visible].iter().all(|weight| weight.abs() < 0.4 * edges), "{fitted:?}");
        assert!((fitted.edges.neutral - 0.52).abs() < 0.06, "{fitted:?}");
        assert_eq!(fit_score(&parts, &ScoreConfig::DEFAULT), fitted);
    }

    #[test]
    fn other_neutral_values_are_the_same_score() {
        let config = ScoreConfig::DEFAULT;
        let mut moved = config;
        moved.edges.neutral += 0.1;
        moved.bias += 0.1 * config.edges.weight;
        assert!((weights_of(&moved) - weights_of(&config)).amax() < 1e-12);
        assert!((with_weights(&moved, &weights_of(&config)).bias - moved.bias).abs() < 1e-12);
    }
}
