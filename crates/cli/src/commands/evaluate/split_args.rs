//! The arguments of `sdg evaluate --split`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// The heading of these options in the help.
const SPLIT: &str = "Sets on both sides of a split";

/// What `sdg evaluate --split` reads, counts and writes.
pub const SPLIT_HELP: &str = "\
Sets on both sides of a split (--split FILE --sets DIR):
  FILE (datasets/split.toml, docs/file-formats.md) names sets of pictures below DIR, how each is taught, and its side: tuned (constants may
  be fitted on it), used (earlier constants were) or reported. Every set is taught by each of --models (without it, S) with each of
  --seeds and the defaults of `sdg teach`, and its pictures are searched as by `sdg detect`; counted as by --pictures. Printed as
  tables: each set, each kind of picture, and the sides beside each other with 95 % intervals (Wilson) and the difference of tuned
  and reported (Newcombe), which is beyond chance where its interval does not hold zero. Both take detections as independent.
  With several seeds each figure is the worst of them. Wrong is out of all detections accepted on pictures with the part.

  --json, or --results FILE beside the tables, gives one object: split, sides, models [{model, pictures_per_second, seeds [{seed,
  sides [{side, found, wrong, false_alarms {count, of}, their _interval, kinds, by_min_score}], sets [{set, side, found, wrong,
  false_alarms, pictures, teach_seconds, detect_seconds, kinds}]}], worst [as sides], tuned_less_reported [{figure, interval}] or
  null}]. --records FILE gets a JSON line for each candidate, accepted or not: set, side, model, seed, image, kind, place (right,
  wrong_turn, misplaced: within half a diagonal, wrong), hit (part, optional or null), distance_percent, turn_deg, and the fields of a
  detection of `sdg detect --json`.";

/// Teaches and measures sets, both those that may be tuned on and the others.
#[derive(Debug, ClapArgs)]
pub struct SplitArgs {
    /// Teach and measure the sets that a file names, what may be tuned on beside what is only reported. The end of --help says
    /// what is counted
    #[arg(
        long,
        value_name = "FILE",
        requires = "sets",
        conflicts_with_all = [
            "pictures", "objects", "attempts", "views", "scenes", "unverified", "preset", "steps", "time_budget", "seed",
            "jobs", "out", "report", "sheet", "sharing",
        ],
        help_heading = SPLIT
    )]
    pub split: Option<PathBuf>,
    /// The folder that holds the sets' folders
    #[arg(long, value_name = "DIR", requires = "split", help_heading = SPLIT)]
    pub sets: Option<PathBuf>,
    /// The tuned side alone: nothing of the others is read or printed
    #[arg(long, requires = "split", help_heading = SPLIT)]
    pub tuned: bool,
    /// Seeds to teach with
    #[arg(
        long,
        default_value = "1",
        value_name = "N,…",
        value_delimiter = ',',
        requires = "split",
        help_heading = SPLIT
    )]
    pub seeds: Vec<u64>,
    /// Write the object of --json into a file, beside the tables
    #[arg(long, value_name = "FILE", requires = "split", help_heading = SPLIT)]
    pub results: Option<PathBuf>,
    /// Write a JSON line for each candidate of the measured sides, with what it is by the truth
    #[arg(long, value_name = "FILE", requires = "split", help_heading = SPLIT)]
    pub records: Option<PathBuf>,
}
