//! Whether a document's tables of figures tell their commit and whether the program changed since.

use crate::measurements::{Measurement, Measurements};
use crate::tables::{Mark, Table, tables};

/// The words beside a table whose program changed.
pub const CHANGED_SINCE: &str = "changed since";

/// A measurement's age: its commit is no ancestor of HEAD, or a file changed after it, or neither.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Age {
    /// The program is the same.
    Current,
    /// This file changed since.
    Old(String),
    /// The commit is not in the history.
    NoCommit,
    /// The history is not here, so that nothing is known.
    Unknown,
}

/// The faults of a document's tables, one line each: document, table, fault, remedy.
pub fn table_faults(
    name: &str,
    document: &str,
    all: &Measurements,
    age: &mut dyn FnMut(&Measurement) -> Result<Age, String>,
) -> Vec<String> {
    let mut faults = Vec::new();
    for table in tables(document) {
        let place = format!("{name}:{}, section \"{}\"", table.line, table.section);
        let names = match &table.mark {
            None if table.has_figures => {
                faults.push(format!(
                    "{place}: expected a mark above this table of figures, found none; add <!-- measured: NAME --> with \
                     a NAME of checks/tables.toml, or <!-- not measured: REASON -->"
                ));
                continue;
            }
            None => continue,
            Some(Mark::NotMeasured(reason)) if reason.is_empty() => {
                faults.push(format!("{place}: expected a reason after \"not measured:\", found none"));
                continue;
            }
            Some(Mark::NotMeasured(_)) => continue,
            Some(Mark::Measured(names)) => names,
        };
        for measured in names {
            let Some(measurement) = all.measured.get(measured) else {
                faults.push(format!("{place}: expected a measurement of checks/tables.toml, found {measured}"));
                continue;
            };
            match age(measurement) {
                Ok(age) => faults.extend(fault(&table, measurement, &age).map(|fault| format!("{place}: {fault}"))),
                Err(error) => faults.push(format!("{place}: {error}")),
            }
        }
    }
    faults
}

fn fault(table: &Table, measurement: &Measurement, age: &Age) -> Option<String> {
    let Measurement { commit, command, .. } = measurement;
    let with_commit: Vec<&String> = table.paragraphs.iter().filter(|text| names_commit(text, commit)).collect();
    match age {
        Age::NoCommit => Some(format!("expected a commit that is an ancestor of HEAD, found {commit}")),
        _ if with_commit.is_empty() => {
            Some(format!("expected the commit of its measurement, {commit}, in the text of its section, found none"))
        }
        Age::Old(file) if !with_commit.iter().any(|text| text.contains(CHANGED_SINCE)) => Some(format!(
            "it was measured at {commit}, and {file} changed since; make it again (`{command}`), or write beside it \
             what {CHANGED_SINCE} {commit}"
        )),
        _ => None,
    }
}

/// Whether a text has a commit's hash, in any length from seven digits on.
fn names_commit(text: &str, commit: &str) -> bool {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    words.filter(|word| word.len() >= 7).any(|word| commit.starts_with(word) || word.starts_with(commit))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MANIFEST: &str = "[parts]\nsearch = [\"src\"]\n[measured.speed]\ncommit = \"abcdef12\"\ncommand = \"make bench\"\nparts = [\"search\"]";
    const TABLE: &str = "| x | ms |\n|---|--:|\n| a | 1 |\n";

    fn faults(document: &str, age: &Age) -> Vec<String> {
        table_faults("a.md", document, &Measurements::read(MANIFEST).unwrap(), &mut |_| Ok(age.clone()))
    }

    #[test]
    fn a_table_of_figures_needs_a_mark() {
        let found = faults(&format!("# T\n\n{TABLE}"), &Age::Current);
        assert!(found[0].starts_with("a.md:3, section \"T\": expected a mark"), "{found:?}");
        assert!(faults(&format!("# T\n\n<!-- not measured: sizes -->\n{TABLE}"), &Age::Current).is_empty());
        assert_eq!(faults(&format!("# T\n\n<!-- not measured: -->\n{TABLE}"), &Age::Current).len(), 1);
        assert_eq!(faults(&format!("# T\n\n<!-- measured: other -->\n{TABLE}"), &Age::Current).len(), 1);
        assert!(faults("| a | b |\n|---|---|\n| c | d |", &Age::Current).is_empty());
    }

    #[test]
    fn a_table_has_its_commit_beside_it() {
        let marked = |text: &str| format!("# T\n\n{text}\n\n<!-- measured: speed -->\n{TABLE}");
        assert!(faults(&marked("Commit abcdef1."), &Age::Current).is_empty());
        assert_eq!(faults(&marked("Commit abcdef13."), &Age::Current).len(), 1);
        assert_eq!(faults(&marked("Commit abcdef1."), &Age::NoCommit).len(), 1);
        assert!(faults(&marked("Commit abcdef1."), &Age::Unknown).is_empty());
    }

    #[test]
    fn an_old_table_says_so() {
        let old = Age::Old("src/a.rs".to_owned());
        let marked = |text: &str| format!("# T\n\n{text}\n\n<!-- measured: speed -->\n{TABLE}");
        let found = faults(&marked("Commit abcdef12.\n\nThe search changed since."), &old);
        let expected = "a.md:8, section \"T\": it was measured at abcdef12, and src/a.rs changed since; make it again \
            (`make bench`), or write beside it what changed since abcdef12";
        assert_eq!(found, [expected]);
        assert!(faults(&marked("Measured at abcdef12;\nthe search changed since."), &old).is_empty());
    }
}
