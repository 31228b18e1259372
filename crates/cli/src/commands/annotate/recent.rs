//! The location of the list of recent projects.

use std::path::{Path, PathBuf};

use sdg_annotate::RecentProjects;

/// The list of recent projects, in the user's state folder of the XDG base directories; `None` without a home
/// directory.
pub fn projects() -> Option<RecentProjects> {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = absolute("XDG_STATE_HOME").or_else(|| Some(absolute("HOME")?.join(".local/state")))?;
    Some(RecentProjects::at(state.join("single-demo-grasp/recent-projects.json")))
}

/// Adds an opened project to the list. If the list cannot be written, a warning is printed and the program continues.
pub fn note(opened: &Path) {
    let noted = projects().map(|recent| recent.note(opened));
    if let Some(Err(error)) = noted {
        eprintln!("cannot update the list of recent projects: {error}");
    }
}
