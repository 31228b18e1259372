//! The figures as JSON.

use serde_json::{Value, json};

use super::counts::{Counts, FIGURES};
use super::file::Side;
use super::run::{Measured, SetRun};
use crate::labelled_pictures::{DEFAULT_MIN_SCORE, Tested, by_kind_json, by_min_score};
use crate::statistics::{newcombe_interval, wilson_interval};

/// The results of a model as one object: each seed with its sets and sides, the worst of all seeds, and the difference
/// between tuned and reported.
pub fn summary(measured: &Measured, sides: &[Side]) -> Value {
    let worst = |side: Side| measured.worst(|run, _| run.set.side == side);
    let of_seed = |seed: &u64| {
        let runs: Vec<&SetRun> = measured.runs.iter().filter(|run| run.seed == *seed).collect();
        let sides = sides.iter().map(|side| {
            let of_side: Vec<&Tested> =
                runs.iter().filter(|run| run.set.side == *side).flat_map(|run| &run.tested).collect();
            let mut value = of_counts(&Counts::of(of_side.iter().copied()));
            value["side"] = json!(side);
            value["kinds"] = json!(by_kind_json(&of_side, DEFAULT_MIN_SCORE));
            value["by_min_score"] = json!(by_min_score(&of_side));
            value
        });
        json!({
            "seed": seed,
            "sides": sides.collect::<Vec<_>>(),
            "sets": runs.iter().map(|run| of_set(run)).collect::<Vec<_>>(),
        })
    };
    let worst_of_side = |side: &Side| {
        let mut value = of_counts(&worst(*side));
        value["side"] = json!(side);
        value
    };
    let has_both = [Side::Tuned, Side::Reported].iter().all(|side| sides.contains(side));
    let differences = has_both.then(|| {
        let (tuned, reported) = (worst(Side::Tuned), worst(Side::Reported));
        FIGURES.map(
            |(name, figure)| json!({"figure": name, "interval": newcombe_interval(figure(&tuned), figure(&reported))}),
        )
    });
    json!({
        "model": measured.model,
        "pictures_per_second": measured.pictures_per_second(),
        "seeds": measured.seeds.iter().map(of_seed).collect::<Vec<_>>(),
        "worst": sides.iter().map(worst_of_side).collect::<Vec<_>>(),
        "tuned_less_reported": differences,
    })
}

fn of_counts(counts: &Counts) -> Value {
    json!({
        "found": counts.found,
        "found_interval": wilson_interval(counts.found),
        "wrong": counts.wrong,
        "wrong_interval": wilson_interval(counts.wrong),
        "false_alarms": counts.false_alarms,
        "false_alarms_interval": wilson_interval(counts.false_alarms),
    })
}

fn of_set(run: &SetRun) -> Value {
    let tested: Vec<&Tested> = run.tested.iter().collect();
    let mut value = json!(Counts::of(tested.iter().copied()));
    value["set"] = json!(run.set.name);
    value["side"] = json!(run.set.side);
    value["teach_seconds"] = json!(run.teach_secs);
    value["pictures"] = json!(tested.len());
    value["detect_seconds"] = json!(tested.iter().map(|tested| tested.seconds).sum::<f64>());
    value["kinds"] = json!(by_kind_json(&tested, DEFAULT_MIN_SCORE));
    value
}
