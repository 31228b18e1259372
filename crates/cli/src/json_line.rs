//! Results on standard output, as JSON or in words.

use std::io;

use serde::Serialize;
use serde_json::ser::{CompactFormatter, Formatter};

/// Six decimals: a millionth of a metre, pixel, degree or second is below the accuracy of every printed value.
const ROUND_TO: f64 = 1e6;
/// Larger numbers are written as they are: their own precision is about a millionth, or lower.
const MAX_ROUNDED: f64 = 4e9;

/// A line of compact JSON without a line end; numbers below [`MAX_ROUNDED`] have at most six decimals.
///
/// # Errors
/// The value cannot be serialised.
pub fn json_line<T: Serialize>(value: &T) -> serde_json::Result<String> {
    let mut line = Vec::new();
    value.serialize(&mut serde_json::Serializer::with_formatter(&mut line, Rounded))?;
    Ok(String::from_utf8_lossy(&line).into_owned())
}

/// Prints a line of a result in words: on standard output, or on standard error if standard output has JSON.
pub fn tell(is_json: bool, line: &str) {
    if is_json {
        eprintln!("{line}");
    } else {
        println!("{line}");
    }
}

struct Rounded;

impl Formatter for Rounded {
    fn write_f32<W: io::Write + ?Sized>(&mut self, writer: &mut W, value: f32) -> io::Result<()> {
        self.write_f64(writer, f64::from(value))
    }

    fn write_f64<W: io::Write + ?Sized>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        let rounded = if value.abs() < MAX_ROUNDED { (value * ROUND_TO).round() / ROUND_TO } else { value };
        // A small negative number is rounded to negative zero; adding zero makes it positive zero.
        CompactFormatter.write_f64(writer, rounded + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_have_at_most_six_digits_after_the_point() {
        let value =
            json!({"x": 1.0 / 3.0, "y": -1e-9, "z": 320.5, "captured": 1_764_170_000.123_456_7, "n": 3, "no": null});
        let line = json_line(&value).unwrap();
        assert_eq!(line, r#"{"captured":1764170000.123457,"n":3,"no":null,"x":0.333333,"y":0.0,"z":320.5}"#);
        assert_eq!(json_line(&[0.1_f32]).unwrap(), "[0.1]");
    }
}
