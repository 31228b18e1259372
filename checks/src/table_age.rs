//! Whether a document's tables of figures state their commit and whether the program changed since.

use crate::measurements::{Measurement, Measurements};
use crate::tables::{Mark, Table, tables};

/// The words beside a table whose program changed.
pub const CHANGED_SINCE: &str = "changed since";

/// Whether the program changed since a measurement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Age {
    /// The program is the same.
    Current,
    /// This file changed since.
    Old(String),
    /// The commit is not in the history.
    NoCommit,
    /// The history is missing, so the age is unknown.
    Unknown,
}

/// The faults of a document's tables: document, table, fault, remedy. Tables with the same fault share a line.
pub fn table_faults(
    name: &str,
    document: &str,
    all: &Measurements,
    age: &mut dyn FnMut(&Measurement) -> Result<Age, String>,
) -> Vec<String> {
    let mut faults: Vec<(String, usize, String)> = Vec::new();
    for table in tables(document) {
        for fault in faults_of(&table, all, age) {
            match faults.iter_mut().find(|(_, _, other)| *other == fault) {
                Some((_, more, _)) => *more += 1,
                None => faults.push((format!("{name}:{}, section \"{}\"", table.line, table.section), 0, fault)),
            }
        }
    }
    let line = |(place, more, fault)| match more {
        0 => format!("{place}: {fault}"),
        more => format!("{place}, and {more} more: {fault}"),
    };
    faults.into_iter().map(line).collect()
}

fn faults_of(
    table: &Table,
    all: &Measurements,
    age: &mut dyn FnMut(&Measurement) -> Result<Age, String>,
) -> Vec<String> {
    let names = match &table.mark {
        None if table.has_figures => {
            return vec![
                "expected a mark above this table of figures, found none; add <!-- measured: NAME --> with a NAME of \
                 checks/tables.toml, or <!-- not measured: REASON -->"
                    .to_owned(),
            ];
        }
        Some(Mark::NotMeasured(reason)) if reason.is_empty() => {
            return vec!["expected a reason after \"not measured:\", found none".to_owned()];
        }
        None | Some(Mark::NotMeasured(_)) => return Vec::new(),
        Some(Mark::Measured(names)) => names,
    };
    let fault_of = |name: &String| match all.measured.get(name) {
        None => Some(format!("expected a measurement of checks/tables.toml, found {name}")),
        Some(measurement) => match age(measurement) {
            Ok(age) => fault(table, measurement, &age),
            Err(error) => Some(error),
        },
    };
    names.iter().filter_map(fault_of).collect()
}

fn fault(table: &Table, measurement: &Measurement, age: &Age) -> Option<String> {
    let Measurement { commit, command, .. } = measurement;
    let notes: Vec<&str> = table.paragraphs.iter().flat_map(|text| notes_on(text, commit)).collect();
    match age {
        Age::NoCommit => Some(format!("expected a commit that is an ancestor of HEAD, found {commit}")),
        _ if notes.is_empty() => {
            Some(format!("expected the commit of its measurement, {commit}, in the text of its section, found none"))
        }
        Age::Old(file) if !notes.iter().any(|note| note.contains(CHANGED_SINCE)) => Some(format!(
            "it was measured at {commit}, and {file} changed since; make it again (`{command}`), or write after the \
             commit beside it what {CHANGED_SINCE}"
        )),
        _ => None,
    }
}

/// For each mention of a commit in a text: the text after it, up to the next commit. Commits with nothing but "and", a
/// comma or a bracket between them have the same note.
fn notes_on<'a>(text: &'a str, commit: &str) -> Vec<&'a str> {
    let hashes = hashes(text);
    let mut notes = Vec::new();
    for (idx, &(_, end, hash)) in hashes.iter().enumerate() {
        if !commit.starts_with(hash) && !hash.starts_with(commit) {
            continue;
        }
        let mut note_start = end;
        let mut note_end = text.len();
        for &(next_start, next_end, _) in &hashes[idx + 1..] {
            if !matches!(text[note_start..next_start].trim(), "and" | "," | "" | "(" | ")") {
                note_end = next_start;
                break;
            }
            note_start = next_end;
        }
        notes.push(&text[note_start..note_end]);
    }
    notes
}

/// The words of a text that may be hashes of commits, with their start and end: hexadecimal, from seven digits on, with
/// a digit and a letter.
fn hashes(text: &str) -> Vec<(usize, usize, &str)> {
    let (mut found, mut start) = (Vec::new(), 0);
    let is_end = |c: char| !c.is_ascii_alphanumeric();
    for piece in text.split_inclusive(is_end) {
        let word = piece.trim_end_matches(is_end);
        let is_hex = word.len() >= 7 && word.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'));
        if is_hex && word.contains(|c: char| c.is_ascii_digit()) && word.contains(|c: char| c.is_ascii_lowercase()) {
            found.push((start, start + word.len(), word));
        }
        start += piece.len();
    }
    found
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
            (`make bench`), or write after the commit beside it what changed since";
        assert_eq!(found, [expected]);
        assert!(faults(&marked("Measured at abcdef12;\nthe search changed since."), &old).is_empty());
    }

    #[test]
    fn a_note_belongs_to_the_commits_before_it() {
        let text = "Rows at abcdef12 and 12345ab, others at fedcba1 (the search changed since).";
        assert_eq!(notes_on(text, "abcdef1"), [", others at "]);
        assert_eq!(notes_on(text, "12345ab"), [", others at "]);
        assert_eq!(notes_on(text, "fedcba12"), [" (the search changed since)."]);
        assert!(notes_on(text, "1234567").is_empty() && notes_on("1000000 pictures", "1000000").is_empty());
    }

    #[test]
    fn tables_with_the_same_fault_share_a_line() {
        let found = faults(&format!("# T\n\n{TABLE}\n{TABLE}\n# U\n\n{TABLE}"), &Age::Current);
        assert!(found.len() == 1 && found[0].starts_with("a.md:3, section \"T\", and 2 more: "), "{found:?}");
    }
}
