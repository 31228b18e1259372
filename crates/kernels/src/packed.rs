//! Packed weights, reused as long as the weights from which they were packed exist.
//!
//! In inference a network's weights never change, so they are packed on first use. An entry is found by the address of
//! the weight's storage and holds a weak reference to it: the address cannot be given to another tensor while the
//! entry exists, and changing the values in place requires moving them first (`Arc::make_mut`), which invalidates the
//! weak reference.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use burn::backend::flex::FlexTensor;
use burn::tensor::Bytes;

use crate::conv::filters::Filters;
use crate::conv::panels::Direction;
use crate::conv::shape::ConvShape;
use crate::flex_tensor::values;
use crate::simd::Isa;

/// The parameters of a packing.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Key {
    address: usize,
    start: usize,
    weight: [usize; 4],
    direction: Direction,
    winograd: bool,
    /// Stride, padding and number of phases, which determine the products of the backward direction; zeros forwards.
    phases: [[usize; 2]; 3],
}

struct Entry {
    storage: Weak<Bytes>,
    filters: Filters,
}

static CACHE: Mutex<Option<HashMap<Key, Entry>>> = Mutex::new(None);

/// Whether weights are packed again or looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keep {
    /// The weights change with the next step.
    No,
    /// The weights may be used again.
    Yes,
}

/// The packed form of a contiguous weight `[Co, Ci, Kh, Kw]`.
pub(crate) fn filters(
    isa: Isa,
    weight: &FlexTensor,
    shape: &ConvShape,
    direction: Direction,
    winograd: bool,
    keep: Keep,
) -> Filters {
    let pack = || Filters::new(isa, values(weight), shape, direction, winograd);
    if keep == Keep::No {
        return pack();
    }
    let storage = weight.data_arc();
    let phases = match direction {
        Direction::Forward => [[0; 2]; 3],
        Direction::Backward => {
            let stride = shape.params.stride;
            let present = [0, 1].map(|axis| stride[axis].min(shape.in_size[axis]));
            [stride, shape.params.padding, present]
        }
    };
    let key = Key {
        address: Arc::as_ptr(&storage).addr(),
        start: weight.layout().start_offset(),
        weight: shape.weight(),
        direction,
        winograd,
        phases,
    };
    let cache = || CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(entry) = cache().get_or_insert_default().get(&key)
        && entry.storage.strong_count() > 0
    {
        return entry.filters.clone();
    }
    // Packed without the lock: two threads may both pack, with the same result.
    let filters = pack();
    let mut cache = cache();
    let entries = cache.get_or_insert_default();
    entries.retain(|_, entry| entry.storage.strong_count() > 0);
    entries.insert(key, Entry { storage: Arc::downgrade(&storage), filters: filters.clone() });
    filters
}
