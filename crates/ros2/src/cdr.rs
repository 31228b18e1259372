//! CDR, the encoding of messages on the network: plain XCDR1, as in every ROS 2 middleware.
//!
//! Numbers are aligned to their own size, counted from the message's start. Texts consist of their length, their bytes
//! and a final zero; sequences begin with their number of elements, arrays do not. Messages come from the network and
//! are not trusted: every length is compared with the available bytes before memory is allocated.

use std::fmt;

/// The reason why bytes are not a message of a type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected} at byte {at} of {length}, found {found}")]
pub struct CdrError {
    /// The content that was expected.
    pub expected: String,
    /// The position, counted from the message's start.
    pub at: usize,
    /// The length of the message.
    pub length: usize,
    /// The content that was found.
    pub found: String,
}

/// A value that can be read from CDR and written to it.
pub trait Cdr: Sized {
    /// Minimum number of bytes of a value, which limits the elements of a sequence; at least 1.
    const MIN_BYTES: usize;

    /// Appends the value.
    fn write(&self, to: &mut Writer);

    /// Reads the value.
    ///
    /// # Errors
    /// [`CdrError`] for bytes that are not such a value.
    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError>;

    /// Appends the elements of a sequence or an array; for bytes this is a single copy.
    fn write_all(values: &[Self], to: &mut Writer) {
        values.iter().for_each(|value| value.write(to));
    }

    /// Reads `count` elements; the caller has compared the number with the remaining bytes.
    ///
    /// # Errors
    /// As for [`Cdr::read`].
    fn read_all(count: usize, from: &mut Reader<'_>) -> Result<Vec<Self>, CdrError> {
        (0..count).map(|_| Self::read(from)).collect()
    }
}

/// Encodes a whole message, little-endian, without the four bytes that name the encoding.
pub fn to_bytes(message: &impl Cdr) -> Vec<u8> {
    let mut writer = Writer::default();
    message.write(&mut writer);
    writer.bytes
}

/// Reads a little-endian message without the four bytes that name the encoding; bytes after the message are ignored.
///
/// # Errors
/// [`CdrError`] for bytes that are not such a message.
pub fn from_bytes<T: Cdr>(bytes: &[u8]) -> Result<T, CdrError> {
    T::read(&mut Reader { bytes, at: 0 })
}

/// Bytes under construction.
#[derive(Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        self.bytes.resize(self.bytes.len().next_multiple_of(N), 0);
        self.bytes.extend_from_slice(&bytes);
    }

    /// Writes a value aligned as if one byte preceded it; the writer must be empty.
    pub(crate) fn shifted_by_one(&mut self, value: &impl Cdr) {
        let mut shifted = Self { bytes: vec![0] };
        value.write(&mut shifted);
        self.bytes.extend_from_slice(&shifted.bytes[1..]);
    }

    fn count(&mut self, count: usize) {
        // The maximum size of messages is far below this limit.
        self.number(u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
    }
}

/// Bytes to be read.
#[derive(Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn error(&self, expected: impl Into<String>, found: impl fmt::Display) -> CdrError {
        CdrError { expected: expected.into(), at: self.at, length: self.bytes.len(), found: found.to_string() }
    }

    fn take(&mut self, count: usize, expected: &str) -> Result<&'a [u8], CdrError> {
        let left = self.bytes.get(self.at..).unwrap_or_default();
        let Some(taken) = left.get(..count) else {
            return Err(self.error(format!("{count} bytes of {expected}"), format!("{} bytes", left.len())));
        };
        self.at += count;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self, expected: &str) -> Result<[u8; N], CdrError> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N, expected)?);
        Ok(bytes)
    }

    /// Reads a value that was aligned as if one byte preceded it.
    pub(crate) fn shifted_by_one<T: Cdr>(&mut self) -> Result<T, CdrError> {
        let left = self.bytes.get(self.at..).unwrap_or_default();
        let shifted = [&[0], left].concat();
        self.at = self.bytes.len();
        T::read(&mut Reader { bytes: &shifted, at: 1 })
    }

    /// Reads a sequence's number of elements, which the remaining bytes must be able to contain.
    fn count(&mut self, min_bytes: usize) -> Result<usize, CdrError> {
        let count = u32::from_le_bytes(self.number("a sequence's length")?) as usize;
        let most = (self.bytes.len() - self.at) / min_bytes;
        if count > most {
            return Err(self.error(format!("a sequence of at most {most} elements"), count));
        }
        Ok(count)
    }
}

macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl Cdr for $type {
            const MIN_BYTES: usize = size_of::<$type>();

            fn write(&self, to: &mut Writer) {
                to.number(self.to_le_bytes());
            }

            fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
                from.number(stringify!($type)).map(Self::from_le_bytes)
            }
        }
    )*};
}

