//! Refits the constants of the verification on generated parts, and prints the fitted values beside the present ones.
//! Changes no file.
//!
//! `cargo run --release -p sdg-grasp --example fit_constants -- [--parts N] [--rounds N] [--size WxH[,WxH]] [--seed S]
//! [--only NAME[,NAME]]`; `--only score` fits the weights of the score alone, which takes minutes instead of hours.
//!
//! Generates N parts (40), equally many for each picture size (320x240), half of them for fitting, half held out. Each
//! part has one demonstration and, per round (1 round), one picture under each of the generator's conditions and four
//! without the part: two with look-alikes, two cluttered. The objective and the intervals are those of
//! [`sdg_grasp::fitting`]. The same arguments give the same output.

mod drawn;

use std::time::Instant;

use sdg_grasp::fitting::{FitEvent, FitOptions, constant_names, fit};
use sdg_part_generator::{Condition, SceneConfig};

use crate::drawn::{Result, absent, draw_parts};

struct Arguments {
    parts: usize,
    rounds: u64,
    sizes: Vec<[u32; 2]>,
    seed: u64,
    only: Vec<String>,
}

impl Arguments {
    fn read(arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut read = Self { parts: 40, rounds: 1, sizes: vec![[320, 240]], seed: 1, only: Vec::new() };
        let mut arguments = arguments;
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("expected a value after {name}, found none"))?;
            match name.as_str() {
                "--parts" => read.parts = value.parse()?,
                "--rounds" => read.rounds = value.parse()?,
                "--seed" => read.seed = value.parse()?,
                "--only" => read.only = value.split(',').map(str::to_owned).collect(),
                "--size" => read.sizes = value.split(',').map(read_size).collect::<Result<_>>()?,
                _ => {
                    let known = "--parts, --rounds, --size, --seed or --only";
                    return Err(format!("expected {known}, found {name}").into());
                }
            }
        }
        if read.parts < 4 {
            return Err(format!("expected --parts of at least 4, found {}", read.parts).into());
        }
        if let Some(unknown) = read.only.iter().find(|name| !constant_names().contains(&name.as_str())) {
            return Err(format!("expected --only of {}, found {unknown}", constant_names().join(", ")).into());
        }
        Ok(read)
    }
}

fn read_size(text: &str) -> Result<[u32; 2]> {
    let (width, height) = text.split_once('x').ok_or_else(|| format!("expected --size WxH, found {text}"))?;
    Ok([width.parse()?, height.parse()?])
}

fn main() -> Result<()> {
    let arguments = Arguments::read(std::env::args().skip(1))?;
    let start = Instant::now();
    // Every other part is held out, so that both halves contain all sizes.
    let (mut parts, mut held_out) = (Vec::new(), Vec::new());
    let kinds = Condition::ALL
        .map(|condition| (SceneConfig::only(condition), arguments.rounds))
        .into_iter()
        .chain([Condition::LookAlikes, Condition::Clutter].map(|condition| (absent(condition), 2 * arguments.rounds)));
    let kinds: Vec<_> = kinds.collect();
    for (idx, size) in arguments.sizes.iter().enumerate() {
        let seed = arguments.seed.wrapping_mul(10).wrapping_add(idx as u64);
        for part in draw_parts(arguments.parts / arguments.sizes.len(), *size, &kinds, seed)? {
            let side = if parts.len() <= held_out.len() { &mut parts } else { &mut held_out };
            side.push(part);
        }
    }
    let num_pictures: usize = parts.iter().chain(&held_out).map(|part| part.pictures.len()).sum();
    let num_parts = parts.len() + held_out.len();
    eprintln!("{num_parts} parts, {num_pictures} pictures, {:.0} s", start.elapsed().as_secs_f64());

    let mut options = FitOptions::default();
    options.seed = arguments.seed;
    options.only = arguments.only;
    let report = fit(&parts, &held_out, &options, &mut |event| {
        let seconds = start.elapsed().as_secs_f64();
        match event {
            FitEvent::Searching { constant, value } => eprintln!("{seconds:6.0} s  {constant} = {value}"),
            FitEvent::Score(report) => eprintln!("{report}"),
            FitEvent::Fitted(report) => eprintln!("{report}  {}", report.tried()),
            _ => {}
        }
    })?;
    println!("{report}");
    Ok(())
}
