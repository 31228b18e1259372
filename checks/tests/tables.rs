//! Tables of figures state the commit of their measurement, and whether the program changed since
//! (docs/decisions/032-age-of-tables.md).
#![allow(missing_docs, clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use sdg_checks::{Age, History, Mark, Measurement, Measurements, table_faults, tables};

use crate::documents::{root, tracked};

fn measurements() -> Measurements {
    Measurements::read(&fs::read_to_string(root().join("checks/tables.toml")).unwrap()).unwrap()
}

fn documents() -> Vec<(String, String)> {
    tracked("*.md").into_iter().map(|name| (name.clone(), fs::read_to_string(root().join(name)).unwrap())).collect()
}

/// Ages of measurements in a repository with full history.
struct Ages<'a> {
    history: History,
    all: &'a Measurements,
    /// A changed file, by commit and part: many measurements have both in common.
    changed: BTreeMap<(String, String), Option<String>>,
}

impl<'a> Ages<'a> {
    fn new(root: &Path, all: &'a Measurements) -> Self {
        Self { history: History::new(root), all, changed: BTreeMap::new() }
    }

    fn of(&mut self, measurement: &Measurement) -> Result<Age, String> {
        let last = self.all.last_commit(measurement);
        if [&measurement.commit, last].iter().any(|commit| !self.history.is_ancestor(commit)) {
            return Ok(Age::NoCommit);
        }
        for part in &measurement.parts {
            let key = (last.to_owned(), part.clone());
            if !self.changed.contains_key(&key) {
                let file = self.history.changed_since(last, &self.all.parts[part])?;
                self.changed.insert(key.clone(), file);
            }
            if let Some(file) = &self.changed[&key] {
                return Ok(Age::Old(file.clone()));
            }
        }
        Ok(Age::Current)
    }
}

#[test]
fn tables_of_figures_tell_their_commit_and_whether_the_program_changed_since() {
    let all = measurements();
    let mut ages = Ages::new(&root(), &all);
    let is_shallow = ages.history.is_shallow();
    if is_shallow {
        eprintln!(
            "SKIPPED: this clone has no full history, so the age of tables is not checked, only their marks; \
             `git fetch --unshallow` brings the history"
        );
    }
    let mut age_of = |measurement: &Measurement| if is_shallow { Ok(Age::Unknown) } else { ages.of(measurement) };
    let faults: Vec<String> =
        documents().iter().flat_map(|(name, text)| table_faults(name, text, &all, &mut age_of)).collect();
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn every_measurement_and_part_is_used_and_every_path_exists() {
    let all = measurements();
    let used: BTreeSet<String> = documents()
        .iter()
        .flat_map(|(_, text)| tables(text))
        .filter_map(|table| match table.mark {
            Some(Mark::Measured(names)) => Some(names),
            _ => None,
        })
        .flatten()
        .collect();
    let unused: Vec<_> = all.measured.keys().filter(|name| !used.contains(*name)).collect();
    assert!(unused.is_empty(), "checks/tables.toml has measurements that no table names: {unused:?}");
    let same: BTreeSet<&String> =
        all.measured.values().filter_map(|measurement| measurement.same_at.as_ref()).collect();
    let unused: Vec<_> = all.same_at.keys().filter(|name| !same.contains(name)).collect();
    assert!(unused.is_empty(), "checks/tables.toml has entries of [same_at] that no measurement names: {unused:?}");
    let parts: BTreeSet<&String> = all.measured.values().flat_map(|measurement| &measurement.parts).collect();
    let unused: Vec<_> = all.parts.keys().filter(|part| !parts.contains(part)).collect();
    assert!(unused.is_empty(), "checks/tables.toml has parts that no measurement names: {unused:?}");
    let missing: Vec<_> = all.parts.values().flatten().filter(|path| !root().join(path).exists()).collect();
    assert!(missing.is_empty(), "checks/tables.toml names files that do not exist: {missing:?}");
}

/// In a temporary repository, the check must find a table that became old, and only when the program on which it
/// depends computes something else.
#[test]
fn a_planted_old_table_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("src/a.rs", "pub const LIMIT: f64 = 0.5;\n");
    write("src/b.rs", "pub fn f() {}\n");
    let commit = commit_all(folder.path());
    let manifest = format!(
        "[parts]\nsearch = [\"src\"]\n[measured.speed]\ncommit = \"{commit}\"\ncommand = \"make bench\"\nparts = [\"search\"]"
    );
    let all = Measurements::read(&manifest).unwrap();
    let document = |note: &str| {
        format!(
            "# Speed\n\nMeasured at {commit}{note}.\n\n<!-- measured: speed -->\n| x | ms |\n|---|--:|\n| a | 1 |\n"
        )
    };
    let faults = |note: &str| {
        table_faults("a.md", &document(note), &all, &mut |measurement| Ages::new(folder.path(), &all).of(measurement))
    };
    assert_eq!(faults(""), Vec::<String>::new());

    // A comment, a test, and a function that moved to another file.
    write("src/a.rs", "/// Accepted from here on.\npub const LIMIT: f64 = 0.5;\nfn f() {}\n");
    write("src/b.rs", "#[cfg(test)]\nmod tests {\n    fn g() {}\n}\n");
    write("src/tests.rs", "fn h() {}\n");
    commit_all(folder.path());
    assert_eq!(faults(""), Vec::<String>::new());

    write("src/a.rs", "pub const LIMIT: f64 = 0.6;\nfn f() {}\n");
    let found = faults("");
    let remedy = format!(
        "a.md:6, section \"Speed\": it was measured at {commit}, and src/a.rs changed since; make it again (`make bench`)"
    );
    assert!(found.len() == 1 && found[0].starts_with(&remedy), "{found:?}");
    assert_eq!(faults("; the limit changed since"), Vec::<String>::new());

    let other = manifest.replace(&commit, "0123456789");
    let all = Measurements::read(&other).unwrap();
    let found =
        table_faults("a.md", &document(""), &all, &mut |measurement| Ages::new(folder.path(), &all).of(measurement));
    assert!(found[0].contains("expected a commit that is an ancestor of HEAD, found 0123456789"), "{found:?}");
}

#[test]
fn a_clone_without_history_is_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let [origin, clone] = ["origin", "clone"].map(|name| folder.path().join(name));
    fs::create_dir(&origin).unwrap();
    for text in ["a", "b"] {
        fs::write(origin.join("file"), text).unwrap();
        commit_all(&origin);
    }
    let url = format!("file://{}", origin.display());
    let output = Command::new("git").args(["clone", "--quiet", "--depth", "1", &url]).arg(&clone).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!([&origin, &clone].map(|folder| History::new(folder).is_shallow()), [false, true]);
}

/// Commits all files of a new or existing repository and returns the commit's hash.
fn commit_all(folder: &Path) -> String {
    let git = |arguments: &[&str]| {
        let identity = ["-c", "user.name=test", "-c", "user.email=test@example.invalid", "-c", "commit.gpgsign=false"];
        let output = Command::new("git").args(identity).args(arguments).current_dir(folder).output().unwrap();
        assert!(output.status.success(), "git {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    git(&["init", "--quiet"]);
    git(&["add", "--all"]);
    git(&["commit", "--quiet", "--message", "a step"]);
    git(&["rev-parse", "HEAD"]).trim().to_owned()
}
