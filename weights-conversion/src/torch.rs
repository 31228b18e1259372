//! torch checkpoints: a pickle of references, and separate storages.
//!
//! ```text
//! zip      NAME/data.pkl   NAME/data/0, 1, …   NAME/byteorder
//! legacy   pickles: magic, version, system, the object, storage keys; then each storage: u64 count, elements
//! ```

use std::collections::HashMap;

use crate::error::{Result, WeightsError, printable};
use crate::pickle::{self, Object, Pickle, StorageRef, Value};
use crate::source::{Scanner, Source, Span};
use crate::tensor::StoredTensor;
use crate::zip_archive::ZipArchive;

/// The start of a legacy file: a pickle of the number 0x1950a86a20f9469cfc6c.
const LEGACY_START: [u8; 14] = *b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19";
/// The only version of the legacy format.
const LEGACY_VERSION: i64 = 1001;

/// The position of each storage.
pub(crate) struct Storages {
    spans: HashMap<String, Span>,
}

/// Whether bytes start like torch's legacy format.
pub(crate) fn is_legacy(start: &[u8]) -> bool {
    start.starts_with(&LEGACY_START)
}

fn damaged(part: &str, expected: impl Into<String>, found: impl Into<String>) -> WeightsError {
    WeightsError::damaged(format!("torch checkpoint, {part}"), expected, found)
}

/// Reads the zip format.
///
/// # Errors
/// An archive or a pickle that was truncated or altered, or requires globals that weights do not need.
pub(crate) fn read_zip(source: &mut Source) -> Result<(Pickle, Storages)> {
    let zip = ZipArchive::read(source)?;
    let pickle_name = zip.only_name_ending_with("/data.pkl")?.to_owned();
    let folder = pickle_name.strip_suffix("data.pkl").unwrap_or_default();
    if let Some(span) = zip.locate(source, &format!("{folder}byteorder"))? {
        let order = source.read_span(Span { len: span.len.min(16), ..span })?;
        if order.trim_ascii() != b"little" {
            return Err(damaged("byteorder", "little", printable(&String::from_utf8_lossy(&order))));
        }
    }
    let Some(span) = zip.locate(source, &pickle_name)? else {
        return Err(damaged("data.pkl", "an entry", "none"));
    };
    let pickle = pickle::load(source, span)?;
    let mut spans = HashMap::new();
    for storage in storages_of(&pickle) {
        if !spans.contains_key(&*storage.key) {
            let Some(span) = zip.locate(source, &format!("{folder}data/{}", storage.key))? else {
                return Err(damaged("storages", format!("an entry data/{}", printable(&storage.key)), "none"));
            };
            spans.insert(storage.key.to_string(), span);
        }
    }
    Ok((pickle, Storages { spans }))
}

/// Reads the format of `torch.save` before version 1.6.
///
/// # Errors
/// Pickles or storages that were truncated or altered, or require globals that weights do not need.
pub(crate) fn read_legacy(source: &mut Source) -> Result<(Pickle, Storages)> {
    let whole = source.whole();
    let rest = |end: u64| Span { offset: end, len: whole.end().saturating_sub(end) };
    let magic = pickle::load(source, whole)?;
    let version = pickle::load(source, rest(magic.end))?;
    if version.root != Value::Int(LEGACY_VERSION) {
        return Err(damaged("version", LEGACY_VERSION.to_string(), version.arena.describe(version.root)));
    }
    let system = pickle::load(source, rest(version.end))?;
    if system.arena.entry(system.root, "little_endian") == Some(Value::Bool(false)) {
        return Err(damaged("system", "little-endian elements", "big-endian ones"));
    }
    let pickle = pickle::load(source, rest(system.end))?;
    let keys = pickle::load(source, rest(pickle.end))?;
    let Some(in_order) = keys.arena.sequence(keys.root) else {
        return Err(damaged("storage keys", "a list", keys.arena.describe(keys.root)));
    };

    let elements: HashMap<_, _> = storages_of(&pickle).map(|storage| (&*storage.key, storage)).collect();
    let mut spans = HashMap::new();
    let mut scanner = Scanner::new(source, rest(keys.end))?;
    for key in in_order {
        let key = keys.arena.text(*key).unwrap_or_default();
        let Some(storage) = elements.get(key) else {
            return Err(damaged("storage keys", "keys of the pickle's storages", printable(key)));
        };
        let count = u64::from_le_bytes(scanner.take()?);
        if count != storage.num_elements {
            let expected = format!("{} elements in storage {}", storage.num_elements, printable(key));
            return Err(damaged("storages", expected, count.to_string()));
        }
        let bytes = count.saturating_mul(storage.element.size() as u64);
        spans.insert(key.to_owned(), scanner.skip(bytes)?);
    }
    Ok((pickle, Storages { spans }))
}

fn storages_of(pickle: &Pickle) -> impl Iterator<Item = &StorageRef> {
    pickle.arena.objects().filter_map(|object| match object {
        Object::Storage(storage) => Some(&**storage),
        _ => None,
    })
}

impl Storages {
    /// A tensor of the pickle, with the position of its bytes; `None` if the value is not a tensor.
    pub fn tensor(&self, pickle: &Pickle, value: Value, name: &str) -> Result<Option<StoredTensor>> {
        let Some(Object::Tensor(tensor)) = pickle.arena.object(value) else {
            return Ok(None);
        };
        let storage = &tensor.storage;
        let bytes = storage.num_elements.checked_mul(storage.element.size() as u64);
        let span = self.spans.get(&*storage.key).copied();
        let (Some(bytes), Some(span)) = (bytes, span) else {
            let expected = format!("storage {} of {} elements", printable(&storage.key), storage.num_elements);
            return Err(damaged(&printable(name), expected, "none"));
        };
        if bytes != span.len {
            let expected = format!("{bytes} bytes in storage {}", printable(&storage.key));
            return Err(damaged(&printable(name), expected, span.len.to_string()));
        }
        let (shape, strides) = (tensor.shape.clone(), tensor.strides.clone());
        StoredTensor::view(&printable(name), shape, strides, tensor.first_element, storage.element, span).map(Some)
    }
}
