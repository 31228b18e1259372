//! The loss of a configuration's decisions.

use super::observation::{PartObservations, PictureObservations};
use crate::check_config::ScoreConfig;
use crate::verdict::judge_picture;

/// Scores are clamped to this distance from 0 and 1: one decision costs at most −ln 0.01 = 4.6.
const MIN_SCORE: f64 = 0.01;

/// Number of refused correct detections that cost as much as one accepted wrong detection. Before a network compared
/// photo and picture, the value was 3, since 1 gave false alarms in the paper's evaluation. With the network, the score
/// of the best wrong pose in that evaluation stays far below 0.5.
pub(super) const COST_OF_WRONG: f64 = 1.0;

/// The loss of wrong decisions; see [`crate::fitting`] for the definition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// The sum of the losses of correct and wrong poses.
    pub total: f64,
    /// Loss of correct poses: mean of −ln p.
    pub right: f64,
    /// Loss of wrong poses: mean of −ln (1 − q).
    pub wrong: f64,
    /// Number of instances with an accepted correct pose, and number of instances.
    pub accepted: [usize; 2],
    /// Number of pictures with an accepted wrong pose, and number of pictures.
    pub false_alarms: [usize; 2],
}

/// The loss of each part.
pub(super) fn losses(parts: &[PartObservations], config: &ScoreConfig) -> Vec<Loss> {
    parts.iter().map(|part| part_loss(part, config)).collect()
}

fn part_loss(part: &PartObservations, config: &ScoreConfig) -> Loss {
    let (mut right, mut wrong) = (Vec::new(), Vec::new());
    for picture in &part.pictures {
        let (rights, worst) = scores(picture, config);
        right.extend(rights);
        wrong.push(worst);
    }
    let clipped = |score: f64| score.clamp(MIN_SCORE, 1.0 - MIN_SCORE);
    let right_loss = mean(right.iter().map(|&p| -clipped(p).ln()));
    let wrong_loss = mean(wrong.iter().map(|&q| -(1.0 - clipped(q)).ln()));
    let accepted = |scores: &[f64]| [scores.iter().filter(|&&score| score >= 0.5).count(), scores.len()];
    Loss {
        total: right_loss + COST_OF_WRONG * wrong_loss,
        right: right_loss,
        wrong: wrong_loss,
        accepted: accepted(&right),
        false_alarms: accepted(&wrong),
    }
}

/// The best score of a correct pose for each instance, and the best score of a wrong pose.
fn scores(picture: &PictureObservations, config: &ScoreConfig) -> (Vec<f64>, f64) {
    let mut rights = vec![0.0f64; picture.num_instances];
    let mut worst = 0.0f64;
    for (pose, (score, _)) in picture.poses.iter().zip(judge_picture(&picture.clues(), config)) {
        let best = pose.instance_idx.map_or(&mut worst, |idx| &mut rights[idx]);
        *best = best.max(score);
    }
    (rights, worst)
}

/// The mean over parts; counts are summed.
pub(super) fn mean_loss(parts: &[Loss]) -> Loss {
    let sum = |counts: fn(&Loss) -> [usize; 2]| parts.iter().map(counts).fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
    Loss {
        total: mean(parts.iter().map(|loss| loss.total)),
        right: mean(parts.iter().map(|loss| loss.right)),
        wrong: mean(parts.iter().map(|loss| loss.wrong)),
        accepted: sum(|loss| loss.accepted),
        false_alarms: sum(|loss| loss.false_alarms),
    }
}

/// The effect of a change of the configuration on the loss: negative is better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Mean over parts.
    pub mean: f64,
    /// Half of the 95 % interval: 1.96 standard errors of the parts' differences.
    pub half_interval: f64,
}

impl Difference {
    pub(super) fn between(before: &[Loss], after: &[Loss]) -> Self {
        let differences: Vec<f64> = before.iter().zip(after).map(|(b, a)| a.total - b.total).collect();
        let (n, center) = (differences.len() as f64, mean(differences.iter().copied()));
        let squares: f64 = differences.iter().map(|d| (d - center).powi(2)).sum();
        Self { mean: center, half_interval: 1.96 * (squares / (n - 1.0) / n).sqrt() }
    }

