//! Writes a safetensors file; the same content gives the same bytes.
//!
//! The `safetensors` crate reads and checks these files. It writes metadata in the order of a hash map, which differs
//! from run to run; this writer has a fixed order, so that the same seed gives the same file.

use std::collections::BTreeMap;

use half::f16;
use half::slice::HalfFloatSliceExt;
use serde_json::{Map, Value, json};

/// Element type and bytes of a tensor.
pub(crate) enum TensorBytes {
    /// Weights.
    F16(Vec<u8>),
    /// Other data, such as a picture's file.
    U8(Vec<u8>),
}

impl TensorBytes {
    /// Rounds values to half precision.
    pub(crate) fn halves(values: &[f32]) -> Self {
        Self::F16(values.iter().flat_map(|&value| f16::from_f32(value).to_le_bytes()).collect())
    }

    fn parts(&self) -> (&'static str, &[u8]) {
        match self {
            Self::F16(bytes) => ("F16", bytes),
            Self::U8(bytes) => ("U8", bytes),
        }
    }
}

/// Reads half-precision bytes.
pub(crate) fn values_from_halves(bytes: &[u8]) -> Vec<f32> {
    let halves: Vec<f16> = bytes.chunks_exact(2).map(|pair| f16::from_le_bytes([pair[0], pair[1]])).collect();
    let mut values = vec![0.0; halves.len()];
    // Converts eight values at a time, if the processor supports it.
    halves.convert_to_f32_slice(&mut values);
    values
}

/// Assembles a file: header length, header, half-precision tensors by name, other tensors by name.
pub(crate) fn write(
    metadata: &BTreeMap<String, String>,
    tensors: &BTreeMap<String, (Vec<usize>, TensorBytes)>,
) -> Vec<u8> {
    let mut header = Map::new();
    header.insert("__metadata__".to_owned(), json!(metadata));
    let mut offset = 0;
    // Wider elements first: the format requires every tensor to be aligned to its element size.
    let in_file: Vec<_> = [true, false]
        .into_iter()
        .flat_map(|wide| tensors.iter().filter(move |(_, (_, bytes))| matches!(bytes, TensorBytes::F16(_)) == wide))
        .collect();
    for (name, (shape, bytes)) in &in_file {
        let (dtype, bytes) = bytes.parts();
        let end = offset + bytes.len();
        header.insert((*name).clone(), json!({"dtype": dtype, "shape": shape, "data_offsets": [offset, end]}));
        offset = end;
    }
    let mut header = Value::Object(header).to_string().into_bytes();
    // The data starts at a multiple of eight.
    header.resize(header.len().next_multiple_of(8), b' ');

    let mut file = Vec::with_capacity(8 + header.len() + offset);
    file.extend((header.len() as u64).to_le_bytes());
    file.extend(header);
    for (_, (_, bytes)) in in_file {
        file.extend(bytes.parts().1);
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::SafeTensors;

    #[test]
    fn the_reference_reader_reads_it() {
        let metadata = BTreeMap::from([("b".to_owned(), "2".to_owned()), ("a".to_owned(), "1".to_owned())]);
        let tensors = BTreeMap::from([
            ("picture".to_owned(), (vec![3], TensorBytes::U8(vec![7, 8, 9]))),
            ("weight".to_owned(), (vec![2, 1], TensorBytes::halves(&[0.5, -2.0]))),
        ]);
        let file = write(&metadata, &tensors);
        assert_eq!(file, write(&metadata, &tensors));

        let (_, header) = SafeTensors::read_metadata(&file).unwrap();
        assert_eq!(header.metadata().as_ref().unwrap()["a"], "1");
        let read = SafeTensors::deserialize(&file).unwrap();
        assert_eq!(read.tensor("picture").unwrap().data(), [7, 8, 9]);
        let weight = read.tensor("weight").unwrap();
        assert_eq!(weight.shape(), [2, 1]);
        assert_eq!(values_from_halves(weight.data()), [0.5, -2.0]);
    }
}
