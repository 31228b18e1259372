//! The last second of an arm's states, kept after an error.

use std::path::Path;

use anyhow::Result;
use sdg_robot::Watch;

/// Writes what was seen last, and says where; nothing where no state was seen.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write_states(path: &Path, watch: &Watch) -> Result<()> {
    if watch.states().len() == 0 {
        return Ok(());
    }
    sdg_files::write(path, watch.states_csv().as_bytes())?;
    eprintln!("the arm's last second: {}", path.display());
    Ok(())
}
