//! No file of a crate imports from another that imports from it, directly or through others.
#![allow(missing_docs, clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use sdg_checks::ModuleGraph;

/// Groups of files that may import from each other: the crate's folder, the group's first file, and why.
const EXCEPTIONS: [(&str, &str, &str); 0] = [];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn crate_folders() -> Vec<String> {
    let crates = fs::read_dir(root().join("crates")).unwrap();
    let names = crates.map(|entry| format!("crates/{}", entry.unwrap().file_name().to_string_lossy()));
    let others = ["base-weights", "benches", "checks", "tests", "weights-conversion"].map(str::to_owned);
    names.chain(others).filter(|folder| root().join(folder).join("src").is_dir()).collect()
}

#[test]
fn no_files_import_from_each_other() {
    let folders = crate_folders();
    assert!(folders.len() > 20, "expected the workspace's crates, found {folders:?}");
    let (mut found, mut faults) = (BTreeSet::new(), String::new());
    for folder in folders {
        let graph = ModuleGraph::read(&root().join(&folder).join("src")).unwrap();
        for group in graph.cycles() {
            let exception = EXCEPTIONS.into_iter().find(|&(known, first, _)| known == folder && first == group[0]);
            match exception {
                Some(exception) => {
                    found.insert(exception);
                }
                None => faults.push_str(&format!("{folder}/src:\n{}", graph.imports_within(&group))),
            }
        }
    }
    assert!(faults.is_empty(), "expected no files that import from each other, found\n{faults}");
    let solved: Vec<_> = EXCEPTIONS.into_iter().filter(|exception| !found.contains(exception)).collect();
    assert!(solved.is_empty(), "these exceptions are none any more, take them out of the list: {solved:?}");
}
