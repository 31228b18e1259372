//! Links and named files in documents exist, cells of tables are short, no merge conflict markers remain, and
//! ARCHITECTURE.md's table agrees with cargo.
#![allow(missing_docs, clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sdg_checks::{crate_rows, headings, links, named_files, names_in_code};
use sha2::{Digest, Sha256};

/// Folders of the repository whose files are named by path in documents.
const FOLDERS: [&str; 11] = [
    "benches",
    "checks",
    "crates",
    "datasets",
    "docs",
    "fuzz",
    "python",
    "scripts",
    "tests",
    "weights-conversion",
    ".ci",
];

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The files that match a pattern, tracked or new and not ignored by git, as paths from the root.
pub fn tracked(pattern: &str) -> Vec<String> {
    let output = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard", "--", pattern])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let files: Vec<String> = String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect();
    assert!(!files.is_empty(), "expected files that match {pattern}, found none: is this a git checkout?");
    // A file whose deletion is not yet committed is still listed.
    files.into_iter().filter(|file| root().join(file).exists()).collect()
}

/// Conflict markers in documents and scripts do not break any build or run.
#[test]
fn no_merge_has_left_its_marks() {
    let marks = ["<", ">"].map(|mark| format!("{} ", mark.repeat(7)));
    let mut faults = Vec::new();
    for file in
        ["*.md", "*.rs", "*.toml", "*.py", "*.sh", "*.html", "*.css", "*.js"].iter().flat_map(|kind| tracked(kind))
    {
        // Files that are not UTF-8 are not merged line by line.
        let Ok(text) = fs::read_to_string(root().join(&file)) else { continue };
        let lines =
            text.lines().enumerate().filter(|(_, line)| marks.iter().any(|mark| line.starts_with(mark.as_str())));
        faults.extend(lines.map(|(idx, line)| format!("{file}:{}: {line}", idx + 1)));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn links_lead_to_files_and_headings() {
    let mut faults = Vec::new();
    for document in tracked("*.md") {
        let path = root().join(&document);
        for link in links(&fs::read_to_string(&path).unwrap()) {
            if link.starts_with("http://") || link.starts_with("https://") || link.starts_with("mailto:") {
                continue;
            }
            let (file, anchor) =
                link.split_once('#').map_or((link.as_str(), None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            if !target.exists() {
                faults.push(format!("{document}: no file at {link}"));
            } else if let Some(anchor) =
                anchor.filter(|_| target.extension().is_some_and(|extension| extension == "md"))
                && !headings(&fs::read_to_string(&target).unwrap()).iter().any(|heading| heading == anchor)
            {
                faults.push(format!("{document}: no heading at {link}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The site has the pages that docs/SUMMARY.md lists. The list must have all of docs, and the documents to which they
/// link, because the site would have no page for other links.
#[test]
fn the_site_s_summary_has_every_guide_and_what_guides_link_to() {
    let folder = root().join("docs");
    let path_of = |document: &Path, link: &str| {
        let file = link.split('#').next().unwrap();
        (!file.is_empty() && !link.contains("://"))
            .then(|| document.parent().unwrap().join(file).canonicalize().unwrap())
    };
    let summary = folder.join("SUMMARY.md");
    let listed: Vec<PathBuf> =
        links(&fs::read_to_string(&summary).unwrap()).iter().filter_map(|link| path_of(&summary, link)).collect();
    let pages: BTreeSet<PathBuf> = listed.iter().cloned().collect();
    assert_eq!(pages.len(), listed.len(), "docs/SUMMARY.md lists a page twice");
    let mut missing = BTreeSet::new();
    let mut expect = |page: PathBuf, why: &str| {
        if page.extension().is_some_and(|extension| extension == "md") && page != summary && !pages.contains(&page) {
            missing.insert(format!("{}, {why}", page.display()));
        }
    };
    for guide in tracked("docs/*.md") {
        expect(root().join(guide), "a guide");
    }
    for page in &pages {
        for target in links(&fs::read_to_string(page).unwrap()).iter().filter_map(|link| path_of(page, link)) {
            expect(target, &format!("to which {} leads", page.display()));
        }
    }
    assert!(missing.is_empty(), "docs/SUMMARY.md lacks\n{}", missing.into_iter().collect::<Vec<_>>().join("\n"));
}

#[test]
fn files_that_documents_name_exist() {
    let mut faults = Vec::new();
    for document in tracked("*.md") {
        let path = root().join(&document);
        for file in named_files(&fs::read_to_string(&path).unwrap(), &FOLDERS) {
            // Relative to the repository's root, or to the document's own folder.
            if !root().join(&file).exists() && !path.with_file_name(&file).exists() {
                faults.push(format!("{document}: no file {file}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Longest text of a table's cell, in characters.
const MAX_CELL: usize = 120;

#[test]
fn cells_of_tables_are_short() {
    let mut faults = Vec::new();
    for document in tracked("*.md") {
        let text = fs::read_to_string(root().join(&document)).unwrap();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| line.starts_with('|')) {
            for cell in line.split('|').map(|cell| cell.trim().chars().count()).filter(|len| *len > MAX_CELL) {
                faults.push(format!("{document}:{}: a cell of {cell} characters, at most {MAX_CELL}", number + 1));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Dependencies by crate, without those for tests and builds, and whether they are optional; names without `sdg-`.
fn dependencies() -> BTreeMap<String, BTreeMap<String, bool>> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let arguments = ["metadata", "--no-deps", "--offline", "--format-version", "1"];
    let output = Command::new(cargo).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let short = |name: &serde_json::Value| name.as_str().unwrap().trim_start_matches("sdg-").to_owned();
    let packages = metadata["packages"].as_array().unwrap();
    let normal = |package: &serde_json::Value| {
        let all = package["dependencies"].as_array().unwrap().iter();
        let all = all.filter(|dependency| dependency["kind"].is_null());
        all.map(|dependency| (short(&dependency["name"]), dependency["optional"].as_bool().unwrap())).collect()
    };
    packages.iter().map(|package| (short(&package["name"]), normal(package))).collect()
}

/// The crates that a crate needs without optional features, directly or through others.
fn needed(name: &str, dependencies: &BTreeMap<String, BTreeMap<String, bool>>) -> BTreeSet<String> {
    let mut open = vec![name.to_owned()];
    let mut reached = BTreeSet::new();
    while let Some(next) = open.pop() {
        let needed = dependencies.get(&next).into_iter().flatten().filter(|(_, is_optional)| !**is_optional);
        open.extend(needed.map(|(name, _)| name.clone()).filter(|name| reached.insert(name.clone())));
    }
    reached
}

#[test]
fn the_crate_table_has_cargo_s_arrows_and_they_point_up_the_table() {
    let rows = crate_rows(&fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap());
    let dependencies = dependencies();
    let names: BTreeSet<&String> = rows.iter().map(|row| &row.name).collect();
    let crates: BTreeSet<&String> = dependencies.keys().collect();
    assert_eq!(names, crates, "expected the workspace's crates (right) in ARCHITECTURE.md's table (left)");
    for (place, row) in rows.iter().enumerate() {
        let told: BTreeSet<&String> = row.sees.iter().collect();
        let seen: BTreeMap<&String, bool> = dependencies[&row.name]
            .iter()
            .filter(|(name, _)| crates.contains(name))
            .map(|(name, is_optional)| (name, *is_optional))
            .collect();
        // A crate follows from another one that is always there, or from an optional one if it is optional itself.
        let follows = |name: &String, is_optional: bool| {
            seen.iter().any(|(other, is_other_optional)| {
                *other != name && (is_optional || !is_other_optional) && needed(other, &dependencies).contains(name)
            })
        };
        let expected: BTreeSet<&String> =
            seen.iter().filter(|(name, is_optional)| !follows(name, **is_optional)).map(|(name, _)| *name).collect();
        assert_eq!(told, expected, "{}: ARCHITECTURE.md's table (left), cargo metadata (right)", row.name);
        let below: Vec<_> = rows[place..].iter().map(|row| &row.name).filter(|name| seen.contains_key(*name)).collect();
        assert!(below.is_empty(), "{} depends on {below:?}, which are below it in ARCHITECTURE.md's table", row.name);
    }
}

#[test]
fn crates_that_never_see_burn_do_not() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let line = text.lines().find(|line| line.starts_with("- ") && line.contains("never see burn")).unwrap();
    let dependencies = dependencies();
    let free = names_in_code(line);
    assert!(free.len() > 5, "expected the crates that never see burn, found {free:?}");
    for name in free {
        let mut open = vec![name.clone()];
        let mut reached = BTreeSet::new();
        while let Some(next) = open.pop() {
            assert!(!next.starts_with("burn"), "{name} depends on {next}");
            if reached.insert(next.clone()) {
                open.extend(dependencies.get(&next).into_iter().flatten().map(|(name, _)| name.clone()));
            }
        }
    }
}

/// The text after `start` up to the next quotation mark.
fn quoted<'a>(text: &'a str, start: &str) -> Option<&'a str> {
    text.split_once(start)?.1.split('"').next()
}

/// Cargo accepts an earlier compatible version, and CI does not use the Python package and CMake in each run.
#[test]
fn every_version_is_that_of_the_workspace() {
    let read = |file: &str| fs::read_to_string(root().join(file)).unwrap();
    let mut faults = Vec::new();
    let mut compare = |file: &str, found: Option<&str>, expected: &str| {
        if found != Some(expected) {
            faults.push(format!("{file}: expected version {expected}, found {found:?}"));
        }
    };
    let version = env!("CARGO_PKG_VERSION");
    for manifest in tracked("*Cargo.toml") {
        for line in read(&manifest).lines().filter(|line| line.starts_with("sdg-") && line.contains("path = ")) {
            // Not the end of a name, such as sdg-weights-conversion.
            if line.contains(" version = ") {
                compare(&manifest, quoted(line, " version = \""), version);
            }
        }
    }
    let package = "python/sdg/__init__.py";
    compare(package, quoted(&read(package), "\n__version__ = \""), version);
    let expected = concat!(env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));
    for file in ["docs/c.md", "crates/capi/tests/CMakeLists.txt"] {
        let text = read(file);
        let found = text.split_once("find_package(sdg ").and_then(|(_, rest)| rest.split(' ').next());
        compare(file, found, expected);
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A change of the weights must also change their provenance.
#[test]
fn the_shipped_weights_are_those_whose_provenance_is_told() {
    let document = fs::read_to_string(root().join("docs/decisions/013-base-weights.md")).unwrap();
    let told = document.lines().find_map(|line| line.strip_prefix("| SHA-256 | `")?.split('`').next());
    let weights = fs::read(root().join("crates/grasp/weights/edge.safetensors")).unwrap();
    let found: String = Sha256::digest(&weights).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(
        told,
        Some(found.as_str()),
        "expected the SHA-256 of the document (left), found that of the file (right)"
    );
}
