//! Work distributed over the cores, if there are several; results never depend on it.

/// Applies `work` to every item, in the items' order.
#[cfg(feature = "parallel")]
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(work).collect()
}

/// Applies `work` to every item, in the items' order.
#[cfg(not(feature = "parallel"))]
pub fn map<T, R>(items: &[T], work: impl Fn(&T) -> R) -> Vec<R> {
    items.iter().map(work).collect()
}

/// Two pieces of work, the second on another core if one is free.
#[cfg(feature = "parallel")]
pub fn join<A: Send, B: Send>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(one, other)
}

/// Two pieces of work, one after the other.
#[cfg(not(feature = "parallel"))]
pub fn join<A, B>(one: impl FnOnce() -> A, other: impl FnOnce() -> B) -> (A, B) {
    (one(), other())
}

/// Applies `work` to chunks of `len` values, each with its index.
#[cfg(feature = "parallel")]
pub fn for_each_stretch<T: Send>(values: &mut [T], len: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    use rayon::prelude::*;
    values.par_chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
}

/// Applies `work` to chunks of `len` values, each with its index.
#[cfg(not(feature = "parallel"))]
pub fn for_each_stretch<T>(values: &mut [T], len: usize, work: impl Fn(usize, &mut [T])) {
    values.chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
}
