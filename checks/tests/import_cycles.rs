//! No file of a crate imports from another one that imports from it, directly or indirectly; the same holds for
//! folders.
#![allow(missing_docs, clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use sdg_checks::ModuleGraph;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn crate_folders() -> Vec<String> {
    let crates = fs::read_dir(root().join("crates")).unwrap();
    let names = crates.map(|entry| format!("crates/{}", entry.unwrap().file_name().to_string_lossy()));
    let others =
        ["base-weights", "benches", "checks", "fuzz", "python", "tests", "tests/endurance", "weights-conversion"];
    names.chain(others.map(str::to_owned)).collect()
}

/// Sources of crates, tests and examples with their graphs.
fn graphs() -> Vec<(String, ModuleGraph)> {
    let mut graphs = Vec::new();
    for folder in crate_folders() {
        for part in ["src", "tests"] {
            let sources = root().join(&folder).join(part);
            if sources.is_dir() {
                graphs.push((format!("{folder}/{part}"), ModuleGraph::read(&sources).unwrap()));
            }
        }
        for example in fs::read_dir(root().join(&folder).join("examples")).into_iter().flatten() {
            let path = example.unwrap().path();
            let name = format!("{folder}/examples/{}", path.file_name().unwrap().to_string_lossy());
            if path.extension().is_some_and(|extension| extension == "rs") {
                graphs.push((name, ModuleGraph::read_example(&path).unwrap()));
            } else if path.join("main.rs").is_file() {
                graphs.push((name, ModuleGraph::read(&path).unwrap()));
            }
        }
    }
    assert!(graphs.len() > 30, "expected the workspace's crates and examples, found {}", graphs.len());
    graphs
}

#[test]
fn no_files_import_from_each_other() {
    let graphs = graphs();
    let faults = graphs.iter().flat_map(|(name, graph)| {
        graph.cycles().into_iter().map(move |group| format!("{name}:\n{}", graph.imports_within(&group)))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "expected no files that import from each other, found\n{}", faults.concat());
}

#[test]
fn no_folders_import_from_each_other() {
    let graphs = graphs();
    let faults = graphs.iter().flat_map(|(name, graph)| {
        let circles = graph.folder_cycles().into_iter();
        circles.map(move |group| format!("{name}: {}\n{}", group.join(", "), graph.imports_between(&group)))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "expected no folders that import from each other, found\n{}", faults.concat());
}
