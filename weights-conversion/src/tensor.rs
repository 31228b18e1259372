//! A tensor in a checkpoint: shape, strides, element type, and the position of its bytes.

use crate::element::ElementType;
use crate::error::{Result, WeightsError};
use crate::source::{Source, Span};

/// Maximum number of axes, more than any layer has.
const MAX_AXES: usize = 8;
/// Bytes decoded at once; a multiple of every element's size.
const PIECE: usize = 1 << 20;

/// The encoding of a tensor's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Unchanged.
    Raw,
    /// Each byte as the character of that number, in UTF-8, as Python 3 pickles bytes under protocol 2.
    Latin1,
}

/// A span of the file and its encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Payload {
    pub span: Span,
    pub encoding: Encoding,
}

/// A tensor of a checkpoint; its values are still in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTensor {
    shape: Vec<usize>,
    /// Number of elements from one index to the next, along each axis.
    strides: Vec<usize>,
    element: ElementType,
    payload: Payload,
}

/// The product of sizes, unless it overflows.
fn product(sizes: &[usize]) -> Option<usize> {
    sizes.iter().try_fold(1usize, |product, size| product.checked_mul(*size))
}

/// Strides of a tensor whose last axis is the innermost.
fn row_major(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1usize; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis].saturating_mul(shape[axis].max(1));
    }
    strides
}

impl StoredTensor {
    /// A dense tensor, last axis innermost (first if `fortran_order`), that fills its payload.
    pub(crate) fn dense(
        part: &str,
        shape: Vec<usize>,
        fortran_order: bool,
        element: ElementType,
        payload: Payload,
    ) -> Result<Self> {
        let bytes = checked_bytes(part, &shape, element)?;
        let fits = match payload.encoding {
            Encoding::Raw => payload.span.len == bytes,
            // A character takes one or two bytes.
            Encoding::Latin1 => (bytes..=2 * bytes).contains(&payload.span.len),
        };
        if !fits {
            let expected = format!("{bytes} bytes for shape {shape:?} of {}", element.name());
            return Err(WeightsError::damaged(part, expected, format!("{} bytes", payload.span.len)));
        }
        let strides = if fortran_order {
            let mut reversed = row_major(&shape.iter().rev().copied().collect::<Vec<_>>());
            reversed.reverse();
            reversed
        } else {
            row_major(&shape)
        };
        Ok(Self { shape, strides, element, payload })
    }

    /// A view into a storage of raw elements.
    pub(crate) fn view(
        part: &str,
        shape: Vec<usize>,
        strides: Vec<usize>,
        first_element: u64,
        element: ElementType,
        storage: Span,
    ) -> Result<Self> {
        let damaged = |expected: String, found: String| WeightsError::damaged(part, expected, found);
        checked_bytes(part, &shape, element)?;
        if strides.len() != shape.len() {
            return Err(damaged(format!("{} strides", shape.len()), format!("{strides:?}")));
        }
        let count = product(&shape).unwrap_or(0) as u64;
        let size = element.size() as u64;
        // Number of elements from the first to the last one of the view, including both.
        let extent = if count == 0 {
            Some(0)
        } else {
            shape.iter().zip(&strides).try_fold(1u64, |extent, (size, stride)| {
                extent.checked_add((*size as u64 - 1).checked_mul(*stride as u64)?)
            })
        };
        let available = (storage.len / size).checked_sub(first_element);
        let (Some(extent), Some(available)) = (extent, available) else {
            let found = format!("shape {shape:?}, strides {strides:?}, first element {first_element}");
            return Err(damaged(format!("a view into {} bytes", storage.len), found));
        };
        // A view that repeats elements would represent more than the file contains.
        if extent > available || count > extent {
            let found = format!("shape {shape:?}, strides {strides:?}");
            return Err(damaged(format!("a view of {available} elements, each at most once"), found));
        }
        let span = Span { offset: storage.offset + first_element * size, len: extent * size };
        Ok(Self { shape, strides, element, payload: Payload { span, encoding: Encoding::Raw } })
    }

