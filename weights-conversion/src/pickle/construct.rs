//! The results of calls of the allowed globals, and the effect of a state on an object.

use crate::element::ElementType;
use crate::error::{Result, WeightsError};
use crate::source::Span;
use crate::tensor::{Encoding, Payload, StoredTensor};

use super::global::Global;
use super::object::{Arena, Dtype, Object, StorageRef, TensorRef, Value};

fn damaged(at: u64, expected: impl Into<String>, found: impl Into<String>) -> WeightsError {
    WeightsError::damaged(format!("pickle, byte {at}"), expected, found)
}

/// Emulates a call.
pub(crate) fn call(arena: &mut Arena, global: Global, arguments: &[Value], at: u64) -> Result<Value> {
    let object = match (global, arguments) {
        // The arguments are the class, a shape and a type code; the state replaces all of them.
        (Global::Reconstruct, [Value::Global(Global::NdArray), ..]) => Object::Array(None),
        (Global::FromBuffer, &[buffer, dtype, shape, order]) => {
            let fortran_order = arena.text(order) == Some("F");
            Object::Array(Some(Box::new(array(arena, shape, dtype, fortran_order, buffer, at)?)))
        }
        (Global::Scalar, _) => Object::Other,
        (Global::Dtype, &[code, ..]) => Object::Dtype(dtype(arena, code, at)?),
        (Global::CodecsEncode, &[text, encoding]) => match (arena.object(text), arena.text(encoding)) {
            (Some(Object::Text(text)), Some("latin1")) => {
                Object::Bytes(Payload { span: text.span, encoding: text.encoding })
            }
            _ => return Err(damaged(at, "text to encode as latin1", arena.describe(text))),
        },
        (Global::Bytes, []) => Object::Bytes(Payload { span: Span { offset: at, len: 0 }, encoding: Encoding::Raw }),
        (Global::OrderedDict, []) => Object::Dict(Vec::new()),
        (Global::OrderedDict, &[items]) => Object::Dict(dict_of_pairs(arena, items, at)?),
        (Global::RebuildTensor, &[storage, first_element, shape, strides, ..]) => {
            tensor(arena, [storage, first_element, shape, strides], at)?
        }
        (Global::RebuildParameter, &[tensor, ..]) if matches!(arena.object(tensor), Some(Object::Tensor(_))) => {
            return Ok(tensor);
        }
        (global, arguments) => {
            let found: Vec<_> = arguments.iter().map(|argument| arena.describe(*argument)).collect();
            return Err(damaged(at, format!("arguments that {global:?} takes"), found.join(", ")));
        }
    };
    Ok(arena.add(object))
}

/// Sets an object's state.
pub(crate) fn set_state(arena: &mut Arena, object: Value, state: Value, at: u64) -> Result<()> {
    match arena.object(object) {
        Some(Object::Array(None)) => {
            // Old arrays lack the leading version.
            let (shape, dtype, fortran_order, buffer) = match arena.sequence(state) {
                Some(&[Value::Int(_), shape, dtype, Value::Bool(fortran_order), buffer])
                | Some(&[shape, dtype, Value::Bool(fortran_order), buffer]) => (shape, dtype, fortran_order, buffer),
                _ => return Err(damaged(at, "shape, type, order and bytes of an array", arena.describe(state))),
            };
            let array = array(arena, shape, dtype, fortran_order, buffer, at)?;
            if let Some(target) = arena.object_mut(object) {
                *target = Object::Array(Some(Box::new(array)));
            }
            Ok(())
        }
        Some(Object::Dtype(_)) => {
            let (order, plain) = match arena.sequence(state) {
                Some(&[Value::Int(_), order, subdtype, names, fields, ..]) => {
                    (arena.text(order), [subdtype, names, fields] == [Value::None; 3])
                }
                _ => return Err(damaged(at, "the state of an element type", arena.describe(state))),
            };
            let big_endian = match order {
                Some("<" | "|" | "=") => false,
                Some(">") => true,
                other => return Err(damaged(at, "a byte order", other.unwrap_or("no text"))),
            };
            if !plain {
                return Err(damaged(at, "a plain element type", "one with fields"));
            }
            if let Some(Object::Dtype(dtype)) = arena.object_mut(object) {
                dtype.big_endian = big_endian;
            }
            Ok(())
        }
        // torch attaches `_metadata` to a state dict; no weight depends on it.
        Some(Object::Dict(_)) => Ok(()),
        _ => Err(damaged(at, "an array, an element type or a dict that takes a state", arena.describe(object))),
    }
}

