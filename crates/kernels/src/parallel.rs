//! Loops over independent units of work, on rayon's threads if there are any.
//!
//! Every unit writes data that no other unit writes, and the division into units depends only on shapes, so
//! results are bit-identical for any number of threads.

use std::marker::PhantomData;
use std::mem::MaybeUninit;

/// Calls `unit` with every index below `num_units`, in any order, possibly at the same time.
pub(crate) fn for_each_unit(num_units: usize, unit: impl Fn(usize) + Sync + Send) {
    #[cfg(all(feature = "parallel", not(target_arch = "wasm32")))]
    {
        use rayon::prelude::*;
        if num_units > 1 {
            (0..num_units).into_par_iter().with_max_len(1).for_each(unit);
            return;
        }
    }
    (0..num_units).for_each(unit);
}

/// Calls `work` with each stretch of `len` values and its number, in any order, possibly at the same time.
pub fn for_each_stretch<T: Send>(values: &mut [T], len: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(all(feature = "parallel", not(target_arch = "wasm32")))]
    {
        use rayon::prelude::*;
        values.par_chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
    }
    #[cfg(not(all(feature = "parallel", not(target_arch = "wasm32"))))]
    values.chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
}

/// [`for_each_unit`] if `parallel`, otherwise sequentially.
pub(crate) fn for_each_unit_if(parallel: bool, num_units: usize, unit: impl Fn(usize) + Sync + Send) {
    if parallel {
        for_each_unit(num_units, unit);
    } else {
        (0..num_units).for_each(unit);
    }
}

/// A slice of which several units write disjoint parts at the same time.
pub(crate) struct SharedSlice<'a> {
    start: *mut f32,
    len: usize,
    slice: PhantomData<&'a mut [f32]>,
}

// SAFETY: the only access is through `range` and `raw`, whose callers promise disjoint parts.
unsafe impl Sync for SharedSlice<'_> {}
// SAFETY: it is a pointer to floats, which may be written on any thread.
unsafe impl Send for SharedSlice<'_> {}

impl<'a> SharedSlice<'a> {
    /// Borrows a slice for the units of one loop.
    pub(crate) fn new(slice: &'a mut [f32]) -> Self {
        Self { start: slice.as_mut_ptr(), len: slice.len(), slice: PhantomData }
    }

    /// The whole slice, for kernels that write in place.
    pub(crate) fn raw(&self) -> Raw {
        Raw { start: self.start, len: self.len }
    }

    /// The `len` elements from `start`.
    ///
    /// # Safety
    /// No two ranges that live at the same time overlap.
    #[allow(clippy::mut_from_ref)] // The point of the type: disjoint parts of one borrowed slice.
    pub(crate) unsafe fn range(&self, start: usize, len: usize) -> &'a mut [f32] {
        assert!(start <= self.len && len <= self.len - start, "range {start}+{len} of a slice of {}", self.len);
        // SAFETY: in bounds by the assertion, borrowed for 'a, and disjoint by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start), len) }
    }
}

/// The target of kernels that share an output: a pointer and its length, without a lifetime.
#[derive(Clone, Copy)]
pub(crate) struct Raw {
    start: *mut f32,
    pub(crate) len: usize,
}

impl Raw {
    /// Pointer to an element.
    pub(crate) fn at(&self, element: usize) -> *mut f32 {
        assert!(element <= self.len, "element {element} of {}", self.len);
        // SAFETY: inside, or one past the end, by the assertion.
        unsafe { self.start.add(element) }
    }
}

// SAFETY: no access by itself; kernels that write through it are unsafe and promise disjoint parts.
unsafe impl Sync for Raw {}
// SAFETY: a pointer may be sent; the floats that it points to may be written on any thread.
unsafe impl Send for Raw {}

/// A vector that several units fill at once, without initial zeroing.
pub(crate) struct Output {
    values: Vec<f32>,
    start: *mut f32,
    len: usize,
}

// SAFETY: the only access is through `range` and `raw`, whose callers promise disjoint parts.
unsafe impl Sync for Output {}

impl Output {
    /// Room for `len` values.
    pub(crate) fn new(len: usize) -> Self {
        let mut values = Vec::with_capacity(len);
        Self { start: values.as_mut_ptr(), values, len }
    }

    /// The whole vector, for kernels that write in place.
    pub(crate) fn raw(&self) -> Raw {
        Raw { start: self.start, len: self.len }
    }

    /// The `len` elements from `start`, to be written.
    ///
    /// # Safety
    /// No two ranges that live at the same time overlap.
    #[allow(clippy::mut_from_ref)] // As in `SharedSlice`.
    pub(crate) unsafe fn range(&self, start: usize, len: usize) -> &mut [MaybeUninit<f32>] {
        assert!(start <= self.len && len <= self.len - start, "range {start}+{len} of {}", self.len);
        // SAFETY: in bounds by the assertion, allocated while `self` lives, disjoint by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start).cast(), len) }
    }

    /// The filled vector.
    ///
    /// # Safety
    /// Every element was written.
    pub(crate) unsafe fn into_vec(mut self) -> Vec<f32> {
        // SAFETY: `len` elements were allocated, and written by the caller's promise.
        unsafe { self.values.set_len(self.len) };
        self.values
    }
}
