//! Many pictures in parallel.

use rayon::prelude::*;

use crate::error::Result;

/// Applies `work` to each input; results are in their order. Two cores with one picture each finish earlier than both
/// on one picture after the other, whose kernels and searches are too short to be shared well.
///
/// # Errors
/// The first that failed.
pub(super) fn side_by_side<I: Sync, O: Send>(
    inputs: &[I],
    work: impl Fn(&I) -> Result<O> + Sync + Send,
) -> Result<Vec<O>> {
    inputs.par_iter().map(work).collect()
}
