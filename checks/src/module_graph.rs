//! The imports between the files of a crate.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, io};

use crate::paths::{mentions, named_paths};
use crate::source_text::{code_of, modules_for_tests};

/// A module's path from the crate's root; the root's own path is empty.
type ModulePath = Vec<String>;

/// The files of one crate and their imports, without files compiled only for tests. A module's `pub use` of its own
/// child is not an import, unless the module also uses that name itself. A name imported through such a re-export
/// counts as imported from its definition.
#[derive(Debug, Default)]
pub struct ModuleGraph {
    files: BTreeMap<ModulePath, String>,
    imports: BTreeMap<ModulePath, BTreeSet<ModulePath>>,
}

impl ModuleGraph {
    /// The graph of all `.rs` files below a crate's `src`.
    ///
    /// # Errors
    /// A folder or file cannot be read.
    pub fn read(src: &Path) -> io::Result<Self> {
        let mut sources = Vec::new();
        let mut folders = vec![src.to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder)? {
                let path = entry?.path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs") {
                    let name = path.strip_prefix(src).unwrap_or(&path).to_string_lossy().replace('\\', "/");
                    sources.push((name, fs::read_to_string(&path)?));
                }
            }
        }
        Ok(Self::new(sources.iter().map(|(name, source)| (name.as_str(), source.as_str()))))
    }

    /// The graph of an example: its own file, the files in the folder with the same name, and modules shared by
    /// examples.
    ///
    /// # Errors
    /// A folder or file cannot be read.
    pub fn read_example(file: &Path) -> io::Result<Self> {
        let mut sources = vec![("main.rs".to_owned(), fs::read_to_string(file)?)];
        let mut add = |folder: &Path, prefix: &str| -> io::Result<()> {
            for entry in fs::read_dir(folder).into_iter().flatten() {
                let path = entry?.path();
                if path.extension().is_some_and(|extension| extension == "rs") {
                    let name = path.file_name().unwrap_or_default().to_string_lossy();
                    sources.push((format!("{prefix}{name}"), fs::read_to_string(&path)?));
                }
            }
            Ok(())
        };
        add(&file.with_extension(""), "")?;
        // Modules shared by several examples.
        for entry in fs::read_dir(file.parent().unwrap_or(file))? {
            let path = entry?.path();
            if path.join("mod.rs").is_file() {
                add(&path, &format!("{}/", path.file_name().unwrap_or_default().to_string_lossy()))?;
            }
        }
        Ok(Self::new(sources.iter().map(|(name, source)| (name.as_str(), source.as_str()))))
    }

    /// The graph of sources given with their paths below `src`, with `/` as separator.
    pub fn new<'a>(sources: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut files = BTreeMap::new();
        let mut codes = BTreeMap::new();
        let mut tests: BTreeMap<ModulePath, BTreeSet<String>> = BTreeMap::new();
        for (name, source) in sources {
            let module = module_path(name);
            files.insert(module.clone(), name.to_owned());
            tests.insert(module.clone(), modules_for_tests(source));
            codes.insert(module, code_of(source));
        }
        let for_tests = |module: &ModulePath| {
            (1..=module.len()).any(|depth| {
                let (parent, child) = (&module[..depth - 1], &module[depth - 1]);
                tests.get(parent).is_some_and(|tests| tests.contains(child))
            })
        };
        files.retain(|module, _| !for_tests(module));
        codes.retain(|module, _| !for_tests(module));
        let mut graph = Self { files, imports: BTreeMap::new() };

        let mut exports: BTreeMap<(ModulePath, String), ModulePath> = BTreeMap::new();
        let mut named = Vec::new();
        for (module, code) in &codes {
            for path in named_paths(code) {
                let Some(target) = graph.absolute(module, &path.segments) else { continue };
                if let Some(name) = &path.exported_as {
                    exports.insert((module.clone(), name.clone()), target.clone());
                    let is_own_child = target.starts_with(module);
                    if is_own_child && !mentions(code, name) {
                        continue;
                    }
                }
                named.push((module, target));
            }
        }
        for (module, target) in named {
            let home = graph.home_of(target, &exports);
            if home != *module {
                graph.imports.entry(module.clone()).or_default().insert(home);
            }
        }
        graph
    }

    /// The path from the crate's root of `segments` in `module`; `None` if it is not in this crate.
    fn absolute(&self, module: &ModulePath, segments: &[String]) -> Option<ModulePath> {
        let mut base = module.clone();
        let mut rest = segments;
        match segments.first()?.as_str() {
            "crate" => {
                base.clear();
                rest = &segments[1..];
            }
            "super" | "self" => {
                while let [first, others @ ..] = rest {
                    match first.as_str() {
                        "super" => base.truncate(base.len().saturating_sub(1)),
                        "self" => {}
                        _ => break,
                    }
                    rest = others;
                }
            }
            first => {
                let child = [base.as_slice(), &[first.to_owned()]].concat();
                if !self.files.contains_key(&child) {
                    return None;
                }
            }
        }
        base.extend_from_slice(rest);
        Some(base)
    }

    /// The module that defines the item at `path`, followed through re-exports.
    fn home_of(&self, mut path: ModulePath, exports: &BTreeMap<(ModulePath, String), ModulePath>) -> ModulePath {
        // The maximum number of consecutive re-exports without a cycle.
        for _ in 0..=exports.len() {
            let depth =
                (0..=path.len()).rev().find(|&depth| self.files.contains_key(&path[..depth])).unwrap_or_default();
            let (module, item) = path.split_at(depth);
            let exported = item.first().and_then(|name| exports.get(&(module.to_vec(), name.clone())));
            match exported {
                Some(target) if *target != path => path = [target.as_slice(), &item[1..]].concat(),
                _ => return module.to_vec(),
            }
        }
        path
    }

    /// Groups of files in which each file imports, directly or indirectly, from every other one. The files of a group,
    /// and the groups, are sorted.
    pub fn cycles(&self) -> Vec<Vec<String>> {
        let reached: BTreeMap<&ModulePath, BTreeSet<&ModulePath>> =
            self.files.keys().map(|module| (module, self.reached_from(module))).collect();
        let mut groups: Vec<Vec<String>> = Vec::new();
        let mut grouped = BTreeSet::new();
        for module in self.files.keys() {
            if !reached[module].contains(module) || !grouped.insert(module) {
                continue;
            }
            let mut group = vec![self.files[module].clone()];
            for other in self.files.keys() {
                if other != module && reached[module].contains(other) && reached[other].contains(module) {
                    grouped.insert(other);
                    group.push(self.files[other].clone());
                }
            }
            group.sort();
            groups.push(group);
        }
        groups.sort();
        groups
    }

    /// Groups of a folder's direct entries, files or folders, that import from each other. A folder represents all
    /// files in it, so two folders may form a cycle even if no two files do. Each group is sorted and written with the
    /// folder's path.
    pub fn folder_cycles(&self) -> Vec<Vec<String>> {
        let folders: BTreeSet<&[String]> =
            self.files.keys().flat_map(|module| (0..module.len()).map(|depth| &module[..depth])).collect();
        let mut groups = Vec::new();
        for folder in folders {
            let entry = |module: &ModulePath| {
                (module.starts_with(folder) && module.len() > folder.len()).then(|| module[..=folder.len()].to_vec())
            };
            let mut entries = Self::default();
            for module in self.files.keys().filter_map(entry) {
                entries.files.insert(module.clone(), module.join("/"));
            }
            for (module, imported) in &self.imports {
                let Some(from) = entry(module) else { continue };
                let others = imported.iter().filter_map(entry).filter(|to| *to != from);
                entries.imports.entry(from.clone()).or_default().extend(others);
            }
            groups.extend(entries.cycles());
        }
        groups
    }

    /// The imports among the entries of a group of [`Self::folder_cycles`], one per line.
    pub fn imports_between(&self, group: &[String]) -> String {
        let entry = |module: &ModulePath| {
            group.iter().find(|entry| {
                module.join("/").strip_prefix(*entry).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            })
        };
        let mut lines = String::new();
        for (module, imported) in &self.imports {
            for to in imported {
                let (Some(from_entry), Some(to_entry)) = (entry(module), entry(to)) else { continue };
                if from_entry != to_entry {
                    lines.push_str(&format!("    {} -> {}\n", self.files[module], self.files[to]));
                }
            }
        }
        lines
    }

    /// The imports among the files of a group, one per line.
    pub fn imports_within(&self, group: &[String]) -> String {
        let mut lines = String::new();
        for (module, imported) in &self.imports {
            let from = &self.files[module];
            for to in imported.iter().filter_map(|module| self.files.get(module)) {
                if group.contains(from) && group.contains(to) {
                    lines.push_str(&format!("    {from} -> {to}\n"));
                }
            }
        }
        lines
    }

    fn reached_from(&self, start: &ModulePath) -> BTreeSet<&ModulePath> {
        let mut reached = BTreeSet::new();
        let mut open: Vec<&ModulePath> = self.imports.get(start).into_iter().flatten().collect();
        while let Some(module) = open.pop() {
            if reached.insert(module) {
                open.extend(self.imports.get(module).into_iter().flatten());
            }
        }
        reached
    }
}