    /// Sizes, outermost first.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Element type in the file.
    pub fn element(&self) -> ElementType {
        self.element
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        product(&self.shape).unwrap_or(0)
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn is_row_major(&self) -> bool {
        // The stride of an axis of size 1 is never used.
        let expected = row_major(&self.shape);
        self.shape
            .iter()
            .zip(self.strides.iter().zip(&expected))
            .all(|(size, (found, want))| *size == 1 || found == want)
    }

    /// Reads all values, last axis innermost.
    ///
    /// # Errors
    /// Elements that are not floats and therefore not weights; missing bytes.
    pub fn values(&self, source: &mut Source) -> Result<Vec<f32>> {
        self.check_float()?;
        self.numbers(source)
    }

    /// Like [`Self::values`], also for integers, such as the classes in a reference's outputs.
    ///
    /// # Errors
    /// Missing bytes.
    pub fn numbers(&self, source: &mut Source) -> Result<Vec<f32>> {
        let mut values = Vec::with_capacity(self.len());
        self.stream(source, |piece| {
            values.extend_from_slice(piece);
            Ok(())
        })?;
        Ok(values)
    }

    /// Passes the values in order, last axis innermost, in pieces.
    pub(crate) fn stream(&self, source: &mut Source, mut take: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        if self.is_row_major() {
            let mut seen = 0;
            self.stream_payload(source, |piece| {
                seen += piece.len();
                take(piece)
            })?;
            return self.check_count(seen);
        }
        let mut stored = Vec::new();
        self.stream_payload(source, |piece| {
            stored.extend_from_slice(piece);
            Ok(())
        })?;
        let extent = 1 + self.shape.iter().zip(&self.strides).map(|(size, stride)| (size - 1) * stride).sum::<usize>();
        if stored.len() < extent {
            return self.check_count(stored.len());
        }
        self.gather(&stored, take)
    }

    fn check_float(&self) -> Result<()> {
        if self.element.is_float() {
            return Ok(());
        }
        Err(WeightsError::damaged("a weight", "F64, F32, F16 or BF16 elements", self.element.name()))
    }

    fn check_count(&self, found: usize) -> Result<()> {
        if found == self.len() {
            return Ok(());
        }
        let expected = format!("{} elements for shape {:?}", self.len(), self.shape);
        Err(WeightsError::damaged("a tensor", expected, found.to_string()))
    }

    /// Passes the values row by row, the last axis fastest.
    fn gather(&self, stored: &[f32], mut take: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
        let Some((&inner_size, outer_shape)) = self.shape.split_last() else {
            return take(&stored[..1]);
        };
        let inner_stride = self.strides[outer_shape.len()];
        let mut index = vec![0usize; outer_shape.len()];
        let mut row = vec![0f32; inner_size];
        for _ in 0..self.len() / inner_size {
            let first: usize = index.iter().zip(&self.strides).map(|(i, stride)| i * stride).sum();
            for (i, value) in row.iter_mut().enumerate() {
                *value = stored[first + i * inner_stride];
            }
            take(&row)?;
            for (axis, position) in index.iter_mut().enumerate().rev() {
                *position += 1;
                if *position < outer_shape[axis] {
                    break;
                }
                *position = 0;
            }
        }
        Ok(())
    }

    /// The payload's elements in the order of the file.
    fn stream_payload(&self, source: &mut Source, mut take: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
        let mut values = Vec::new();
        let mut bytes = Vec::new();
        let mut decoder = Latin1Decoder::default();
        source.read_pieces(self.payload.span, PIECE, |piece| {
            values.clear();
            match self.payload.encoding {
                Encoding::Raw => self.element.decode(piece, &mut values),
                Encoding::Latin1 => {
                    decoder.decode(piece, &mut bytes)?;
                    let whole = bytes.len() - bytes.len() % self.element.size();
                    self.element.decode(&bytes[..whole], &mut values);
                    bytes.drain(..whole);
                }
            }
            take(&values)
        })?;
        if decoder.first_half.is_some() || !bytes.is_empty() {
            return Err(WeightsError::damaged("a tensor", "whole elements", "a part of one at the end"));
        }
        Ok(())
    }
}

/// Bytes of a dense tensor, unless no file could contain the shape.
fn checked_bytes(part: &str, shape: &[usize], element: ElementType) -> Result<u64> {
    if shape.len() > MAX_AXES {
        return Err(WeightsError::TooLarge {
            what: format!("{part}: axes"),
            most: MAX_AXES as u64,
            found: shape.len() as u64,
        });
    }
    let bytes = product(shape).and_then(|count| count.checked_mul(element.size())).filter(|bytes| *bytes < 1 << 48);
    let Some(bytes) = bytes else {
        return Err(WeightsError::damaged(part, "a shape that fits into memory", format!("{shape:?}")));
    };
    Ok(bytes as u64)
}

/// Decodes UTF-8 back to the encoded bytes, across pieces.
#[derive(Debug, Default)]
struct Latin1Decoder {
    /// The first byte of a character of two bytes.
    first_half: Option<u8>,
}

impl Latin1Decoder {
    fn decode(&mut self, utf8: &[u8], bytes: &mut Vec<u8>) -> Result<()> {
        for &byte in utf8 {
            match (self.first_half.take(), byte) {
                (None, 0..0x80) => bytes.push(byte),
                (None, 0xc2 | 0xc3) => self.first_half = Some(byte),
                (Some(first), 0x80..0xc0) => bytes.push((first & 3) << 6 | byte & 0x3f),
                _ => {
                    let expected = "characters U+0000 to U+00FF in UTF-8";
                    return Err(WeightsError::damaged("a pickled array", expected, format!("byte {byte:#04x}")));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source_of(values: &[f32]) -> Source {
        Source::from_bytes(values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    }

    #[test]
    fn a_transposed_view_is_read_in_its_own_order() {
        let mut source = source_of(&[9.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let storage = source.whole();
        // Stored in rows of 3; the view is the transposed matrix.
        let view = StoredTensor::view("t", vec![3, 2], vec![1, 3], 1, ElementType::F32, storage).unwrap();
        assert_eq!(view.values(&mut source).unwrap(), [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
        let payload = Payload { span: Span { offset: 4, len: 24 }, encoding: Encoding::Raw };
        let fortran = StoredTensor::dense("t", vec![3, 2], true, ElementType::F32, payload).unwrap();
        assert_eq!(fortran.values(&mut source).unwrap(), [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
    }

    #[test]
    fn views_that_repeat_or_leave_their_storage_are_refused() {
        let source = source_of(&[0.0; 6]);
        let view =
            |shape, strides, first| StoredTensor::view("t", shape, strides, first, ElementType::F32, source.whole());
        assert!(view(vec![2, 3], vec![3, 1], 0).is_ok());
        assert!(view(vec![2, 3], vec![3, 1], 1).is_err());
        assert!(view(vec![7], vec![0], 0).is_err());
        assert!(view(vec![2], vec![usize::MAX], 0).is_err());
        assert!(view(vec![1 << 40, 1 << 40], vec![1, 1], 0).is_err());
        assert!(view(vec![2], vec![1], u64::MAX).is_err());
    }

    #[test]
    fn more_axes_than_any_layer_has_are_refused() {
        let source = source_of(&[0.0]);
        let of_axes =
            |count| StoredTensor::view("t", vec![1; count], vec![1; count], 0, ElementType::F32, source.whole());
        assert!(of_axes(MAX_AXES).is_ok());
        let refused = of_axes(MAX_AXES + 1).unwrap_err().to_string();
        assert!(refused.contains("axes") && refused.contains("at most 8, found 9"), "{refused}");
    }

    #[test]
    fn bytes_as_latin1_text_come_back_across_pieces() {
        let all: Vec<u8> = (0..=255).collect();
        let text: String = all.iter().map(|&byte| char::from(byte)).collect();
        let mut decoder = Latin1Decoder::default();
        let mut bytes = Vec::new();
        for piece in text.as_bytes().chunks(7) {
            decoder.decode(piece, &mut bytes).unwrap();
        }
        assert_eq!(bytes, all);
        assert!(Latin1Decoder::default().decode("€".as_bytes(), &mut bytes).is_err());
    }
}
