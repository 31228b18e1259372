//! Shipped parts by the names that options give.

use anyhow::Result;
use sdg_simulation::objects::ObjectSpec;

use crate::exit::Usage;

/// The shipped part that an option names.
///
/// # Errors
/// [`Usage`] with the option and the names that there are.
pub(crate) fn part_named(option: &str, name: &str) -> Result<ObjectSpec> {
    ObjectSpec::by_name(name).map_err(|error| Usage(format!("{option}: {error}")).into())
}
