//! Reusable buffers, which avoid requests of memory from the system.

use std::cell::RefCell;
use std::ops::{Deref, DerefMut};

thread_local! {
    static FREE: RefCell<Vec<Vec<f32>>> = const { RefCell::new(Vec::new()) };
}

/// A borrowed buffer. When it is dropped, it joins the free buffers of the dropping thread. Its contents are arbitrary.
pub(crate) struct Scratch {
    buffer: Vec<f32>,
    len: usize,
}

impl Scratch {
    /// A buffer of `len` floats with arbitrary values.
    pub(crate) fn take(len: usize) -> Self {
        let mut buffer = FREE.with_borrow_mut(|free| {
            // The smallest sufficient buffer, otherwise the largest one, which then grows.
            let fitting = (0..free.len()).filter(|&idx| free[idx].len() >= len).min_by_key(|&idx| free[idx].len());
            let chosen = fitting.or_else(|| (0..free.len()).max_by_key(|&idx| free[idx].len()));
            chosen.map_or_else(Vec::new, |idx| free.swap_remove(idx))
        });
        if buffer.len() < len {
            buffer.resize(len, 0.0);
        }
        Self { buffer, len }
    }
}

impl Deref for Scratch {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.buffer[..self.len]
    }
}

impl DerefMut for Scratch {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.buffer[..self.len]
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let buffer = std::mem::take(&mut self.buffer);
        // The thread may be ending, and its free list may be gone; then the buffer is also
        // freed.
        let _ = FREE.try_with(|free| free.borrow_mut().push(buffer));
    }
}
