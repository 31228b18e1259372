//! Matching of anchors and proposals to ground-truth boxes.

use crate::boxes::{Corners, iou};
use crate::config::{LowQualityMatches, MatcherConfig};

/// The class of an anchor or proposal after matching.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Match {
    /// Background.
    Negative,
    /// Between background and object: not part of the losses.
    Ignored,
    /// The object with this index.
    Positive(usize),
}

/// Matches every candidate to the ground-truth box with the largest overlap.
///
/// Without ground truth every candidate is negative. With [`LowQualityMatches::Allowed`], the candidates with the
/// largest overlap with a ground-truth box are positive at any IoU above 0. Each of them is then matched to the box
/// that it overlaps most, which may be another box. Detectron2 and torchvision do the same.
pub fn match_boxes(candidates: &[Corners], gt_boxes: &[Corners], config: &MatcherConfig) -> Vec<Match> {
    if gt_boxes.is_empty() {
        return vec![Match::Negative; candidates.len()];
    }
    let mut matched_idxs = vec![0usize; candidates.len()];
    let mut best_iou = vec![0f32; candidates.len()];
    // Few of the tens of thousands of anchors touch an object; the other overlaps are 0 and not computed.
    let touching: Vec<Vec<(usize, f32)>> = gt_boxes
        .iter()
        .map(|gt| {
            let touched = candidates.iter().enumerate().filter(|(_, candidate)| touch(gt, candidate));
            touched.map(|(idx, candidate)| (idx, iou(gt, candidate))).collect()
        })
        .collect();
    for (gt_idx, overlaps) in touching.iter().enumerate() {
        for &(idx, overlap) in overlaps {
            if overlap > best_iou[idx] {
                best_iou[idx] = overlap;
                matched_idxs[idx] = gt_idx;
            }
        }
    }
    let mut matches: Vec<Match> = best_iou
        .iter()
        .zip(&matched_idxs)
        .map(|(overlap, gt_idx)| {
            if f64::from(*overlap) >= config.positive_from {
                Match::Positive(*gt_idx)
            } else if f64::from(*overlap) < config.negative_below {
                Match::Negative
            } else {
                Match::Ignored
            }
        })
        .collect();
    if config.low_quality == LowQualityMatches::Allowed {
        for overlaps in &touching {
            let best = overlaps.iter().fold(0f32, |best, &(_, overlap)| best.max(overlap));
            // For an object that touches no candidate, the best overlap is 0 for all of them.
            if best <= 0.0 {
                continue;
            }
            for &(idx, _) in overlaps.iter().filter(|(_, overlap)| *overlap == best) {
                matches[idx] = Match::Positive(matched_idxs[idx]);
            }
        }
    }
    matches
}

/// Whether two boxes have a common area.
fn touch(a: &Corners, b: &Corners) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(low_quality: LowQualityMatches) -> MatcherConfig {
        MatcherConfig { negative_below: 0.3, positive_from: 0.7, low_quality }
    }

    // A ground truth of 10 × 10 px; a candidate of the same height and of width w inside it has an IoU of w / 10.
    const GT: Corners = [0.0, 0.0, 10.0, 10.0];
    fn inside(width: f32) -> Corners {
        [0.0, 0.0, width, 10.0]
    }

    #[test]
    fn thresholds_split_in_three() {
        let matches =
            match_boxes(&[inside(2.0), inside(5.0), inside(8.0)], &[GT], &config(LowQualityMatches::Forbidden));
        assert_eq!(matches, [Match::Negative, Match::Ignored, Match::Positive(0)]);
    }

    #[test]
    fn an_unreached_object_takes_its_best_boxes() {
        let candidates = [inside(1.0), inside(2.0), inside(2.0)];
        assert_eq!(
            match_boxes(&candidates, &[GT], &config(LowQualityMatches::Allowed)),
            [Match::Negative, Match::Positive(0), Match::Positive(0)]
        );
        assert_eq!(match_boxes(&candidates, &[GT], &config(LowQualityMatches::Forbidden)), [Match::Negative; 3]);
    }

    #[test]
    fn an_object_that_touches_nothing_takes_nothing() {
        let far = [500.0, 500.0, 510.0, 510.0];
        let matches = match_boxes(&[inside(8.0)], &[far], &config(LowQualityMatches::Allowed));
        assert_eq!(matches, [Match::Negative]);
    }

    #[test]
    fn no_object_makes_all_negative() {
        let matches = match_boxes(&[GT], &[], &config(LowQualityMatches::Allowed));
        assert_eq!(matches, [Match::Negative]);
    }
}
