//! A curve as a table, with its exponents.

use std::fmt::Write as _;

use anyhow::Result;

/// Times at one value of the varied number.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub number: f64,
    /// Number of parts in the picture.
    pub num_parts: u32,
    /// Number of parts found with the size free and with the size fixed.
    pub found: [usize; 2],
    /// Median seconds with the size free and with the size fixed.
    pub seconds: [f64; 2],
}

/// Times as a function of a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    what: &'static str,
    rows: Vec<Row>,
}

impl Curve {
    pub fn new(what: &'static str, rows: impl Iterator<Item = Result<Row>>) -> Result<Self> {
        Ok(Self { what, rows: rows.collect::<Result<_>>()? })
    }

    /// The exponent from the first row to the last: 1 if the time is proportional to the
    /// number.
    fn exponent(&self, which: usize) -> Option<f64> {
        let (first, last) = (self.rows.first()?, self.rows.last()?);
        exponent(first, last, which)
    }

    /// The largest exponent from one row to the next.
    fn steepest(&self, which: usize) -> Option<f64> {
        let steps = self.rows.windows(2).filter_map(|pair| exponent(&pair[0], &pair[1], which));
        steps.max_by(f64::total_cmp)
    }

    pub fn markdown(&self) -> String {
        let mut text = format!("| {} | size free | size fixed | found |\n|--:|--:|--:|--:|\n", self.what);
        for Row { number, num_parts, found, seconds } in &self.rows {
            let [free, fixed] = seconds.map(|seconds| format!("{:.1} ms", 1e3 * seconds));
            let found = format!("{} and {} of {num_parts}", found[0], found[1]);
            let _ = writeln!(text, "| {number:.0} | {free} | {fixed} | {found} |");
        }
        let told = |read: &dyn Fn(usize) -> Option<f64>| {
            [0, 1].map(|which| read(which).map_or("?".to_owned(), |exponent| format!("{exponent:.2}")))
        };
        let [free, fixed] = told(&|which| self.exponent(which));
        let _ = writeln!(text, "| exponent, first to last | {free} | {fixed} | |");
        let [free, fixed] = told(&|which| self.steepest(which));
        let _ = writeln!(text, "| exponent, steepest step | {free} | {fixed} | |");
        text
    }
}

fn exponent(from: &Row, to: &Row, which: usize) -> Option<f64> {
    let exponent = (to.seconds[which] / from.seconds[which]).ln() / (to.number / from.number).ln();
    exponent.is_finite().then_some(exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_by_hand() {
        let row = |number: f64, free: f64| Ok(Row { number, num_parts: 1, found: [1, 1], seconds: [free, 0.01] });
        // The number grows fourfold twice: the time stays the same, then also grows fourfold.
        let curve = Curve::new("pixels", [row(100.0, 0.1), row(400.0, 0.1), row(1600.0, 0.4)].into_iter()).unwrap();
        let (whole, steepest) = (curve.exponent(0).unwrap(), curve.steepest(0).unwrap());
        assert!((whole - 0.5).abs() < 1e-12 && (steepest - 1.0).abs() < 1e-12, "{whole} {steepest}");
        let text = curve.markdown();
        assert!(text.contains("| 400 | 100.0 ms | 10.0 ms | 1 and 1 of 1 |"), "{text}");
        assert!(text.contains("| exponent, first to last | 0.50 | 0.00 | |"), "{text}");
    }
}
