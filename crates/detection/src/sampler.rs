//! Samples the matches that enter a loss.

use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;

use crate::config::SamplerConfig;
use crate::matcher::Match;

/// Indices sampled from a list of matches.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sampled {
    /// Indices of the positive samples.
    pub positive: Vec<usize>,
    /// Indices of the negative samples.
    pub negative: Vec<usize>,
}

/// Samples positives up to the configured fraction, and negatives for the rest.
///
/// If there are no more boxes than needed, all are taken in order and the generator is not used.
pub fn sample(matches: &[Match], config: &SamplerConfig, rng: &mut Pcg64Mcg) -> Sampled {
    sample_with_first(matches, config, 0.0, rng)
}

/// Like [`sample`], but the fraction `first_share` of the negatives is taken from the start of the list, where the
/// proposals with the highest objectness are.
pub fn sample_with_first(matches: &[Match], config: &SamplerConfig, first_share: f64, rng: &mut Pcg64Mcg) -> Sampled {
    let mut positive = Vec::new();
    let mut negative = Vec::new();
    for (idx, m) in matches.iter().enumerate() {
        match m {
            Match::Positive(_) => positive.push(idx),
            Match::Negative => negative.push(idx),
            Match::Ignored => {}
        }
    }
    let max_positive = (config.batch_size_per_image as f64 * config.positive_fraction) as usize;
    draw(&mut positive, max_positive, rng);
    let num_negative = config.batch_size_per_image - positive.len();
    let num_first = ((num_negative as f64 * first_share) as usize).min(negative.len());
    let mut others = negative.split_off(num_first);
    draw(&mut others, num_negative - num_first, rng);
    negative.extend(others);
    Sampled { positive, negative }
}

/// Keeps `count` of `idxs`, sampled without replacement.
pub fn draw(idxs: &mut Vec<usize>, count: usize, rng: &mut Pcg64Mcg) {
    if idxs.len() > count {
        let (kept, _) = idxs.partial_shuffle(rng, count);
        *idxs = kept.to_vec();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const CONFIG: SamplerConfig = SamplerConfig { batch_size_per_image: 8, positive_fraction: 0.25 };

    fn matches(num_positive: usize, num_negative: usize) -> Vec<Match> {
        let mut all = vec![Match::Positive(0); num_positive];
        all.extend(vec![Match::Negative; num_negative]);
        all.push(Match::Ignored);
        all
    }

    #[test]
    fn positives_are_bounded_and_negatives_fill_up() {
        let sampled = sample(&matches(5, 50), &CONFIG, &mut Pcg64Mcg::seed_from_u64(1));
        assert_eq!((sampled.positive.len(), sampled.negative.len()), (2, 6));
        assert!(sampled.positive.iter().all(|i| *i < 5));
        assert!(sampled.negative.iter().all(|i| (5..55).contains(i)));
        let few = sample(&matches(1, 50), &CONFIG, &mut Pcg64Mcg::seed_from_u64(1));
        assert_eq!((few.positive.len(), few.negative.len()), (1, 7));
    }

    #[test]
    fn the_first_negatives_are_taken_for_certain_where_asked() {
        let sampled = sample_with_first(&matches(5, 50), &CONFIG, 0.5, &mut Pcg64Mcg::seed_from_u64(1));
        assert_eq!((&sampled.negative[..3], sampled.negative.len()), (&[5, 6, 7][..], 6));
        assert!(sampled.negative[3..].iter().all(|idx| (8..55).contains(idx)));
        let few = sample_with_first(&matches(1, 3), &CONFIG, 1.0, &mut Pcg64Mcg::seed_from_u64(1));
        assert_eq!(few.negative, [1, 2, 3]);
    }

    #[test]
    fn the_seed_decides() {
        let all = matches(20, 200);
        let draw = |seed| sample(&all, &CONFIG, &mut Pcg64Mcg::seed_from_u64(seed));
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3), draw(4));
    }

    #[test]
    fn without_replacement() {
        let mut negative = sample(&matches(0, 20), &CONFIG, &mut Pcg64Mcg::seed_from_u64(9)).negative;
        negative.sort_unstable();
        negative.dedup();
        assert_eq!(negative.len(), 8);
    }
}