/// A storage from torch's persistent id: `("storage", class, key, device, number of elements)`.
pub(crate) fn storage(arena: &mut Arena, id: Value, at: u64) -> Result<Value> {
    let expected = "(\"storage\", class, key, device, number of elements)";
    let Some(&[kind, Value::Global(Global::Storage(element)), key, _, Value::Int(count), ref view @ ..]) =
        arena.sequence(id)
    else {
        return Err(damaged(at, expected, arena.describe(id)));
    };
    let (Some("storage"), Some(key), Ok(num_elements)) = (arena.text(kind), arena.text(key), u64::try_from(count))
    else {
        return Err(damaged(at, expected, "other values"));
    };
    // Keys are numbers; tensors keep a copy.
    if key.len() > 64 {
        return Err(damaged(at, "a storage's key of at most 64 bytes", format!("{} bytes", key.len())));
    }
    if !matches!(view, [] | [Value::None]) {
        return Err(damaged(at, "a separate storage", "a view of another storage, as torch before 0.4 wrote"));
    }
    let storage = StorageRef { key: key.into(), element, num_elements };
    Ok(arena.add(Object::Storage(Box::new(storage))))
}

fn dtype(arena: &Arena, code: Value, at: u64) -> Result<Dtype> {
    let code = arena.text(code).ok_or_else(|| damaged(at, "the code of an element type", arena.describe(code)))?;
    let element = ElementType::from_numpy(code.trim_start_matches(['<', '|', '=']));
    match element {
        Some(element) => Ok(Dtype { element, big_endian: false }),
        None => Err(damaged(at, "an element type f8, f4, f2, i8, i4, i2, i1, u1 or b1", crate::error::printable(code))),
    }
}

fn array(
    arena: &Arena,
    shape: Value,
    dtype: Value,
    fortran_order: bool,
    buffer: Value,
    at: u64,
) -> Result<StoredTensor> {
    let shape = arena.sizes(shape, at)?;
    let Some(Object::Dtype(dtype)) = arena.object(dtype) else {
        return Err(damaged(at, "an array's element type", arena.describe(dtype)));
    };
    if dtype.big_endian && dtype.element.size() > 1 {
        return Err(damaged(at, "little-endian elements", "big-endian ones"));
    }
    let Some(payload) = arena.bytes(buffer) else {
        return Err(damaged(at, "an array's bytes", arena.describe(buffer)));
    };
    StoredTensor::dense(&format!("array at byte {at}"), shape, fortran_order, dtype.element, payload)
}

fn tensor(arena: &Arena, [storage, first_element, shape, strides]: [Value; 4], at: u64) -> Result<Object> {
    let Some(Object::Storage(storage)) = arena.object(storage) else {
        return Err(damaged(at, "a tensor's storage", arena.describe(storage)));
    };
    let first_element = match first_element {
        Value::Int(first) => u64::try_from(first).map_err(|_| damaged(at, "an offset", first.to_string()))?,
        other => return Err(damaged(at, "an offset", arena.describe(other))),
    };
    let (shape, strides) = (arena.sizes(shape, at)?, arena.sizes(strides, at)?);
    Ok(Object::Tensor(Box::new(TensorRef { storage: (**storage).clone(), first_element, shape, strides })))
}

fn dict_of_pairs(arena: &Arena, items: Value, at: u64) -> Result<Vec<(Value, Value)>> {
    let expected = "a list of keys and values";
    let items = arena.sequence(items).ok_or_else(|| damaged(at, expected, arena.describe(items)))?;
    let pair = |item: &Value| match arena.sequence(*item) {
        Some(&[key, value]) => Ok((key, value)),
        _ => Err(damaged(at, expected, arena.describe(*item))),
    };
    items.iter().map(pair).collect()
}
