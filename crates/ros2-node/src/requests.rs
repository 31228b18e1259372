//! Optional numbers of requests: a message has no other way than 0 to leave a number out.

use anyhow::{Result, bail};

/// A number above 0 in a request; `None` for 0, which stands for the default.
///
/// # Errors
/// A negative number, NaN or infinity.
pub(super) fn given(name: &str, value: f64) -> Result<Option<f64>> {
    if value == 0.0 {
        return Ok(None);
    }
    if !(value > 0.0 && value.is_finite()) {
        bail!("{name}: expected a number above 0, or 0 for the default, found {value}");
    }
    Ok(Some(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_0_stands_for_the_default() {
        assert_eq!(given("speed", 0.0).unwrap(), None);
        assert_eq!(given("speed", 0.1).unwrap(), Some(0.1));
        for value in [-0.5, f64::NAN, f64::INFINITY] {
            let error = given("speed", value).unwrap_err().to_string();
            let expected = format!("speed: expected a number above 0, or 0 for the default, found {value}");
            assert_eq!(error, expected);
        }
    }
}
