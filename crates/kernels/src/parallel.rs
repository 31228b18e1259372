//! Loops over independent units of work, on rayon's threads where there are any.
//!
//! Every unit writes what no other unit writes, and how work is cut into units depends on shapes alone, so
//! that results are the same bits for any number of threads.

/// Calls `unit` with every index below `num_units`, in any order, perhaps at the same time.
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

/// A slice of which several units write disjoint parts at the same time.
pub(crate) struct SharedSlice<'a> {
    start: *mut f32,
    len: usize,
    slice: std::marker::PhantomData<&'a mut [f32]>,
}

// SAFETY: the only access is through `range`, whose callers promise disjoint parts.
unsafe impl Sync for SharedSlice<'_> {}
// SAFETY: as above; `f32` is `Send`.
unsafe impl Send for SharedSlice<'_> {}

impl<'a> SharedSlice<'a> {
    /// Borrows a slice for the units of one loop.
    pub(crate) fn new(slice: &'a mut [f32]) -> Self {
        Self {
            start: slice.as_mut_ptr(),
            len: slice.len(),
            slice: std::marker::PhantomData,
        }
    }

    /// The `len` elements from `start`.
    ///
    /// # Safety
    /// No two ranges that live at the same time overlap.
    #[allow(clippy::mut_from_ref)] // The point of the type: disjoint parts of one borrowed slice.
    pub(crate) unsafe fn range(&self, start: usize, len: usize) -> &'a mut [f32] {
        assert!(
            start <= self.len && len <= self.len - start,
            "range {start}+{len} of a slice of {}",
            self.len
        );
        // SAFETY: in bounds by the assertion, borrowed for 'a, and disjoint by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start), len) }
    }
}
