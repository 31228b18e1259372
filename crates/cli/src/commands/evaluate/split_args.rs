//! The arguments of `sdg evaluate --split`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// The heading of these options in the help.
const SPLIT: &str = "Sets on both sides of a split";

/// Help on the input, counts and output of `sdg evaluate --split`.
pub const SPLIT_HELP: &str = "\
Sets on both sides of a split (--split FILE --sets DIR):
  FILE (datasets/split.toml, docs/file-formats.md) names sets of pictures below DIR, how each is taught, and its side: tuned
  (constants may be fitted on it), used (earlier constants were fitted on it) or reported. Every set is taught with each of
  --models (default: S) and each of --seeds, with the defaults of `sdg teach`; its pictures are searched as by `sdg detect` and
  counted as by --pictures. The tables show each set, each kind of picture, and the sides with 95 % intervals (Wilson), and the
  difference of tuned and reported (Newcombe), which is significant if its interval does not contain zero. Both intervals assume
  independent detections. With several seeds, each figure is the worst of them. Wrong detections are given as a fraction of all
  accepted ones on pictures with the part.

  --json, or --results FILE beside the tables, gives one object: split, sides, models [{model, pictures_per_second, seeds [{seed,
  sides [{side, found, wrong, false_alarms {count, of}, found_interval, wrong_interval, false_alarms_interval, kinds,
  by_min_score}], sets [{set, side, found, wrong, false_alarms, pictures, teach_seconds, detect_seconds, kinds}]}], worst [as
  sides], tuned_less_reported [{figure, interval}] or null}]. --records FILE writes a JSON line for each candidate, accepted or
  not: set, side, model, seed, image, kind, place (right, wrong_turn, misplaced: within half a diagonal, wrong), hit (part,
  optional or null), distance_percent, turn_deg, and the fields of a detection of `sdg detect --json`.";

/// Teaches and measures the sets that may be used for tuning and the sets that are only reported.
#[derive(Debug, ClapArgs)]
pub struct SplitArgs {
    /// Teach and measure the sets named in a file, separately for sets that may be used for tuning and sets that are
    /// only reported. The end of --help describes the counts
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
    /// The folder with the folders of the sets
    #[arg(long, value_name = "DIR", requires = "split", help_heading = SPLIT)]
    pub sets: Option<PathBuf>,
    /// Only the tuned sets; the other sets are neither read nor printed
    #[arg(long, requires = "split", help_heading = SPLIT)]
    pub tuned: bool,
    /// Seeds of the teachings
    #[arg(
        long,
        default_value = "1",
        value_name = "N,…",
        value_delimiter = ',',
        requires = "split",
        help_heading = SPLIT
    )]
    pub seeds: Vec<u64>,
    /// Also write the object of --json to this file
    #[arg(long, value_name = "FILE", requires = "split", help_heading = SPLIT)]
    pub results: Option<PathBuf>,
    /// Write one JSON line for each candidate of the measured sides, with its judgement by the ground truth
    #[arg(long, value_name = "FILE", requires = "split", help_heading = SPLIT)]
    pub records: Option<PathBuf>,
}
