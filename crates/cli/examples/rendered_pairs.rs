//! Photo and picture laid over each other on the tuned sets of a split that have exact truth: what the likeness is trained on besides
//! generated parts.
//!
//! `rendered_pairs SPLIT SETS OUT`: `train_likeness --rendered OUT` reads the file. A part's index is its place in the split.

use std::path::Path;

use anyhow::{Result, bail};
use sdg_evaluation::split::{ReadySet, Side, read_split};
use sdg_files::write_atomically;
use sdg_grasp::fitting::{PairFacts, append_pair, likeness_examples};

/// Kinds of pictures in which other things cover the part.
const COVERING: &str = "clutter";

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [split, sets, out] = &arguments[..] else {
        bail!("usage: rendered_pairs SPLIT SETS OUT");
    };
    let mut bytes = Vec::new();
    let tuned = read_split(Path::new(split))?.into_iter().enumerate().filter(|(_, set)| set.side == Side::Tuned);
    for (idx, set) in tuned {
        let name = set.name.clone();
        let Some((part, kinds)) = ReadySet::open(set, Path::new(sets))?.fit_part()? else {
            continue;
        };
        let (mut right, mut wrong) = (0, 0);
        for example in likeness_examples(&part)? {
            let facts = PairFacts {
                stream: 0,
                part_idx: u16::try_from(idx)?,
                is_right: example.is_right,
                is_clear: kinds[example.picture_idx] != COVERING,
            };
            append_pair(&mut bytes, facts, &example.pair);
            *if example.is_right { &mut right } else { &mut wrong } += 1;
        }
        println!("{name}: {right} right, {wrong} wrong");
    }
    write_atomically(Path::new(out), &bytes)?;
    Ok(())
}
