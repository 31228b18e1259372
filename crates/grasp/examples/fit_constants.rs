//! Fits the check's constants again on generated parts, and prints what would change. It changes nothing.
//!
//! `cargo run --release -p sdg-grasp --example fit_constants -- [--parts N] [--rounds N] [--size WxH[,WxH]] [--seed S]
//! [--only NAME[,NAME]]`; `--only score` fits the weights of the score alone, which takes minutes instead of hours.
//!
//! Draws N parts (40), equally many of each picture size (320x240), half of them to fit on, half held out, and for each one demonstration and, a round (1), one picture
//! under each of the generator's conditions and four without the part: two with look-alikes, two cluttered. The objective
//! and the intervals are those of [`sdg_grasp::fitting`]. The same arguments give the same output.

use std::time::Instant;

use sdg_grasp::TaughtDemonstration;
use sdg_grasp::fitting::{FitEvent, FitInstance, FitOptions, FitPart, FitPicture, constant_names, fit};
use sdg_part_generator::{
    Condition, LookAlike, OtherKind, OtherObject, Part, PhotoConfig, SceneConfig, Scenes, demonstration,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

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
    // Every other part is held out, so that both halves have all sizes.
    let (mut parts, mut held_out) = (Vec::new(), Vec::new());
    for (idx, size) in arguments.sizes.iter().enumerate() {
        for part in draw_parts(&arguments, *size, idx as u64)? {
            let side = if parts.len() <= held_out.len() { &mut parts } else { &mut held_out };
            side.push(part);
        }
    }
    let num_pictures: usize = parts.iter().chain(&held_out).map(|part| part.pictures.len()).sum();
    let num_parts = parts.len() + held_out.len();
    eprintln!("{num_parts} parts, {num_pictures} pictures, {:.0} s", start.elapsed().as_secs_f64());

    let options = FitOptions { seed: arguments.seed, only: arguments.only };
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

/// Parts that can be taught, each with its pictures.
fn draw_parts(arguments: &Arguments, [width, height]: [u32; 2], size_idx: u64) -> Result<Vec<FitPart>> {
    let seed = arguments.seed.wrapping_mul(10).wrapping_add(size_idx);
    let count = arguments.parts / arguments.sizes.len();
    let photo = PhotoConfig { width, height, ..PhotoConfig::default() };
    // The same photo as the scenes' truth refers to.
    let photo_seed = SceneConfig::default().photo_seed;
    let mut generated = Vec::new();
    let mut parts = Vec::new();
    for seed in (0u64..).map(|i| seed.wrapping_mul(1_000_000).wrapping_add(i)) {
        let part = Part::generate(seed);
        let demonstration = demonstration(&part, &photo, photo_seed);
        match TaughtDemonstration::new(&demonstration) {
            Ok(_) => {
                parts.push(FitPart { demonstration, symmetry: part.symmetry(), pictures: Vec::new() });
                generated.push(part);
            }
            Err(error) => eprintln!("part {seed} is left out: {error}"),
        }
        if parts.len() == count {
            break;
        }
    }
    let absent = |condition| SceneConfig { absent_share: 1.0, ..SceneConfig::only(condition) };
    let kinds = Condition::ALL
        .map(|condition| (SceneConfig::only(condition), 1))
        .into_iter()
        .chain([(absent(Condition::LookAlikes), 2), (absent(Condition::Clutter), 2)]);
    for (kind_idx, (config, a_round)) in kinds.enumerate() {
        // As in use: the camera's distance is not known, and parts may lie a little outside.
        let config =
            SceneConfig { width, height, photo, photo_seed, distance: [0.75, 1.3], min_inside_share: 0.8, ..config };
        let scenes = Scenes::new(&generated, config, seed.wrapping_mul(100).wrapping_add(kind_idx as u64))?;
        for index in 0..parts.len() as u64 * a_round * arguments.rounds {
            let sample = scenes.sample(index);
            let instances = sample.instances.iter().map(|instance| FitInstance {
                grasp: instance.grasp,
                image_from_demonstration: instance.image_from_demonstration,
            });
            let is_of_other_size =
                |other: &&OtherObject| matches!(other.kind, OtherKind::LookAlike(LookAlike::Scaled(_)));
            parts[sample.part_idx].pictures.push(FitPicture {
                instances: instances.collect(),
                undecided: sample.others.iter().filter(is_of_other_size).map(|other| other.bbox).collect(),
                image: sample.image,
            });
        }
    }
    Ok(parts)
}
