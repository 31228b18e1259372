//! The table of crates in ARCHITECTURE.md.

/// A row of the table: a crate, and the workspace's crates that it depends on, without those that follow from others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CrateRow {
    /// The crate's name without the prefix `sdg-`.
    pub name: String,
    /// The names between backticks in the last column.
    pub sees: Vec<String>,
}

/// The rows of the table with the header `| crate | holds | sees |`, in order.
pub fn crate_rows(document: &str) -> Vec<CrateRow> {
    let mut lines = document.lines().skip_while(|line| cells(line) != ["crate", "holds", "sees"]);
    lines.next();
    let rows = lines.take_while(|line| line.starts_with('|')).skip(1);
    rows.filter_map(|line| match cells(line)[..] {
        [name, _, sees] => Some(CrateRow { name: name.trim_matches('`').to_owned(), sees: names_in_code(sees) }),
        _ => None,
    })
    .collect()
}

fn cells(line: &str) -> Vec<&str> {
    line.trim().trim_matches('|').split('|').map(str::trim).collect()
}

/// The texts between backticks.
pub fn names_in_code(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_a_name_and_what_is_in_code() {
        let table = "text\n\n| crate | holds | sees |\n|---|---|---|\n| `a` | all `x` | |\n| `b` | more | `a`; to teach `c` |\n\nafter";
        let expected = [
            CrateRow { name: "a".into(), sees: vec![] },
            CrateRow { name: "b".into(), sees: vec!["a".into(), "c".into()] },
        ];
        assert_eq!(crate_rows(table), expected);
    }
}