    /// Whether the decrease of the loss exceeds the interval.
    pub fn is_improvement(&self) -> bool {
        self.mean + self.half_interval < 0.0
    }
}

/// Mean; 0 for an empty list.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    if count > 0 { sum / count as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::observation::PoseObservation;
    use super::*;
    use crate::check_config::Term;
    use crate::verdict::Clues;
    use crate::verdict::tests::look;
    use sdg_shape::Evidence;

    /// A score from the edges alone: log-odds of 10 per unit above 0.5.
    fn edges_alone() -> ScoreConfig {
        let none = Term { weight: 0.0, neutral: 0.0, range: [0.0, 1.0] };
        ScoreConfig {
            is_size_known: false,
            bias: 0.0,
            edges: Term { weight: 10.0, neutral: 0.5, range: [0.0, 1.0] },
            surface: none,
            hue: none,
            visible: none,
            size: none,
            outside: none,
            resemblance: none,
            likeness: none,
            details: none,
            details_for: none,
            table: none,
            rim: none,
            added: none,
            mirror: none,
            network: none,
        }
    }

    fn pose(edges: f64, instance_idx: Option<usize>) -> PoseObservation {
        let evidence =
            Evidence { edges, surface: Some(0.0), hue_shift: 0.0, visible: 0.0, outside: 0.0, close: Some(look(0.0)) };
        PoseObservation {
            clues: Clues { demonstration_idx: 0, evidence, log_size: 0.0, network: None, resemblance: 0.3 },
            instance_idx,
        }
    }

    #[test]
    fn the_loss_is_what_a_hand_computes() {
        let pictures = vec![
            PictureObservations {
                num_instances: 2,
                poses: vec![pose(0.5, Some(0)), pose(0.45, Some(0)), pose(0.5, None)],
            },
            PictureObservations { num_instances: 0, poses: vec![pose(0.4, None)] },
        ];
        let loss = part_loss(&PartObservations { pictures }, &edges_alone());
        // p: one instance at 0.5, and one never found, 0.01. q: 0.5; in the other picture 1 / (1 + e^1) = 0.268941.
        let right = -(0.5f64.ln() + 0.01f64.ln()) / 2.0;
        let wrong = -(0.5f64.ln() + (1.0 - 0.268_941_421f64).ln()) / 2.0;
        assert!((loss.right - right).abs() < 1e-6 && (loss.wrong - wrong).abs() < 1e-6, "{loss:?}");
        assert!((loss.total - right - wrong).abs() < 1e-6);
        assert_eq!((loss.accepted, loss.false_alarms), ([1, 2], [1, 2]));
    }

    #[test]
    fn a_perfect_check_loses_as_little_as_can_be() {
        let pictures = vec![PictureObservations { num_instances: 1, poses: vec![pose(1.0, Some(0))] }];
        let loss = part_loss(&PartObservations { pictures }, &edges_alone());
        assert!((loss.right + 0.99f64.ln()).abs() < 4e-3 && (loss.wrong + 0.99f64.ln()).abs() < 1e-9, "{loss:?}");
        assert_eq!((loss.accepted, loss.false_alarms), ([1, 1], [0, 1]));
    }

    #[test]
    fn differences_are_taken_part_by_part() {
        let loss = |total: f64| Loss { total, right: total, wrong: 0.0, accepted: [0, 0], false_alarms: [0, 0] };
        let difference = Difference::between(&[loss(1.0), loss(2.0)], &[loss(0.9), loss(1.7)]);
        // Differences −0.1 and −0.3: mean −0.2, standard deviation √0.02, standard error √0.02 / √2 = 0.1.
        assert!((difference.mean + 0.2).abs() < 1e-12);
        assert!((difference.half_interval - 0.196).abs() < 1e-12);
        assert!(difference.is_improvement());
        assert!(!Difference { mean: -0.1, half_interval: 0.196 }.is_improvement());
    }
}
