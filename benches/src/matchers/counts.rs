//! Counts found parts, wrong detections and false alarms in the way of `sdg evaluate --pictures`.

use sdg_evaluation::Share;
use sdg_evaluation::labelled_pictures::{Judged, Tested, Totals, judge};

/// Counts over some pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted {
    pub found: Share,
    pub wrong: usize,
    pub false_alarms: Share,
}

/// Counts the detections with a score of at least `min_score`.
pub fn counted(tested: &[Tested], min_score: f64) -> Counted {
    let judged: Vec<Judged> = tested.iter().map(|tested| judge(tested, min_score)).collect();
    let Totals { found, wrong, false_alarms, .. } = Totals::of(&judged);
    Counted { found, wrong, false_alarms }
}

/// The threshold with the largest number of found parts minus wrong detections and false alarms, and the counts at it;
/// of equally good thresholds, the highest.
pub fn best_for(tested: &[Tested]) -> (f64, Counted) {
    const STEPS: u32 = 100;
    let scores = tested.iter().flat_map(|tested| &tested.detections).map(|detection| detection.score);
    let (low, high) =
        scores.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), score| (low.min(score), high.max(score)));
    // Above the highest score nothing is accepted, which is better than wrong detections only.
    let mut best = (1.0f64.max(high) + 1e-6, counted(tested, f64::INFINITY));
    for step in (0..=STEPS).rev().filter(|_| low <= high) {
        let least = low + (high - low) * f64::from(step) / f64::from(STEPS);
        let there = counted(tested, least);
        if worth(&there) > worth(&best.1) {
            best = (least, there);
        }
    }
    best
}

fn worth(counted: &Counted) -> i64 {
    counted.found.count as i64 - counted.wrong as i64 - counted.false_alarms.count as i64
}