numbers!(i8, u16, i16, u32, i32, u64, i64, f32, f64);

impl Cdr for u8 {
    const MIN_BYTES: usize = 1;

    fn write(&self, to: &mut Writer) {
        to.bytes.push(*self);
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        from.take(1, "u8").map(|bytes| bytes[0])
    }

    fn write_all(values: &[Self], to: &mut Writer) {
        to.bytes.extend_from_slice(values);
    }

    fn read_all(count: usize, from: &mut Reader<'_>) -> Result<Vec<Self>, CdrError> {
        from.take(count, "u8").map(<[u8]>::to_vec)
    }
}

impl Cdr for bool {
    const MIN_BYTES: usize = 1;

    fn write(&self, to: &mut Writer) {
        to.bytes.push(u8::from(*self));
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        match from.take(1, "bool")? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => Err(from.error("a bool of 0 or 1", other[0])),
        }
    }
}

impl Cdr for String {
    const MIN_BYTES: usize = 4;

    fn write(&self, to: &mut Writer) {
        // A zero would end the text for the receiver, so the text from the first zero on is omitted.
        let text = self.split('\0').next().unwrap_or_default();
        to.count(text.len() + 1);
        to.bytes.extend_from_slice(text.as_bytes());
        to.bytes.push(0);
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        let count = from.count(1)?;
        let text = match from.take(count, "text")? {
            [] => &[],
            [text @ .., 0] => text,
            [.., last] => return Err(from.error("a zero at a text's end", last)),
        };
        String::from_utf8(text.to_vec()).map_err(|_| from.error("text in UTF-8", "other bytes"))
    }
}

impl<T: Cdr> Cdr for Vec<T> {
    const MIN_BYTES: usize = 4;

    fn write(&self, to: &mut Writer) {
        to.count(self.len());
        T::write_all(self, to);
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        let count = from.count(T::MIN_BYTES)?;
        T::read_all(count, from)
    }
}

impl<T: Cdr + Copy + Default, const N: usize> Cdr for [T; N] {
    const MIN_BYTES: usize = N * T::MIN_BYTES;

    fn write(&self, to: &mut Writer) {
        T::write_all(self, to);
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::read(from)?;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_to_their_size_from_the_start() {
        let mut writer = Writer::default();
        7_u8.write(&mut writer);
        0x0102_u16.write(&mut writer);
        true.write(&mut writer);
        1.0_f64.write(&mut writer);
        // Computed by hand: 7, a byte of padding, the u16, the bool, three bytes of padding, and the f64 at byte 8.
        assert_eq!(writer.bytes, [7, 0, 2, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    }

    #[test]
    fn texts_have_their_length_and_a_zero() {
        assert_eq!(to_bytes(&"ab".to_owned()), [3, 0, 0, 0, b'a', b'b', 0]);
        assert_eq!(to_bytes(&"a\0b".to_owned()), [2, 0, 0, 0, b'a', 0]);
        assert_eq!(from_bytes::<String>(&[0, 0, 0, 0]).unwrap(), "");
        let error = from_bytes::<String>(&[2, 0, 0, 0, b'a', b'b']).unwrap_err();
        assert_eq!(error.to_string(), "expected a zero at a text's end at byte 6 of 6, found 98");
        assert!(from_bytes::<String>(&[2, 0, 0, 0, 0xff, 0]).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn a_length_that_the_message_cannot_have_reserves_nothing() {
        let error = from_bytes::<Vec<f64>>(&[0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0]).unwrap_err();
        assert_eq!(error.to_string(), "expected a sequence of at most 0 elements at byte 4 of 8, found 2147483647");
        let cut = from_bytes::<u32>(&[1, 2]).unwrap_err();
        assert_eq!(cut.to_string(), "expected 4 bytes of u32 at byte 0 of 2, found 2 bytes");
        // The aligned position is beyond the end.
        assert!(from_bytes::<(u8, f64)>(&[1]).is_err());
    }

    /// A pair of values, for tests of alignment.
    impl<A: Cdr, B: Cdr> Cdr for (A, B) {
        const MIN_BYTES: usize = A::MIN_BYTES + B::MIN_BYTES;

        fn write(&self, to: &mut Writer) {
            self.0.write(to);
            self.1.write(to);
        }

        fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
            Ok((A::read(from)?, B::read(from)?))
        }
    }

    #[test]
    fn sequences_and_arrays_come_back() {
        let value = (vec![1_u8, 2, 3], ([0.5_f64; 3], vec!["x".to_owned(), String::new()]));
        assert_eq!(from_bytes::<(Vec<u8>, ([f64; 3], Vec<String>))>(&to_bytes(&value)).unwrap(), value);
    }
}
