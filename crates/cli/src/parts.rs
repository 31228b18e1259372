//! Shipped parts by name.

use anyhow::Result;
use sdg_simulation::objects::ObjectSpec;

use crate::exit::Usage;

/// The shipped part that an option names.
///
/// # Errors
/// [`Usage`] with the option and the known names.
pub(crate) fn part_named(option: &str, name: &str) -> Result<ObjectSpec> {
    ObjectSpec::by_name(name).map_err(|error| Usage(format!("{option}: {error}")).into())
}
