//! Where the list of projects that were opened lately is kept.

use std::path::{Path, PathBuf};

use sdg_annotate::RecentProjects;

/// The list in the folder for a user's state, as the XDG base directories have it; `None` without a home.
pub fn projects() -> Option<RecentProjects> {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = absolute("XDG_STATE_HOME").or_else(|| Some(absolute("HOME")?.join(".local/state")))?;
    Some(RecentProjects::at(state.join("single-demo-grasp/recent-projects.json")))
}

/// Puts what was opened into the list. A list that cannot be written keeps nobody from working.
pub fn note(opened: &Path) {
    let noted = projects().map(|recent| recent.note(opened));
    if let Some(Err(error)) = noted {
        eprintln!("not in the list of projects: {error}");
    }
}
