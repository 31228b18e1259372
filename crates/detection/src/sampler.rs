//! Which matched boxes take part in a loss.

use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;

use crate::config::SamplerConfig;
use crate::matcher::Match;

/// Indices drawn from a list of matches.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sampled {
    /// Positive ones.
    pub positive: Vec<usize>,
    /// Negative ones.
    pub negative: Vec<usize>,
}

/// Draws positives up to the configured fraction and fills up with negatives.
///
/// Where everything fits, all is taken in order and the generator decides nothing.
pub fn sample(matches: &[Match], config: &SamplerConfig, rng: &mut Pcg64Mcg) -> Sampled {
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
    draw(&mut negative, config.batch_size_per_image - positive.len(), rng);
    Sampled { positive, negative }
}

/// Keeps `count` of `idxs`, drawn without replacement.
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
