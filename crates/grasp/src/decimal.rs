//! Numbers that JSON restores exactly.
//!
//! `serde_json` reads a number exactly if it has at most about 15 digits; longer ones may change by one unit in the
//! last place, and a model read from its file would give slightly different scores than the written model.

/// Rounded to nine decimals. Exact in JSON below about nine million; values that are not finite are unchanged.
pub(crate) fn decimal(value: f64) -> f64 {
    const SCALE: f64 = 1e9;
    (value * SCALE).round() / SCALE
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn json_gives_it_back(value in -9e6..9e6f64) {
            let kept = decimal(value);
            prop_assert!((kept - value).abs() <= 1e-9);
            let read: f64 = serde_json::from_str(&serde_json::to_string(&kept).unwrap()).unwrap();
            prop_assert_eq!(read.to_bits(), kept.to_bits());
        }
    }
}
