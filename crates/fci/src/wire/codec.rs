//! Packed little-endian fields: one list of fields serves for reading and writing.
//!
//! A message lists its fields once, in a function generic over [`Codec`]; an [`Encoder`] writes the fields, a
//! [`Decoder`] reads them.

use crate::wire_error::WireError;

/// Precision of a message's real numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Real {
    /// 4 bytes.
    F32,
    /// 8 bytes.
    F64,
}

/// One direction of a message: each call writes or reads the next field.
pub trait Codec {
    /// Writes or reads the next bytes, in order.
    ///
    /// # Errors
    /// [`WireError::Short`] if a message ends too early.
    fn bytes(&mut self, bytes: &mut [u8]) -> Result<(), WireError>;

    /// Precision of [`Codec::reals`].
    fn real(&self) -> Real;

    /// Writes or reads one byte.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn u8(&mut self, value: &mut u8) -> Result<(), WireError> {
        let mut bytes = [*value];
        self.bytes(&mut bytes)?;
        *value = bytes[0];
        Ok(())
    }

    /// Writes or reads two bytes.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn u16(&mut self, value: &mut u16) -> Result<(), WireError> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = u16::from_le_bytes(bytes);
        Ok(())
    }

    /// Writes or reads four bytes.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn u32(&mut self, value: &mut u32) -> Result<(), WireError> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = u32::from_le_bytes(bytes);
        Ok(())
    }

    /// Writes or reads eight bytes.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn u64(&mut self, value: &mut u64) -> Result<(), WireError> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = u64::from_le_bytes(bytes);
        Ok(())
    }

    /// Writes or reads a boolean as one byte; every byte except zero is true, as in C++.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn bool(&mut self, value: &mut bool) -> Result<(), WireError> {
        let mut byte = u8::from(*value);
        self.u8(&mut byte)?;
        *value = byte != 0;
        Ok(())
    }

    /// Writes or reads one double.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn f64(&mut self, value: &mut f64) -> Result<(), WireError> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = f64::from_le_bytes(bytes);
        Ok(())
    }

    /// Writes or reads doubles, in order.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn f64s(&mut self, values: &mut [f64]) -> Result<(), WireError> {
        values.iter_mut().try_for_each(|value| self.f64(value))
    }

    /// Writes or reads numbers with the precision of [`Codec::real`], in order.
    ///
    /// # Errors
    /// As for [`Codec::bytes`].
    fn reals(&mut self, values: &mut [f64]) -> Result<(), WireError> {
        match self.real() {
            Real::F64 => self.f64s(values),
            Real::F32 => values.iter_mut().try_for_each(|value| {
                let mut bytes = (*value as f32).to_le_bytes();
                self.bytes(&mut bytes)?;
                *value = f64::from(f32::from_le_bytes(bytes));
                Ok(())
            }),
        }
    }
}

/// Writes fields in sequence.
#[derive(Debug)]
pub struct Encoder {
    bytes: Vec<u8>,
    real: Real,
}

impl Encoder {
    /// An empty message.
    pub fn new(real: Real) -> Self {
        Self { bytes: Vec::new(), real }
    }

    /// The message's bytes.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

impl Codec for Encoder {
    fn bytes(&mut self, bytes: &mut [u8]) -> Result<(), WireError> {
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    fn real(&self) -> Real {
        self.real
    }
}

/// Reads fields from a message.
#[derive(Debug)]
pub struct Decoder<'a> {
    message: &'static str,
    bytes: &'a [u8],
    position: usize,
    real: Real,
}

impl<'a> Decoder<'a> {
    /// Starts at the first byte; `message` is the name in errors.
    pub fn new(message: &'static str, bytes: &'a [u8], real: Real) -> Self {
        Self { message, bytes, position: 0, real }
    }

    /// Checks that no bytes remain.
    ///
    /// # Errors
    /// [`WireError::Long`] if bytes remain.
    pub fn finish(self) -> Result<(), WireError> {
        if self.position == self.bytes.len() {
            return Ok(());
        }
        Err(WireError::Long { message: self.message, expected: self.position, found: self.bytes.len() })
    }
}

impl Codec for Decoder<'_> {
    fn bytes(&mut self, bytes: &mut [u8]) -> Result<(), WireError> {
        let end = self.position + bytes.len();
        let Some(read) = self.bytes.get(self.position..end) else {
            return Err(WireError::Short { message: self.message, expected: end, found: self.bytes.len() });
        };
        bytes.copy_from_slice(read);
        self.position = end;
        Ok(())
    }

    fn real(&self) -> Real {
        self.real
    }
}
