//! Numbers that JSON gives back to the bit.
//!
//! `serde_json` reads a number exactly when it has at most 15 digits or so; longer ones may come back one unit in the
//! last place off, and then a model read from its file would give slightly other scores than the model that was written.

/// Rounded to nine decimals. Exact in JSON below about nine million; what is not finite stays so.
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
