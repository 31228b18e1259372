//! Work spread over the cores where there are any; results never depend on how.

/// `work` done on every item, in the items' order.
#[cfg(feature = "parallel")]
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(work).collect()
}

/// `work` done on every item, in the items' order.
#[cfg(not(feature = "parallel"))]
pub fn map<T, R>(items: &[T], work: impl Fn(&T) -> R) -> Vec<R> {
    items.iter().map(work).collect()
}

/// Two pieces of work, the second on another core where one is free.
#[cfg(feature = "parallel")]
pub fn join<A: Send, B: Send>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(one, other)
}

/// Two pieces of work, one after the other.
#[cfg(not(feature = "parallel"))]
pub fn join<A, B>(one: impl FnOnce() -> A, other: impl FnOnce() -> B) -> (A, B) {
    (one(), other())
}

/// `work` done on stretches of `len` values, each with its number.
#[cfg(feature = "parallel")]
pub fn for_each_stretch<T: Send>(values: &mut [T], len: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    use rayon::prelude::*;
    values.par_chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
}

/// `work` done on stretches of `len` values, each with its number.
#[cfg(not(feature = "parallel"))]
pub fn for_each_stretch<T>(values: &mut [T], len: usize, work: impl Fn(usize, &mut [T])) {
    values.chunks_mut(len).enumerate().for_each(|(number, values)| work(number, values));
}
