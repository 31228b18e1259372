//! The figures as Markdown tables: sets, kinds of pictures, and sides.

use sdg_report::{Cell, Column, Table};

use super::counts::FIGURES;
use super::file::Side;
use super::run::{Measured, kind_of};
use crate::statistics::{Share, newcombe_interval, wilson_interval};

/// The kinds of all pictures, in order of first appearance.
fn kinds(measured: &Measured) -> Vec<&str> {
    let mut kinds = Vec::new();
    for kind in measured.runs.iter().flat_map(|run| run.tested.iter().map(kind_of)) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds
}

/// All tables of a model. With several seeds, each figure is the worst one.
pub fn tables(measured: &Measured, sides: &[Side]) -> String {
    let seeds: Vec<String> = measured.seeds.iter().map(u64::to_string).collect();
    let seeds = match seeds.as_slice() {
        [seed] => format!("seed {seed}"),
        seeds => format!("the worst of seeds {}, each figure separately", seeds.join(", ")),
    };
    let speed =
        measured.pictures_per_second().map_or_else(String::new, |speed| format!("; {speed:.1} pictures per second"));
    let [sets, kinds, totals] =
        [of_sets(measured), of_kinds(measured, sides), of_sides(measured, sides)].map(|table| table.to_markdown());
    format!("model {}, {seeds}{speed}\n\n{sets}\n{kinds}\n{totals}", measured.model)
}

fn of_sets(measured: &Measured) -> Table {
    let mut table = Table::new(vec![
        Column::text("set"),
        Column::text("side"),
        Column::text("found"),
        Column::number("wrong"),
        Column::text("false alarms"),
    ]);
    for run in measured.runs.iter().filter(|run| run.seed == measured.seeds[0]) {
        let counts = measured.worst(|other, _| other.set.name == run.set.name);
        table = table.row(vec![
            Cell::text(&run.set.name),
            Cell::text(run.set.side.name()),
            Cell::text(counts.found.to_string()),
            Cell::number(counts.wrong.count as f64, 0),
            Cell::text(counts.false_alarms.to_string()),
        ]);
    }
    table
}

fn of_kinds(measured: &Measured, sides: &[Side]) -> Table {
    let mut table = with_sides("kind", sides, None);
    for kind in kinds(measured) {
        let cell = |side: &Side| {
            let counts = measured.worst(|run, tested| run.set.side == *side && kind_of(tested) == kind);
            Cell::text(counts.in_words())
        };
        table = table.row(std::iter::once(Cell::text(kind)).chain(sides.iter().map(cell)).collect());
    }
    table
}

/// Each side with Wilson's intervals; and, if both are measured, the difference between tuned and reported with
/// Newcombe's.
fn of_sides(measured: &Measured, sides: &[Side]) -> Table {
    let has_both = [Side::Tuned, Side::Reported].iter().all(|side| sides.contains(side));
    let mut table = with_sides("95 % intervals", sides, has_both.then_some("tuned − reported"));
    let counts = |side: Side| measured.worst(|run, _| run.set.side == side);
    for (name, figure) in FIGURES {
        let mut row = vec![Cell::text(name)];
        row.extend(sides.iter().map(|side| Cell::text(with_interval(figure(&counts(*side))))));
        if has_both {
            row.push(Cell::text(difference(figure(&counts(Side::Tuned)), figure(&counts(Side::Reported)))));
        }
        table = table.row(row);
    }
    table
}

fn with_sides(first: &str, sides: &[Side], last: Option<&str>) -> Table {
    let names = std::iter::once(first).chain(sides.iter().map(|side| side.name())).chain(last);
    Table::new(names.map(Column::text).collect())
}

fn with_interval(share: Share) -> String {
    let [low, high] = wilson_interval(share).map(|bound| 100.0 * bound);
    share.percent().map_or("–".to_owned(), |percent| format!("{share}: {percent:.1} % ({low:.1} to {high:.1})"))
}

/// The difference in percentage points; it is significant if the interval does not contain zero.
fn difference(tuned: Share, reported: Share) -> String {
    let (Some(one), Some(other)) = (tuned.percent(), reported.percent()) else { return "–".to_owned() };
    let [low, high] = newcombe_interval(tuned, reported);
    let verdict = if low > 0.0 || high < 0.0 { "beyond chance" } else { "within chance" };
    format!("{:+.1} ({:+.1} to {:+.1}): {verdict}", one - other, 100.0 * low, 100.0 * high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_beyond_chance_where_its_interval_does_not_hold_zero() {
        let share = |count: usize, of: usize| Share { count, of };
        assert_eq!(difference(share(56, 70), share(48, 80)), "+20.0 (+5.2 to +33.4): beyond chance");
        assert_eq!(difference(share(48, 80), share(56, 70)), "-20.0 (-33.4 to -5.2): beyond chance");
        assert!(difference(share(9, 10), share(8, 10)).ends_with("within chance"));
        assert_eq!(difference(share(1, 2), share(0, 0)), "–");
        assert_eq!(with_interval(share(8, 10)), "8 of 10: 80.0 % (49.0 to 94.3)");
    }
}
