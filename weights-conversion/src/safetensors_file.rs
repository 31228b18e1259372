//! The safetensors format: a length, a JSON header, and bytes.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, Visitor};

use crate::element::ElementType;
use crate::error::{Result, WeightsError, printable};
use crate::source::{Source, Span};
use crate::tensor::{Encoding, Payload, StoredTensor};

/// Maximum size of a header; a detector's header has about 50 kB. After parsing, an array such as `[0,0,…]` takes about
/// ten times as much memory as its text.
const MAX_HEADER_BYTES: u64 = 4 << 20;

/// Tensors by name, and metadata by name.
pub(crate) type Content = (BTreeMap<String, StoredTensor>, BTreeMap<String, String>);

#[derive(Default)]
struct Header {
    metadata: BTreeMap<String, String>,
    tensors: BTreeMap<String, TensorHeader>,
}

#[derive(Deserialize)]
struct TensorHeader {
    dtype: String,
    shape: Vec<usize>,
    data_offsets: [u64; 2],
}

impl<'de> Deserialize<'de> for Header {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_map(HeaderVisitor)
    }
}

/// Reads the entries one by one: serde's combination of fixed and free keys would store the header a second time.
struct HeaderVisitor;

impl<'de> Visitor<'de> for HeaderVisitor {
    type Value = Header;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object of tensors")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Header, A::Error> {
        let mut header = Header::default();
        while let Some(name) = map.next_key::<String>()? {
            if name == "__metadata__" {
                header.metadata = map.next_value()?;
            } else if header.tensors.insert(name, map.next_value()?).is_some() {
                return Err(de::Error::custom("expected each name once"));
            }
        }
        Ok(header)
    }
}

fn damaged(part: impl fmt::Display, expected: impl Into<String>, found: impl Into<String>) -> WeightsError {
    WeightsError::damaged(format!("safetensors file, {part}"), expected, found)
}

/// Whether bytes start like a safetensors file of `len` bytes.
pub(crate) fn is_safetensors(start: &[u8], len: u64) -> bool {
    match start.split_first_chunk::<8>() {
        Some((header_len, rest)) => rest.first() == Some(&b'{') && u64::from_le_bytes(*header_len) <= len - 8,
        None => false,
    }
}

/// Reads the header; the tensors' bytes stay in the file.
///
/// # Errors
/// A header that is too large, is not JSON of that form, or does not match the file's bytes.
pub(crate) fn read(source: &mut Source) -> Result<Content> {
    let mut header_len = [0; 8];
    source.read_at(0, &mut header_len)?;
    let header_len = u64::from_le_bytes(header_len);
    if header_len > MAX_HEADER_BYTES {
        let what = "bytes of the safetensors header".to_owned();
        return Err(WeightsError::TooLarge { what, most: MAX_HEADER_BYTES, found: header_len });
    }
    let header = source.read_span(Span { offset: 8, len: header_len })?;
    let header: Header = serde_json::from_slice(&header)
        .map_err(|error| damaged("header", "JSON of names, types, shapes and places", error.to_string()))?;
    let data = Span { offset: 8 + header_len, len: source.len() - 8 - header_len };

    let mut places: Vec<[u64; 2]> = header.tensors.values().map(|tensor| tensor.data_offsets).collect();
    places.sort_unstable();
    let mut end = 0;
    for [start, stop] in places {
        if start != end || stop < start {
            return Err(damaged("header", format!("a tensor from byte {end} on"), format!("{start} to {stop}")));
        }
        end = stop;
    }
    if end != data.len {
        return Err(damaged("data", format!("{end} bytes"), format!("{} bytes", data.len)));
    }

    let mut tensors = BTreeMap::new();
    for (name, tensor) in header.tensors {
        let part = printable(&name);
        let Some(element) = ElementType::from_name(&tensor.dtype) else {
            let expected = "an element type F64, F32, F16, BF16, I64, I32, I16, I8, U8 or BOOL";
            return Err(damaged(part, expected, printable(&tensor.dtype)));
        };
        let [start, stop] = tensor.data_offsets;
        let span = Span { offset: data.offset + start, len: stop - start };
        let payload = Payload { span, encoding: Encoding::Raw };
        tensors.insert(name, StoredTensor::dense(&part, tensor.shape, false, element, payload)?);
    }
    Ok((tensors, header.metadata))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Source {
        Source::from_bytes([&(header.len() as u64).to_le_bytes(), header.as_bytes(), data].concat())
    }

    #[test]
    fn a_file_by_hand() {
        let header = r#"{"__metadata__":{"a":"b"},"w":{"dtype":"F16","shape":[2],"data_offsets":[0,4]}}"#;
        let mut source = file(header, &[0, 0x3c, 0, 0xc0]);
        let (tensors, metadata) = read(&mut source).unwrap();
        assert_eq!(tensors["w"].values(&mut source).unwrap(), [1.0, -2.0]);
        assert_eq!(metadata["a"], "b");
    }

    #[test]
    fn a_longer_header_than_any_file_has_is_refused_before_it_is_read() {
        let padded = |len: u64| {
            let header = "{}".to_owned() + &" ".repeat(len as usize - 2);
            read(&mut file(&header, &[])).map(|(tensors, _)| tensors.len())
        };
        assert_eq!(padded(MAX_HEADER_BYTES).unwrap(), 0);
        let refused = padded(MAX_HEADER_BYTES + 1).unwrap_err().to_string();
        assert!(refused.contains("bytes of the safetensors header"), "{refused}");
    }

    #[test]
    fn holes_overlaps_and_lies_are_errors() {
        for (header, data) in [
            (r#"{"w":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}}"#, 8),
            (r#"{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}"#, 8),
            (r#"{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,8]}}"#, 8),
            (
                r#"{"w":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},"v":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}}"#,
                8,
            ),
            (r#"{"w":{"dtype":"F32","shape":[4294967296,4294967296,16],"data_offsets":[0,8]}}"#, 8),
            (r#"{"w":{"dtype":"F32","shape":[-1],"data_offsets":[0,8]}}"#, 8),
            (r#"{"w":{"dtype":"O8","shape":[1],"data_offsets":[0,8]}}"#, 8),
            (r#"{"w":{"dtype":"F64","shape":[1],"data_offsets":[8,0]}}"#, 8),
        ] {
            assert!(read(&mut file(header, &vec![0; data])).is_err(), "{header}");
        }
    }
}
