//! NumPy's `.npy`: arrays of plain numbers, read in place.
//!
//! # Source
//! NumPy Enhancement Proposal 1 and `numpy.lib.format`: versions 1 to 3.

use crate::{Error, Result};

const MAGIC: &[u8] = b"\x93NUMPY";
/// More dimensions than annotations have.
const MAX_DIMENSIONS: usize = 8;

pub(crate) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// An array in the bytes of its file. Nothing is allocated for its elements, so that a false header costs nothing.
#[derive(Debug)]
pub(crate) struct NpyArray<'a> {
    pub shape: Vec<usize>,
    dtype: Dtype,
    column_major: bool,
    elements: &'a [u8],
}

#[derive(Debug, Clone, Copy)]
struct Dtype {
    kind: Kind,
    big_endian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    F32,
    F64,
    I32,
    I64,
}

impl Dtype {
    fn parse(descr: &str) -> Option<Self> {
        let kind = match descr.trim_start_matches(['<', '>', '=', '|']) {
            "f4" => Kind::F32,
            "f8" => Kind::F64,
            "i4" => Kind::I32,
            "i8" => Kind::I64,
            _ => return None,
        };
        Some(Self { kind, big_endian: descr.starts_with('>') })
    }

    fn size(self) -> usize {
        match self.kind {
            Kind::F32 | Kind::I32 => 4,
            Kind::F64 | Kind::I64 => 8,
        }
    }

    fn number(self, bytes: &[u8]) -> f64 {
        let mut little = [0; 8];
        let size = self.size();
        little[..size].copy_from_slice(&bytes[..size]);
        if self.big_endian {
            little[..size].reverse();
        }
        let word = u64::from_le_bytes(little);
        match self.kind {
            Kind::F32 => f64::from(f32::from_bits(word as u32)),
            Kind::F64 => f64::from_bits(word),
            Kind::I32 => f64::from(word as u32 as i32),
            Kind::I64 => word as i64 as f64,
        }
    }
}

impl<'a> NpyArray<'a> {
    /// Reads the header and checks that exactly its elements follow; `name` is used in errors.
    pub fn parse(bytes: &'a [u8], name: &str) -> Result<Self> {
        let malformed = |expected: &str, found: String| Error::Malformed {
            place: name.to_owned(),
            expected: expected.to_owned(),
            found,
        };
        let truncated = || malformed("a whole .npy file", format!("{} bytes, cut off in the header", bytes.len()));
        let version = *bytes.get(MAGIC.len()).filter(|_| is_npy(bytes)).ok_or_else(truncated)?;
        let length_bytes = match version {
            1 => 2,
            2 | 3 => 4,
            other => return Err(malformed("a .npy file of version 1, 2 or 3", format!("version {other}"))),
        };
        // After the magic number come two bytes of version.
        let start = MAGIC.len() + 2;
        let mut length = [0; 4];
        length[..length_bytes].copy_from_slice(bytes.get(start..start + length_bytes).ok_or_else(truncated)?);
        let header_start = start + length_bytes;
        let header_end = header_start.saturating_add(u32::from_le_bytes(length) as usize);
        let header = bytes.get(header_start..header_end).ok_or_else(truncated)?;
        let header = std::str::from_utf8(header).map_err(|_| malformed("a header of text", "other bytes".into()))?;

        let descr = value_of(header, "descr").unwrap_or_default();
        let dtype = Dtype::parse(descr.trim_matches(['\'', '"'])).ok_or_else(|| {
            let found = if descr.is_empty() { "none" } else { descr };
            malformed("numbers of type f4, f8, i4 or i8", crate::json::shorten(found))
        })?;
        let column_major = match value_of(header, "fortran_order") {
            Some("True") => true,
            Some("False") => false,
            other => {
                return Err(malformed("fortran_order True or False", crate::json::shorten(other.unwrap_or("none"))));
            }
        };
        let shape_text = value_of(header, "shape").unwrap_or_default();
        let shape: Option<Vec<usize>> = shape_text
            .strip_prefix('(')
            .and_then(|rest| rest.strip_suffix(')'))
            .map(|inside| inside.split(',').map(str::trim).filter(|side| !side.is_empty()).collect::<Vec<_>>())
            .filter(|sides| sides.len() <= MAX_DIMENSIONS)
            .and_then(|sides| sides.iter().map(|side| side.parse().ok()).collect());
        let shape = shape.ok_or_else(|| malformed("a shape such as (1500, 4)", crate::json::shorten(shape_text)))?;

        let elements = &bytes[header_end..];
        let expected = shape.iter().try_fold(dtype.size(), |size, &side| size.checked_mul(side));
        if expected != Some(elements.len()) {
            let expected = expected.map_or("more than any file has".to_owned(), |bytes| format!("{bytes} bytes"));
            return Err(malformed(
                &format!("{expected} of numbers for the shape {shape_text}"),
                format!("{} bytes", elements.len()),
            ));
        }
        Ok(Self { shape, dtype, column_major, elements })
    }

