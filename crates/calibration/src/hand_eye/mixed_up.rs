//! Finds a few robot poses that do not match their pictures: one or two that are wrong, or two that are exchanged.

use nalgebra::Isometry3;

use super::closed_form::{self, BoardSize};
use super::solve::Evidence;
use super::view::MIN_POSES;

/// The mistake in the poses of a few pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum MixedUp {
    /// The poses of these pictures are wrong.
    Wrong(Vec<usize>),
    /// The poses of these two pictures are exchanged.
    Exchanged([usize; 2]),
}

/// Largest fraction of the closed form's residual that may remain.
const MAX_SHARE: f64 = 0.5;
/// Ratio of another choice's residual to the smallest one, up to which both are equally plausible, so that the wrong
/// pose is unknown.
const MIN_AMBIGUITY: f64 = 2.0;
/// Minimum numbers of pictures for naming one wrong pose, and two. With fewer, the other poses agree by chance if the
/// robot is merely inaccurate.
const MIN_FOR_ONE: usize = MIN_POSES + 2;
const MIN_FOR_TWO: usize = MIN_POSES + 4;
/// With more pictures, not every pair is tried, only the pairs that include the worst picture.
const MAX_ALL_PAIRS: usize = 30;

/// The most plausible choice of each kind, if it is clear; the simplest kind first.
pub(super) fn plausible(evidence: &Evidence, robot: &[Isometry3<f64>]) -> Vec<MixedUp> {
    let (motions, boards) = (evidence.motions(robot), evidence.boards());
    let left = |motions: &[Isometry3<f64>], boards: &[Isometry3<f64>]| {
        closed_form::solve(motions, boards, BoardSize::Told).map_or(f64::INFINITY, |closed| closed.left_rad)
    };
    let num = motions.len();
    let given = left(&motions, &boards);
    let without = |out: &[usize]| {
        let kept =
            |all: &[Isometry3<f64>]| -> Vec<_> { (0..num).filter(|k| !out.contains(k)).map(|k| all[k]).collect() };
        left(&kept(&motions), &kept(&boards))
    };
    let with_exchanged = |[a, b]: [usize; 2]| {
        let mut motions = motions.clone();
        motions.swap(a, b);
        left(&motions, &boards)
    };
    let singles: Vec<_> = (0..num).map(|k| (without(&[k]), k)).collect();
    let worst = singles.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| *k);
    let pairs: Vec<[usize; 2]> = (0..num)
        .flat_map(|b| (0..b).map(move |a| [a, b]))
        .filter(|pair| num <= MAX_ALL_PAIRS || worst.is_some_and(|worst| pair.contains(&worst)))
        .collect();
    let mut found = Vec::new();
    if num >= MIN_FOR_ONE {
        found.extend(clearest(singles, given).map(|k| MixedUp::Wrong(vec![k])));
    }
    if num > MIN_POSES {
        let exchanged = pairs.iter().map(|pair| (with_exchanged(*pair), *pair)).collect();
        found.extend(clearest(exchanged, given).map(MixedUp::Exchanged));
    }
    if num >= MIN_FOR_TWO {
        let two = pairs.iter().map(|pair| (without(pair), *pair)).collect();
        found.extend(clearest(two, given).map(|pair| MixedUp::Wrong(pair.to_vec())));
    }
    found
}

/// The choice whose residual is clearly smaller than all others and than that of the given poses.
fn clearest<T>(mut choices: Vec<(f64, T)>, given: f64) -> Option<T> {
    choices.sort_by(|a, b| a.0.total_cmp(&b.0));
    let second = choices.get(1).map_or(f64::INFINITY, |(left, _)| *left);
    let (left, choice) = choices.into_iter().next()?;
    (left < MAX_SHARE * given && MIN_AMBIGUITY * left < second).then_some(choice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_clear_where_no_other_is_as_good() {
        assert_eq!(clearest(vec![(0.5, 'a'), (0.01, 'b'), (0.4, 'c')], 0.6), Some('b'));
        assert_eq!(clearest(vec![(0.5, 'a'), (0.01, 'b'), (0.015, 'c')], 0.6), None);
        assert_eq!(clearest(vec![(0.5, 'a')], 0.6), None);
    }
}
