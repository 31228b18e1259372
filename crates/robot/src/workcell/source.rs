//! The text of a workcell file: converts positions to line numbers, and reads numbers and ranges.

use serde::Deserialize;
use toml::Spanned;

use super::error::WorkcellError;

/// Largest reach of an arm, mm.
pub(super) const MAX_REACH_MM: f64 = 1500.0;
/// Minimum width of a workspace or table, mm.
const MIN_RANGE_MM: f64 = 10.0;
/// Minimum absolute value of a length other than 0, mm: a smaller one was probably given in metres.
const MIN_LENGTH_MM: f64 = 0.1;
/// Ends the errors of such lengths.
pub(super) const METRES: &str = ": metres given as millimetres?";

/// Exactly this many numbers; serde's own arrays ignore further ones.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub(super) struct Numbers<const N: usize>(pub(super) [f64; N]);

impl<const N: usize> TryFrom<Vec<f64>> for Numbers<N> {
    type Error = String;

    fn try_from(found: Vec<f64>) -> Result<Self, String> {
        let count = found.len();
        found.try_into().map(Self).map_err(|_| format!("expected {N} numbers, found {count}"))
    }
}

/// The text, for converting positions to line numbers.
pub(super) struct Source<'t>(pub(super) &'t str);

impl Source<'_> {
    pub(super) fn error(&self, at: usize, what: impl Into<String>) -> WorkcellError {
        let end = at.min(self.0.len());
        let line = 1 + self.0.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count();
        WorkcellError { line, what: what.into() }
    }

    pub(super) fn expected<T>(
        &self,
        place: &Spanned<T>,
        name: &str,
        expected: &str,
        found: impl std::fmt::Display,
    ) -> WorkcellError {
        self.error(place.span().start, format!("{name}: expected {expected}, found {found}"))
    }

    pub(super) fn number(&self, value: &Spanned<f64>, name: &str, [min, max]: [f64; 2]) -> Result<f64, WorkcellError> {
        let found = *value.get_ref();
        if (min..=max).contains(&found) {
            return Ok(found);
        }
        Err(self.expected(value, name, &format!("a number from {min} to {max}"), found))
    }

    /// A length, at least [`MIN_LENGTH_MM`] if it is not 0.
    pub(super) fn length_mm(&self, value: &Spanned<f64>, name: &str, range: [f64; 2]) -> Result<f64, WorkcellError> {
        let found = self.number(value, name, range)?;
        if found != 0.0 && found.abs() < MIN_LENGTH_MM {
            return Err(self.expected(value, name, "millimetres", format!("{found}{METRES}")));
        }
        Ok(found)
    }

    pub(super) fn range_m(&self, value: &Spanned<Numbers<2>>, name: &str) -> Result<[f64; 2], WorkcellError> {
        let Numbers([min, max]) = *value.get_ref();
        if min < max && max - min < MIN_RANGE_MM {
            let expected = format!("[smallest, largest] in mm, at least {MIN_RANGE_MM} apart");
            return Err(self.expected(value, name, &expected, format!("[{min}, {max}]{METRES}")));
        }
        if min < max && min >= -MAX_REACH_MM && max <= MAX_REACH_MM {
            return Ok([min * 1e-3, max * 1e-3]);
        }
        let expected = format!("[smallest, largest] in mm, within {MAX_REACH_MM} of the base");
        Err(self.expected(value, name, &expected, format!("[{min}, {max}]")))
    }
}
