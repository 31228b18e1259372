//! `sdg-bench matchers`: compares model S with the alternatives that a user has, on the same pictures: times, found
//! parts and wrong detections.
//!
//! ```text
//! shipped photos, parts drawn on their tables ─┐           ┌─ our side, in this process
//!                                              ├─ picture ─┤                              ─ median times; counts by the labels
//! sets of a split, without its reported side ──┘           └─ peers/matchers.py, one process per peer
//! ```
//! All sides process a picture before the next one, starting with another side each time. Our side accepts detections
//! from a score of 0.5. The peers have no such threshold. Each peer gets the threshold with the largest number of found
//! parts minus wrong detections and false alarms on the same set; a user cannot know this threshold beforehand.

mod counts;
mod peer;
mod sets;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args as ClapArgs;
use sdg_cell::Perception;
use sdg_evaluation::labelled_pictures::Tested;
use sdg_geometry::median;
use sdg_grasp::{CheckConfig, ModelKind, TeachOptions, Verification};

use self::counts::{Counted, best_for, counted};
use self::peer::{PEERS, PeerProcess};
use self::sets::{Case, Group};
use crate::compare::machine::Machine;
use crate::results::rewrite;

/// `sdg-bench matchers`
#[derive(Debug, ClapArgs)]
pub struct MatchersArgs {
    /// Root of the repository
    #[arg(long, default_value = ".", value_name = "DIR")]
    root: PathBuf,
    /// Folder of the split's sets; without it, or if it does not exist, only shipped parts are measured
    #[arg(long, value_name = "DIR")]
    sets: Option<PathBuf>,
    /// Number of timed runs of each side per picture
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    rounds: u32,
    /// Threads of each side
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    threads: u32,
    /// Rewrite the table in this file
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
}

/// Model S with the part's size fixed, as for the peers, and free, which is the default.
const OURS: [&str; 2] = ["ours, size fixed", "ours, size 0.75 to 1.35"];
/// Minimum score of an accepted detection of our side.
const ACCEPTED: f64 = 0.5;

/// The results of a side on the pictures of a group.
struct Side {
    title: String,
    seconds: Vec<f64>,
    tested: Vec<Tested>,
    is_ours: bool,
}

/// Measures every group and prints the table.
pub fn run(args: &MatchersArgs) -> Result<()> {
    let python = args.root.join("target/bench/matchers/bin/python");
    anyhow::ensure!(
        python.exists(),
        "expected the matchers of benches/peers/install-matchers.sh in {}, found none",
        python.display()
    );
    let mut groups = vec![sets::shipped(&args.root)?];
    if let Some(sets) = args.sets.as_ref().filter(|sets| sets.is_dir()) {
        groups.extend(sets::of_split(&args.root, sets)?);
    }
    let mut text = format!(
        "{}; {} threads per side.\n\n| pictures | matcher | a picture | ours, size fixed, is so many times as fast | found | wrong | false alarms |\n|---|---|--:|--:|--:|--:|--:|\n",
        Machine::read().in_words(),
        args.threads
    );
    for group in groups {
        let sides = measure(&group, &python, args).with_context(|| group.name.clone())?;
        let rows = table(&group, &sides);
        eprint!("{rows}");
        text += &rows;
    }
    println!("{text}");
    if let Some(results) = &args.results {
        rewrite(results, "matchers", &text)?;
    }
    Ok(())
}

/// Runs every side on every picture of a group.
fn measure(group: &Group, python: &Path, args: &MatchersArgs) -> Result<Vec<Side>> {
    let titles = OURS.iter().chain(PEERS.iter().map(|(_, title)| title));
    let new = |(idx, title): (usize, &&str)| Side {
        title: (*title).to_owned(),
        seconds: Vec::new(),
        tested: Vec::new(),
        is_ours: idx < OURS.len(),
    };
    let mut sides: Vec<Side> = titles.enumerate().map(new).collect();
    for case in &group.cases {
        measure_case(case, python, args, &mut sides)?;
    }
    Ok(sides)
}

fn measure_case(case: &Case, python: &Path, args: &MatchersArgs, sides: &mut [Side]) -> Result<()> {
    let ours = ours(case)?;
    let pictures = case.pictures(&ours[0])?;
    let script = args.root.join("benches/peers/matchers.py");
    let mut peers = Vec::new();
    for (kind, _) in PEERS {
        peers.push(PeerProcess::start(kind, case, python, &script, args.threads)?);
    }
    for (number, picture) in pictures.into_iter().enumerate() {
        let pixels = sdg_inputs::read_image(&picture.path)?;
        let mut first: Vec<Option<Tested>> = vec![None; sides.len()];
        // The times of the first round do not count, because it reads the picture and prepares caches.
        for round in 0..=args.rounds as usize {
            for turn in 0..sides.len() {
                let idx = (round + turn + number) % sides.len();
                let (seconds, detections) = match ours.get(idx) {
                    Some(ours) => {
                        let start = Instant::now();
                        let found = ours.detect(&pixels, Verification::ByShape)?;
                        let seconds = start.elapsed().as_secs_f64();
                        (seconds, found.into_iter().map(|found| found.detection).collect())
                    }
                    None => peers[idx - ours.len()].find(&picture.path)?,
                };
                if round > 0 {
                    sides[idx].seconds.push(seconds);
                } else {
                    let tested = |instance| sdg_evaluation::labelled_pictures::Truth::new(instance, &ours[0]);
                    let truths = picture.instances.iter().map(tested).collect();
                    first[idx] = Some(Tested { picture: picture.clone(), truths, detections, seconds });
                }
            }
        }
        for (side, tested) in sides.iter_mut().zip(first) {
            side.tested.extend(tested);
        }
    }
    Ok(())
}

/// Model S of a case, in the order of [`OURS`].
fn ours(case: &Case) -> Result<Vec<Perception>> {
    let mut options = TeachOptions::new(1);
    options.kind = ModelKind::S;
    options.symmetry = case.symmetry;
    let observe = &mut |_: &_| std::ops::ControlFlow::Continue(());
    let taught = sdg_grasp::teach(std::slice::from_ref(&case.demonstration), &options, observe)?.model;
    let fixed = taught.clone().with_size_tolerance(CheckConfig::FIXED_HEIGHT_TOLERANCE)?;
    Ok(vec![Perception::of_any_camera(fixed), Perception::of_any_camera(taught)])
}

fn table(group: &Group, sides: &[Side]) -> String {
    let time = |side: &Side| median(side.seconds.iter().copied()).unwrap_or(f64::NAN);
    let ours = sides.first().map_or(f64::NAN, time);
    let row = |side: &Side| {
        let (least, Counted { found, wrong, false_alarms }) =
            if side.is_ours { (ACCEPTED, counted(&side.tested, ACCEPTED)) } else { best_for(&side.tested) };
        let least = if side.is_ours { String::new() } else { format!(", from {least:.2} on") };
        format!(
            "| {} | {}{least} | {:.1} ms | {:.2} | {found} | {wrong} | {false_alarms} |\n",
            group.name,
            side.title,
            1e3 * time(side),
            time(side) / ours
        )
    };
    sides.iter().map(row).collect()
}
