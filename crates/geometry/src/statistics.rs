//! Medians and percentiles of measurements.

/// The finite values in ascending order.
fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The median of the finite values; for an even number the mean of the middle two. `None` without values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let sorted = sorted(values);
    let (upper, lower) = (sorted.len() / 2, sorted.len().checked_sub(1)? / 2);
    Some(0.5 * sorted[lower] + 0.5 * sorted[upper])
}

/// The median of the finite values; for an even number the upper of the middle two. `None` without values.
pub fn upper_median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let sorted = sorted(values);
    sorted.get(sorted.len() / 2).copied()
}

/// The percentile of the finite values, by linear interpolation between neighbours; `None` without values.
pub fn percentile(values: impl IntoIterator<Item = f64>, percent: f64) -> Option<f64> {
    let sorted = sorted(values);
    let last = sorted.len().checked_sub(1)?;
    let at = percent.clamp(0.0, 100.0) / 100.0 * last as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    Some(below + (above - below) * at.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_odd_even_and_none() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 8.0]), Some(3.0));
        assert_eq!(median([4.0, 1.0, f64::NAN, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([5.0]), Some(5.0));
        assert_eq!(median([]), None);
    }

    #[test]
    fn an_upper_median_is_one_of_the_values() {
        assert_eq!(upper_median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(upper_median([4.0, 1.0, f64::NAN, 2.0, 8.0]), Some(4.0));
        assert_eq!(upper_median([]), None);
    }

    #[test]
    fn percentiles_lie_between_neighbours() {
        let values = [4.0, 1.0, 3.0, 2.0, f64::NAN];
        assert_eq!(percentile(values, 50.0), Some(2.5));
        assert_eq!(percentile(values, 0.0), Some(1.0));
        assert_eq!(percentile(values, 100.0), Some(4.0));
        // Index 0.9 · 3 = 2.7, from 0.
        assert!((percentile(values, 90.0).unwrap() - 3.7).abs() < 1e-12);
        assert_eq!(percentile([], 50.0), None);
    }
}
