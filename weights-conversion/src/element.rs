//! Element types of checkpoints, and the conversion of their bytes to `f32`.

use half::slice::HalfFloatSliceExt;
use half::{bf16, f16};

/// Type of a stored tensor's elements, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum ElementType {
    F64,
    F32,
    F16,
    Bf16,
    I64,
    I32,
    I16,
    I8,
    U8,
    Bool,
}

impl ElementType {
    /// Bytes per element.
    pub fn size(self) -> usize {
        match self {
            Self::F64 | Self::I64 => 8,
            Self::F32 | Self::I32 => 4,
            Self::F16 | Self::Bf16 | Self::I16 => 2,
            Self::I8 | Self::U8 | Self::Bool => 1,
        }
    }

    /// Whether the elements can be weights.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F64 | Self::F32 | Self::F16 | Self::Bf16)
    }

    /// The name in reports, as in safetensors.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "F64",
            Self::F32 => "F32",
            Self::F16 => "F16",
            Self::Bf16 => "BF16",
            Self::I64 => "I64",
            Self::I32 => "I32",
            Self::I16 => "I16",
            Self::I8 => "I8",
            Self::U8 => "U8",
            Self::Bool => "BOOL",
        }
    }

    /// The type with a name in safetensors.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        let all = [
            Self::F64,
            Self::F32,
            Self::F16,
            Self::Bf16,
            Self::I64,
            Self::I32,
            Self::I16,
            Self::I8,
            Self::U8,
            Self::Bool,
        ];
        all.into_iter().find(|element| element.name() == name)
    }

    /// The type with numpy's letter and size, such as `f4`.
    pub(crate) fn from_numpy(code: &str) -> Option<Self> {
        Some(match code {
            "f8" => Self::F64,
            "f4" => Self::F32,
            "f2" => Self::F16,
            "i8" => Self::I64,
            "i4" => Self::I32,
            "i2" => Self::I16,
            "i1" => Self::I8,
            "u1" => Self::U8,
            "b1" => Self::Bool,
            _ => return None,
        })
    }

    /// The type of a torch storage class, such as `FloatStorage`.
    pub(crate) fn from_torch_storage(class: &str) -> Option<Self> {
        Some(match class.strip_suffix("Storage")? {
            "Double" => Self::F64,
            "Float" => Self::F32,
            "Half" => Self::F16,
            "BFloat16" => Self::Bf16,
            "Long" => Self::I64,
            "Int" => Self::I32,
            "Short" => Self::I16,
            "Char" => Self::I8,
            "Byte" => Self::U8,
            "Bool" => Self::Bool,
            _ => return None,
        })
    }

    /// Appends complete elements as `f32`; integers beyond 2²⁴ are rounded.
    pub(crate) fn decode(self, bytes: &[u8], values: &mut Vec<f32>) {
        debug_assert!(bytes.len().is_multiple_of(self.size()));
        match self {
            Self::F64 => values.extend(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b) as f32)),
            Self::F32 => values.extend(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b))),
            Self::F16 => {
                let halves: Vec<f16> = bytes.as_chunks::<2>().0.iter().map(|b| f16::from_le_bytes(*b)).collect();
                let from = values.len();
                values.resize(from + halves.len(), 0.0);
                halves.convert_to_f32_slice(&mut values[from..]);
            }
            Self::Bf16 => values.extend(bytes.as_chunks::<2>().0.iter().map(|b| bf16::from_le_bytes(*b).to_f32())),
            Self::I64 => values.extend(bytes.as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b) as f32)),
            Self::I32 => values.extend(bytes.as_chunks::<4>().0.iter().map(|b| i32::from_le_bytes(*b) as f32)),
            Self::I16 => values.extend(bytes.as_chunks::<2>().0.iter().map(|b| f32::from(i16::from_le_bytes(*b)))),
            Self::I8 => values.extend(bytes.iter().map(|b| f32::from(b.cast_signed()))),
            Self::U8 | Self::Bool => values.extend(bytes.iter().map(|b| f32::from(*b))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_and_a_half_in_every_float_type() {
        let mut values = Vec::new();
        ElementType::F64.decode(&1.5f64.to_le_bytes(), &mut values);
        ElementType::F32.decode(&1.5f32.to_le_bytes(), &mut values);
        // Sign, exponent 15, upper half of the mantissa; bf16 is the upper half of an f32.
        ElementType::F16.decode(&0x3e00u16.to_le_bytes(), &mut values);
        ElementType::Bf16.decode(&0x3fc0u16.to_le_bytes(), &mut values);
        assert_eq!(values, [1.5; 4]);
    }

    #[test]
    fn integers_keep_their_sign() {
        let mut values = Vec::new();
        ElementType::I64.decode(&(-3i64).to_le_bytes(), &mut values);
        ElementType::I32.decode(&(-3i32).to_le_bytes(), &mut values);
        ElementType::I16.decode(&(-3i16).to_le_bytes(), &mut values);
        ElementType::I8.decode(&(-3i8).to_le_bytes(), &mut values);
        ElementType::U8.decode(&[253], &mut values);
        assert_eq!(values, [-3.0, -3.0, -3.0, -3.0, 253.0]);
    }

    #[test]
    fn the_names_of_three_worlds() {
        assert_eq!(ElementType::from_numpy("f4"), Some(ElementType::F32));
        assert_eq!(ElementType::from_torch_storage("BFloat16Storage"), Some(ElementType::Bf16));
        assert_eq!(ElementType::from_name("I64"), Some(ElementType::I64));
        assert_eq!(ElementType::from_numpy("O8"), None);
        assert_eq!(ElementType::from_torch_storage("Float"), None);
    }
}
