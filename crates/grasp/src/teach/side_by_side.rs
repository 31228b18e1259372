//! Many pictures at once.

use rayon::prelude::*;

use crate::error::Result;

/// What `work` makes of each input, in their order. Two cores that look at a picture each are done sooner than both at one
/// picture after the other, whose kernels and searches are too short to be shared well.
///
/// # Errors
/// The first that failed.
pub(super) fn side_by_side<I: Sync, O: Send>(
    inputs: &[I],
    work: impl Fn(&I) -> Result<O> + Sync + Send,
) -> Result<Vec<O>> {
    inputs.par_iter().map(work).collect()
}
