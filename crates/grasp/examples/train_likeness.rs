//! Trains the network that compares photo and picture, `sdg_shape::LikenessNetwork`, on generated parts.
//!
//! `cargo run --release -p sdg-grasp --example train_likeness -- [--parts N] [--held-out N] [--epochs N] [--seed S]
//! [--pairs FILE] [--rendered FILE [--hold-out]] [--out FILE]`
//!
//! Generates N training parts (700) and held-out parts (100): alternately 20 parts with pictures of 640×480 pixels and
//! 20 with pictures of 320×240. Searches their pictures, and trains on the correct and wrong matches for 40 epochs.
//! `--pairs FILE` stores the matches; parts that the file already contains are not generated again. About a third of
//! each
//! batch comes from the FILE of `--rendered`, which the example `rendered_pairs` of sdg-base-weights writes; with
//! `--hold-out` every fourth of its parts is used for the report instead of training. Writes `likeness.safetensors`,
//! half precision. The same arguments give the same file.

mod drawn;
#[path = "train_likeness/edits.rs"]
mod edits;
#[path = "train_likeness/network.rs"]
mod network;
#[path = "train_likeness/pairs.rs"]
mod pairs;
#[path = "train_likeness/rendered.rs"]
mod rendered;

use std::path::PathBuf;
use std::time::Instant;

use sdg_files::write_atomically;

use crate::drawn::Result;
use crate::pairs::{Pairs, Stream};
use crate::rendered::Rendered;

struct Arguments {
    parts: usize,
    held_out: usize,
    epochs: usize,
    seed: u64,
    pairs: Option<PathBuf>,
    rendered: Option<PathBuf>,
    holds_out: bool,
    out: PathBuf,
}

impl Arguments {
    fn read(arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut read = Self {
            parts: 700,
            held_out: 100,
            epochs: 40,
            seed: 31,
            pairs: None,
            rendered: None,
            holds_out: false,
            out: PathBuf::from("likeness.safetensors"),
        };
        let mut arguments = arguments;
        while let Some(name) = arguments.next() {
            if name == "--hold-out" {
                read.holds_out = true;
                continue;
            }
            let value = arguments.next().ok_or_else(|| format!("expected a value after {name}, found none"))?;
            match name.as_str() {
                "--parts" => read.parts = value.parse()?,
                "--held-out" => read.held_out = value.parse()?,
                "--epochs" => read.epochs = value.parse()?,
                "--seed" => read.seed = value.parse()?,
                "--pairs" => read.pairs = Some(value.into()),
                "--rendered" => read.rendered = Some(value.into()),
                "--out" => read.out = value.into(),
                _ => {
                    let known = "--parts, --held-out, --epochs, --seed, --pairs, --rendered, --hold-out or --out";
                    return Err(format!("expected {known}, found {name}").into());
                }
            }
        }
        Ok(read)
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::read(std::env::args().skip(1))?;
    let start = Instant::now();
    let mut say = |text: String| eprintln!("{:6.0} s  {text}", start.elapsed().as_secs_f64());
    let kept = match &arguments.pairs {
        Some(path) if path.exists() => Pairs::read(path)?,
        _ => Pairs::EMPTY,
    };
    let num_kept = kept.len();
    let pairs = kept.drawn_up_to(arguments.parts, arguments.held_out, arguments.seed, &mut say)?;
    if let Some(path) = arguments.pairs.as_ref().filter(|_| pairs.len() > num_kept) {
        pairs.write(path)?;
    }
    for stream in [Stream::Training, Stream::HeldOut] {
        let (right, wrong) = pairs.counts(stream);
        eprintln!("{:6.0} s  {stream:?}: {right} right, {wrong} wrong", start.elapsed().as_secs_f64());
    }
    let rendered = match &arguments.rendered {
        Some(path) => Rendered::read(path, arguments.holds_out)?,
        None => Rendered::EMPTY,
    };
    let bytes = network::train(&pairs, &rendered, arguments.epochs, arguments.seed, &mut |text| {
        eprintln!("{:6.0} s  {text}", start.elapsed().as_secs_f64());
    })?;
    write_atomically(&arguments.out, &bytes)?;
    println!("{}", arguments.out.display());
    Ok(())
}
