//! Facts about a work's result.

use crate::protocol::Facts;

/// Facts from names and numbers.
pub fn facts<const N: usize>(entries: [(&str, f64); N]) -> Facts {
    entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// The mean; 0 without values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_nothing_is_zero() {
        assert_eq!(mean([]), 0.0);
        assert_eq!(mean([1.0, 4.0]), 2.5);
    }
}
