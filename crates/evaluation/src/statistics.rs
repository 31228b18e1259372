//! Fractions and their confidence intervals.

use serde::Serialize;

/// Number of standard deviations on both sides of the mean that contain 95 % of a normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// A fraction: `count` of `of`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Share {
    pub count: usize,
    /// The total number.
    pub of: usize,
}

impl Share {
    /// Counts the items for which `holds` returns true, of all items.
    pub fn of<T>(items: impl IntoIterator<Item = T>, holds: impl Fn(&T) -> bool) -> Self {
        items.into_iter().fold(Self::default(), |share, item| Self {
            count: share.count + usize::from(holds(&item)),
            of: share.of + 1,
        })
    }

    /// The fraction in percent; `None` if the total is zero.
    pub fn percent(self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * self.count as f64 / self.of as f64)
    }
}

impl std::ops::Add for Share {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { count: self.count + other.count, of: self.of + other.of }
    }
}

impl std::iter::Sum for Share {
    fn sum<I: Iterator<Item = Self>>(shares: I) -> Self {
        shares.fold(Self::default(), |sum, share| sum + share)
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.count, self.of)
    }
}

/// 95 % confidence interval of a probability (Wilson); `[0, 1]` if the total is zero.
///
/// # Source
/// E. B. Wilson, "Probable inference, the law of succession, and statistical inference", 1927, without continuity
/// correction. Unlike the normal approximation, it is meaningful for 80 of 80.
pub fn wilson_interval(share: Share) -> [f64; 2] {
    if share.of == 0 {
        return [0.0, 1.0];
    }
    let n = share.of as f64;
    let p = share.count as f64 / n;
    let z2 = Z_95 * Z_95;
    let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// 95 % confidence interval (Newcombe) of the difference between two independent probabilities, the first minus the
/// second.
///
/// # Source
/// R. G. Newcombe, "Interval estimation for the difference between independent proportions", 1998, method 10, without
/// continuity correction: a combination of Wilson's intervals of both fractions.
pub fn newcombe_interval(first: Share, second: Share) -> [f64; 2] {
    if first.of == 0 || second.of == 0 {
        return [-1.0, 1.0];
    }
    let p = |share: Share| share.count as f64 / share.of as f64;
    let ([low1, high1], [low2, high2]) = (wilson_interval(first), wilson_interval(second));
    let (p1, p2) = (p(first), p(second));
    [p1 - p2 - (p1 - low1).hypot(high2 - p2), p1 - p2 + (high1 - p1).hypot(p2 - low2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Precision of the reference values.
    const TOLERANCE: f64 = 5e-5;

    #[test]
    fn wilson_agrees_with_known_values() {
        // 8 of 10 (49.0 to 94.3 %) and 0 of 10 (to 27.8 %) are in textbooks; the remaining values were computed in
        // another language.
        for (count, of, low, high) in [
            (8, 10, 0.4902, 0.9433),
            (0, 10, 0.0, 0.2775),
            (10, 10, 0.7225, 1.0),
            (75, 80, 0.8619, 0.9730),
            (80, 80, 0.9542, 1.0),
        ] {
            let [found_low, found_high] = wilson_interval(Share { count, of });
            assert!((found_low - low).abs() < TOLERANCE, "{count} of {of}: {found_low}");
            assert!((found_high - high).abs() < TOLERANCE, "{count} of {of}: {found_high}");
        }
        assert_eq!(wilson_interval(Share::default()), [0.0, 1.0]);
    }

    #[test]
    fn newcombe_agrees_with_his_paper() {
        // From table II of the paper, in the column of method 10.
        for ([a, m, b, n], low, high) in
            [([56, 70, 48, 80], 0.0524, 0.3339), ([9, 10, 3, 10], 0.1705, 0.8090), ([10, 10, 0, 20], 0.6791, 1.0)]
        {
            let [found_low, found_high] = newcombe_interval(Share { count: a, of: m }, Share { count: b, of: n });
            assert!((found_low - low).abs() < TOLERANCE, "{a} of {m}, {b} of {n}: {found_low}");
            assert!((found_high - high).abs() < TOLERANCE, "{a} of {m}, {b} of {n}: {found_high}");
        }
        assert_eq!(newcombe_interval(Share { count: 1, of: 2 }, Share::default()), [-1.0, 1.0]);
    }

    #[test]
    fn shares_add_up() {
        let share: Share = [Share::of([1, 2, 3], |n| *n > 1), Share { count: 0, of: 2 }].into_iter().sum();
        assert_eq!(share.to_string(), "2 of 5");
        assert_eq!(share.percent(), Some(40.0));
        assert_eq!(Share::default().percent(), None);
    }
}
