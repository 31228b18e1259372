//! Outcomes as a table: one row per weights and number of steps, summed over the parts that all rows have.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use crate::outcome::Outcome;

/// Formats the outcomes as Markdown, over the parts that were measured in every row; `only` selects the weights by
/// name, all if it is empty.
pub fn table(outcomes: &[Outcome], only: &[String]) -> String {
    let mut rows: BTreeMap<(&str, usize), Vec<&Outcome>> = BTreeMap::new();
    for outcome in outcomes.iter().filter(|outcome| only.is_empty() || only.contains(&outcome.weights)) {
        rows.entry((&outcome.weights, outcome.steps)).or_default().push(outcome);
    }
    let parts_of = |row: &Vec<&Outcome>| row.iter().map(|outcome| outcome.part).collect::<BTreeSet<u64>>();
    let common = rows.values().map(parts_of).reduce(|a, b| &a & &b).unwrap_or_default();
    let mut text = format!("Parts {common:?}\n\n");
    text += "| weights | steps | found | wrong | placed | separated | false alarms | look-alikes taken | processor s | not learnt |\n";
    text += "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
    for ((weights, steps), row) in &rows {
        let row: Vec<&Outcome> = row.iter().copied().filter(|outcome| common.contains(&outcome.part)).collect();
        let sum = |value: fn(&Outcome) -> usize| row.iter().map(|outcome| value(outcome)).sum::<usize>();
        let secs = row.iter().map(|outcome| outcome.cpu_secs).sum::<f64>() / row.len().max(1) as f64;
        let _ = writeln!(
            text,
            "| {weights} | {steps} | {} of {} | {} | {} | {} | {} of {} | {} of {} | {secs:.0} | {} |",
            sum(|o| o.found),
            sum(|o| o.with),
            sum(|o| o.wrong),
            sum(|o| o.placed),
            sum(|o| o.separated),
            sum(|o| o.alarms),
            sum(|o| o.without),
            sum(|o| o.look_alike_alarms),
            sum(|o| o.look_alikes),
            sum(|o| usize::from(o.failed.is_some())),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::outcomes;

    #[test]
    fn rows_are_summed_over_common_parts() {
        let line = |weights: &str, part: u64, found: usize| {
            format!(
                r#"{{"weights": "{weights}", "part": {part}, "steps": 60, "seed": 1, "with": 10, "found": {found}, "wrong": 1,
                "without": 10, "alarms": 2, "look_alikes": 5, "look_alike_alarms": 3, "placed": 9, "error_px": 1.5,
                "cpu_secs": 20.0, "steps_done": 60}}"#
            )
            .replace('\n', " ")
        };
        let text = [line("a", 1, 7), line("a", 2, 8), line("a", 3, 1), line("b", 1, 3), line("b", 2, 4)].join("\n");
        let table = table(&outcomes(&text), &[]);
        assert!(table.starts_with("Parts {1, 2}"), "{table}");
        assert!(table.contains("| a | 60 | 15 of 20 | 2 | 18 | 0 | 4 of 20 | 6 of 10 | 20 | 0 |"), "{table}");
        assert!(table.contains("| b | 60 | 7 of 20 |"), "{table}");
        let all = outcomes(&text);
        assert!(super::table(&all, &["a".into()]).contains("| a | 60 | 16 of 30 |"));
    }
}
