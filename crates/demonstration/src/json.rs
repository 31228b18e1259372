//! A JSON value with its position in the file, so that an error can name it.

use serde_json::{Map, Value};

use crate::{Error, Result};

/// A value and the path to it.
#[derive(Clone)]
pub(crate) struct Node<'a> {
    pub value: &'a Value,
    pub place: String,
}

/// Maximum number of objects: twice that of the labels of COCO. Each takes about 700 bytes of memory, a
/// hundred times its length in a file of small objects.
const MAX_OBJECTS: usize = 2_000_000;

/// Parses the bytes; errors give line and column.
pub(crate) fn parse(bytes: &[u8]) -> Result<Value> {
    parse_within(bytes, MAX_OBJECTS)
}

fn parse_within(bytes: &[u8], max_objects: usize) -> Result<Value> {
    // Braces in texts count as well: a limit needs no exact number.
    let braces = bytes.iter().filter(|byte| **byte == b'{').count();
    if braces > max_objects {
        let expected = format!("at most {max_objects} objects");
        return Err(Error::Malformed { place: "the file".into(), expected, found: braces.to_string() });
    }
    // Windows editors often start with a byte order mark, which the parser does not accept.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let parsed = serde_json::from_slice(bytes);
    // The values of `area` are not used, so invalid ones are replaced instead of refused.
    let parsed = parsed.or_else(|error| match without_area_literals(bytes) {
        Some(patched) => serde_json::from_slice(&patched),
        None => Err(error),
    });
    parsed.map_err(|error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        let line = bytes.split(|&b| b == b'\n').nth(error.line().saturating_sub(1)).unwrap_or(&[]);
        let rest = &line[error.column().saturating_sub(1).min(line.len())..];
        // Python writes these three literals, which JSON does not have.
        let literal = ["NaN", "Infinity", "-Infinity"].into_iter().find(|literal| {
            // The parser stops at the literal, or one byte into `-Infinity`.
            rest.starts_with(literal.as_bytes()) || rest.starts_with(literal.trim_start_matches('-').as_bytes())
        });
        match literal {
            Some(found) => Error::NotFinite { place, found: found.into() },
            None if error.to_string().starts_with("number out of range") => {
                Error::NotFinite { place, found: "a number too large for 64 bits".into() }
            }
            None if bytes.is_empty() => Error::NotJson { place, reason: "the file is empty".into() },
            None => Error::NotJson { place, reason: error.to_string() },
        }
    })
}

/// The text with each `area` that is Python's NaN or infinity replaced by a 0 and blanks, of unchanged length; `None`
/// if there is no such area.
fn without_area_literals(bytes: &[u8]) -> Option<Vec<u8>> {
    const KEY: &[u8] = b"\"area\"";
    let mut patched: Option<Vec<u8>> = None;
    let mut at = 0;
    while let Some(key) = bytes[at..].windows(KEY.len()).position(|window| window == KEY) {
        at += key + KEY.len();
        let blanks = bytes[at..].iter().take_while(|byte| byte.is_ascii_whitespace() || **byte == b':').count();
        let value = at + blanks;
        let literals: [&[u8]; 3] = [b"NaN", b"Infinity", b"-Infinity"];
        if let Some(literal) = literals.into_iter().find(|literal| bytes[value..].starts_with(literal)) {
            let place = &mut patched.get_or_insert_with(|| bytes.to_vec())[value..value + literal.len()];
            place.fill(b' ');
            place[0] = b'0';
        }
    }
    patched
}

impl<'a> Node<'a> {
    pub fn root(value: &'a Value) -> Self {
        Self { value, place: String::new() }
    }

    pub fn malformed(&self, expected: impl Into<String>) -> Error {
        Error::Malformed { place: self.place.clone(), expected: expected.into(), found: describe(self.value) }
    }

    pub fn object(&self) -> Result<&'a Map<String, Value>> {
        self.value.as_object().ok_or_else(|| self.malformed("an object"))
    }

    /// The field; absent and `null` both give `None`.
    pub fn optional(&self, name: &str) -> Result<Option<Self>> {
        let place = if self.place.is_empty() { name.to_string() } else { format!("{}.{name}", self.place) };
        let value = self.object()?.get(name).filter(|value| !value.is_null());
        Ok(value.map(|value| Self { value, place }))
    }

    pub fn field(&self, name: &str, expected: &str) -> Result<Self> {
        self.optional(name)?.ok_or_else(|| Error::Malformed {
            place: self.place.clone(),
            expected: format!("a field `{name}`: {expected}"),
            found: format!("fields {}", key_list(self.value)),
        })
    }

    pub fn items(&self) -> Result<Vec<Self>> {
        let items = self.value.as_array().ok_or_else(|| self.malformed("a list"))?;
        Ok(items.iter().enumerate().map(|(i, value)| Self { value, place: format!("{}[{i}]", self.place) }).collect())
    }

    pub fn number(&self) -> Result<f64> {
        let number = self.value.as_f64().ok_or_else(|| self.malformed("a number"))?;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(Error::NotFinite { place: self.place.clone(), found: number.to_string() })
        }
    }

    pub fn numbers(&self) -> Result<Vec<f64>> {
        self.items()?.iter().map(Self::number).collect()
    }

    pub fn text(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.malformed("text"))
    }

    /// A size in pixels.
    pub fn pixels(&self) -> Result<u32> {
        let number = self.number()?;
        if number.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&number) {
            Ok(number as u32)
        } else {
            Err(self.malformed("a positive whole number of pixels"))
        }
    }
}

/// A short text form of a value.
pub(crate) fn describe(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(value) => value.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => format!("the text {:?}", shorten(text)),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(_) => format!("an object with {}", key_list(value)),
    }
}

fn key_list(value: &Value) -> String {
    const SHOWN: usize = 8;
    let Some(object) = value.as_object() else { return describe(value) };
    let mut names: Vec<String> = object.keys().take(SHOWN).map(|key| format!("`{}`", shorten(key))).collect();
    if object.is_empty() {
        return "none".into();
    }
    if object.len() > SHOWN {
        names.push("…".into());
    }
    names.join(", ")
}

/// Shortens a text of a file to a readable length, for messages.
pub(crate) fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST { text.to_string() } else { text.chars().take(LONGEST).chain(['…']).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_too_many_objects_is_refused_before_it_is_parsed() {
        let list = |count: usize| format!("[{}{{}}]", "{},".repeat(count - 1));
        assert_eq!(parse_within(list(9).as_bytes(), 9).unwrap().as_array().unwrap().len(), 9);
        let error = parse_within(list(10).as_bytes(), 9).unwrap_err().to_string();
        assert!(error.ends_with("expected at most 9 objects, found 10"), "{error}");
        // The limit is checked before parsing: this text is not JSON.
        assert!(parse(&b"[{},".repeat(MAX_OBJECTS + 1)).unwrap_err().to_string().contains("2000000 objects"));
    }
}