fn module_path(name: &str) -> ModulePath {
    let stem = name.strip_suffix(".rs").unwrap_or(name);
    let mut path: ModulePath = stem.split('/').map(str::to_owned).collect();
    if path.last().is_some_and(|last| matches!(last.as_str(), "lib" | "main" | "mod")) {
        path.pop();
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_through_the_root_is_imported_from_its_home() {
        let graph = ModuleGraph::new([
            ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
            ("a.rs", "use crate::B;"),
            ("b.rs", "use crate::A;"),
        ]);
        assert_eq!(graph.cycles(), [["a.rs", "b.rs"]]);
    }

    #[test]
    fn a_re_export_of_a_child_is_no_import_but_its_use_is() {
        let child = ("a/child.rs", "use super::Parent;");
        let only_exported = ModuleGraph::new([("a/mod.rs", "mod child; pub use child::C; struct Parent;"), child]);
        assert!(only_exported.cycles().is_empty());
        let used = ModuleGraph::new([("a/mod.rs", "mod child; pub use child::C; struct Parent(C);"), child]);
        assert_eq!(used.cycles(), [["a/child.rs", "a/mod.rs"]]);
    }

    #[test]
    fn two_folders_form_a_circle_though_no_two_files_do() {
        let graph = ModuleGraph::new([
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a/mod.rs", "mod one; mod two;"),
            ("a/one.rs", "use crate::b::one::B;"),
            ("a/two.rs", "struct A;"),
            ("b/mod.rs", "mod one; mod two;"),
            ("b/one.rs", "struct B;"),
            ("b/two.rs", "use crate::a::two::A; use super::one::B;"),
            ("c.rs", "use crate::a::two::A;"),
        ]);
        assert!(graph.cycles().is_empty());
        let circles = graph.folder_cycles();
        assert_eq!(circles, [["a", "b"]]);
        assert_eq!(graph.imports_between(&circles[0]).lines().count(), 2);
    }

    #[test]
    fn a_cycle_of_three_is_one_group() {
        let graph = ModuleGraph::new([
            ("a.rs", "use crate::b::f;"),
            ("b.rs", "fn f() { super::c::g() }"),
            ("c.rs", "use crate::{a::h, d};"),
            ("d.rs", "// use crate::a;"),
        ]);
        assert_eq!(graph.cycles(), [["a.rs", "b.rs", "c.rs"]]);
        assert_eq!(graph.imports_within(&graph.cycles()[0]).lines().count(), 3);
    }
}
