//! Two fractions of the same cases: their difference with its interval, and the number of cases needed to show it.

use serde::Serialize;

use crate::statistics::{Share, wilson_interval};

/// Number of standard deviations on both sides of the mean that contain 95 % of a normal distribution: a test at the
/// 5 % level.
const Z_TWO_SIDED_5_PERCENT: f64 = 1.959_963_984_540_054;
/// 80 % quantile of the normal distribution.
const Z_POWER_80_PERCENT: f64 = 0.841_621_233_572_914;

/// Outcomes of two models on the same cases, as four counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PairedCounts {
    /// Cases solved by both.
    pub both: usize,
    /// Cases solved only by the first.
    pub first_only: usize,
    /// Cases solved only by the second.
    pub second_only: usize,
    /// Cases solved by neither.
    pub neither: usize,
}

impl PairedCounts {
    /// Counts one case.
    pub fn add(&mut self, first: bool, second: bool) {
        *match (first, second) {
            (true, true) => &mut self.both,
            (true, false) => &mut self.first_only,
            (false, true) => &mut self.second_only,
            (false, false) => &mut self.neither,
        } += 1;
    }

    /// Number of all cases.
    pub fn total(self) -> usize {
        self.both + self.first_only + self.second_only + self.neither
    }

    /// Fraction solved by the first model.
    pub fn first(self) -> Share {
        Share { count: self.both + self.first_only, of: self.total() }
    }

    /// Fraction solved by the second model.
    pub fn second(self) -> Share {
        Share { count: self.both + self.second_only, of: self.total() }
    }

    /// The first fraction minus the second; `None` without cases.
    pub fn difference(self) -> Option<f64> {
        let n = self.total();
        (n > 0).then(|| (self.first_only as f64 - self.second_only as f64) / n as f64)
    }

    /// 95 % confidence interval of the difference; `None` without cases.
    ///
    /// # Source
    /// R. G. Newcombe, "Improved confidence intervals for the difference between binomial proportions based on paired
    /// data", Statistics in Medicine 17, 1998, method 10: Wilson's intervals of both fractions, squared and added, with
    /// the correlation of the cases, which is corrected for continuity if it is positive.
    pub fn difference_interval(self) -> Option<[f64; 2]> {
        let difference = self.difference()?;
        let n = self.total() as f64;
        let share_of = |share: Share| share.count as f64 / n;
        let (p1, p2) = (share_of(self.first()), share_of(self.second()));
        let ([low1, high1], [low2, high2]) = (wilson_interval(self.first()), wilson_interval(self.second()));
        let phi = self.correlation();
        let combined = |a: f64, b: f64| (a * a - 2.0 * phi * a * b + b * b).max(0.0).sqrt();
        Some([difference - combined(p1 - low1, high2 - p2), difference + combined(high1 - p1, p2 - low2)])
    }

    /// Correlation of the two outcomes, as used in the interval.
    fn correlation(self) -> f64 {
        let [both, first_only, second_only, neither] =
            [self.both, self.first_only, self.second_only, self.neither].map(|count| count as f64);
        let margins = (both + first_only) * (second_only + neither) * (both + second_only) * (first_only + neither);
        if margins == 0.0 {
            return 0.0;
        }
        let product = both * neither - first_only * second_only;
        let corrected = if product > 0.0 { (product - 0.5 * self.total() as f64).max(0.0) } else { product };
        corrected / margins.sqrt()
    }

    /// Whether the interval of the difference excludes zero.
    pub fn differs(self) -> bool {
        self.difference_interval().is_some_and(|[low, high]| low > 0.0 || high < 0.0)
    }

    /// Number of cases that would show a difference of this size with 80 % power at the 5 % level, two-sided, by
    /// McNemar's test; `None` if both fractions are equal.
    ///
    /// # Source
    /// R. J. Connor, "Sample size for testing differences in proportions for the paired-sample design", Biometrics 43,
    /// 1987, page 209.
    pub fn cases_needed(self) -> Option<usize> {
        let difference = self.difference()?.abs();
        if difference == 0.0 {
            return None;
        }
        let discordant = (self.first_only + self.second_only) as f64 / self.total() as f64;
        let root = Z_TWO_SIDED_5_PERCENT * discordant.sqrt()
            + Z_POWER_80_PERCENT * (discordant - difference * difference).max(0.0).sqrt();
        Some((root / difference).powi(2).ceil() as usize)
    }
}

impl std::ops::Add for PairedCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            both: self.both + other.both,
            first_only: self.first_only + other.first_only,
            second_only: self.second_only + other.second_only,
            neither: self.neither + other.neither,
        }
    }
}

impl std::iter::Sum for PairedCounts {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), |sum, count| sum + count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Precision of the reference values.
    const TOLERANCE: f64 = 5e-5;

    fn counts(both: usize, first_only: usize, second_only: usize, neither: usize) -> PairedCounts {
        PairedCounts { both, first_only, second_only, neither }
    }

    #[test]
    fn newcombe_s_interval_agrees_with_known_values() {
        // The first case is in Newcombe's table II; the second is a test of the R package contingencytables (Cavo et
        // al., 2012); the third was computed in another language.
        for (counts, low, high) in [
            (counts(36, 12, 2, 0), 0.0569, 0.3404),
            (counts(59, 6, 16, 80), -0.1186, -0.0046),
            (counts(80, 0, 0, 0), -0.0458, 0.0458),
        ] {
            let [found_low, found_high] = counts.difference_interval().unwrap();
            assert!((found_low - low).abs() < TOLERANCE, "{counts:?}: {found_low}");
            assert!((found_high - high).abs() < TOLERANCE, "{counts:?}: {found_high}");
        }
        assert!(PairedCounts::default().difference_interval().is_none());
    }

    #[test]
    fn connor_s_number_of_cases_agrees_with_known_values() {
        // From powerandsamplesize.com: discordant fractions of 0.45 and 0.05 need 23 pairs. The second case was
        // computed by hand.
        assert_eq!(counts(5, 1, 9, 5).cases_needed(), Some(23));
        assert_eq!(counts(80, 10, 5, 5).cases_needed(), Some(469));
        assert_eq!(counts(80, 5, 5, 10).cases_needed(), None);
    }

    #[test]
    fn swapping_the_two_swaps_the_sign() {
        let there = counts(60, 14, 5, 21);
        let back = counts(60, 5, 14, 21);
        let ([low, high], [back_low, back_high]) =
            (there.difference_interval().unwrap(), back.difference_interval().unwrap());
        assert!((low + back_high).abs() < 1e-12 && (high + back_low).abs() < 1e-12);
        assert_eq!(there.cases_needed(), back.cases_needed());
        assert_eq!((there.first().count, there.second().count), (74, 65));
    }

    #[test]
    fn a_difference_shows_when_its_interval_leaves_zero_out() {
        assert!(counts(36, 12, 2, 0).differs());
        assert!(!counts(78, 2, 0, 0).differs());
        let mut added = PairedCounts::default();
        for (first, second) in [(true, true), (true, false), (false, true), (false, false), (true, false)] {
            added.add(first, second);
        }
        assert_eq!(added, counts(1, 2, 1, 1));
        assert_eq!([added, added].into_iter().sum::<PairedCounts>().total(), 10);
    }
}