    /// The element at an index with one number per dimension. Panics outside the array.
    pub fn at(&self, index: &[usize]) -> f64 {
        assert_eq!(index.len(), self.shape.len(), "one number for each dimension");
        let mut position = 0;
        let step = |position: &mut usize, axis: usize| {
            assert!(index[axis] < self.shape[axis], "index {index:?} in an array of {:?}", self.shape);
            *position = *position * self.shape[axis] + index[axis];
        };
        if self.column_major {
            (0..index.len()).rev().for_each(|axis| step(&mut position, axis));
        } else {
            (0..index.len()).for_each(|axis| step(&mut position, axis));
        }
        self.dtype.number(&self.elements[position * self.dtype.size()..])
    }
}

/// The value of a key in the header's dictionary: up to the comma or brace outside parentheses and brackets.
fn value_of<'h>(header: &'h str, key: &str) -> Option<&'h str> {
    let quoted = [format!("'{key}'"), format!("\"{key}\"")];
    let (_, after) = quoted.iter().find_map(|quoted| header.split_once(quoted.as_str()))?;
    let value = after.trim_start().strip_prefix(':')?;
    let mut depth = 0i32;
    let end = value.find(|character| {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' | '}' => return depth <= 0,
            _ => {}
        }
        false
    })?;
    Some(value[..end].trim())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A file of version 1.
    pub fn file(descr: &str, order: &str, shape: &str, elements: &[u8]) -> Vec<u8> {
        let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.extend(elements);
        bytes
    }

    #[test]
    fn both_byte_orders_and_both_array_orders() {
        let little: Vec<u8> = [1.5f32, 2.5, 3.5, 4.5, 5.5, 6.5].iter().flat_map(|v| v.to_le_bytes()).collect();
        let bytes = file("'<f4'", "False", "(2, 3)", &little);
        let rows = NpyArray::parse(&bytes, "a").unwrap();
        assert_eq!((rows.at(&[0, 1]), rows.at(&[1, 0])), (2.5, 4.5));
        let bytes = file("'<f4'", "True", "(2, 3)", &little);
        let columns = NpyArray::parse(&bytes, "a").unwrap();
        assert_eq!((columns.at(&[0, 1]), columns.at(&[1, 0])), (3.5, 2.5));
        let big: Vec<u8> = [-7i64, 8].iter().flat_map(|v| v.to_be_bytes()).collect();
        let bytes = file("'>i8'", "False", "(2,)", &big);
        let numbers = NpyArray::parse(&bytes, "a").unwrap();
        assert_eq!((numbers.at(&[0]), numbers.at(&[1])), (-7.0, 8.0));
    }

    #[test]
    fn each_fault_is_named() {
        let good = file("'<f8'", "False", "(1, 4)", &[0; 32]);
        let message = |bytes: &[u8]| NpyArray::parse(bytes, "boxes").unwrap_err().to_string();
        for (bytes, expected) in [
            (good[..7].to_vec(), "cut off in the header"),
            (good[..30].to_vec(), "cut off in the header"),
            (good[..good.len() - 1].to_vec(), "expected 32 bytes of numbers for the shape (1, 4), found 31 bytes"),
            (file("'<f8'", "False", "(4000000000, 4)", &[0; 32]), "expected 128000000000 bytes"),
            (file("'<f8'", "False", "(9223372036854775807, 4)", &[]), "more than any file has"),
            (file("'<f8'", "False", "(-1, 4)", &[]), "a shape such as"),
            (file("'<f8'", "False", "(1, 1, 1, 1, 1, 1, 1, 1, 1)", &[0; 8]), "a shape such as"),
            (file("'|O'", "False", "(1, 4)", &[]), "expected numbers of type f4, f8, i4 or i8, found '|O'"),
            (file("[('x', '<f4'), ('y', '<f4')]", "False", "(1,)", &[0; 8]), "numbers of type"),
            (file("'<f8'", "Maybe", "(1,)", &[0; 8]), "fortran_order"),
            (b"\x93NUMPY\x09\x00\x00\x00".to_vec(), "version 9"),
        ] {
            let message = message(&bytes);
            assert!(message.contains("boxes") && message.contains(expected), "expected `{expected}` in `{message}`");
        }
    }

    proptest! {
        #[test]
        fn mutated_files_never_panic(at in 0usize..120, byte in any::<u8>(), cut in 0usize..140) {
            let mut bytes = file("'<f8'", "False", "(2, 4)", &[0; 64]);
            if let Some(slot) = bytes.get_mut(at) {
                *slot = byte;
            }
            bytes.truncate(cut);
            if let Ok(array) = NpyArray::parse(&bytes, "a") {
                prop_assert!(array.shape.len() <= MAX_DIMENSIONS);
            }
        }
    }
}
