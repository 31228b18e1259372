//! Processes many pictures in parallel.

use rayon::prelude::*;

use crate::error::Result;

/// Applies `work` to each input; the results are in the order of the inputs. Two cores with one picture each finish
/// earlier than both cores on one picture after the other, because the kernels and searches of one picture are too
/// short to be divided well.
///
/// # Errors
/// The error of one of the inputs that failed.
pub(super) fn side_by_side<I: Sync, O: Send>(
    inputs: &[I],
    work: impl Fn(&I) -> Result<O> + Sync + Send,
) -> Result<Vec<O>> {
    inputs.par_iter().map(work).collect()
}
