//! Fits the check's constants again on generated parts, and prints what would change. It changes nothing.
//!
//! `cargo run --release -p sdg-grasp --example fit_constants -- [--parts N] [--rounds N] [--size WxH] [--seed S]
//! [--only NAME[,NAME]]`
//!
//! Draws N parts (40), half of them to fit on, half held out, and for each one demonstration and, a round (1), one picture
//! under each of the generator's conditions and four without the part: two with look-alikes, two cluttered. The objective
//! and the intervals are those of [`sdg_grasp::fitting`]. The same arguments give the same output.

use std::time::Instant;

use sdg_grasp::TaughtDemonstration;
use sdg_grasp::fitting::{FitEvent, FitInstance, FitOptions, FitPart, FitPicture, constant_names, fit};
use sdg_part_generator::{Condition, Part, PhotoConfig, SceneConfig, Scenes, demonstration};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

struct Arguments {
    parts: usize,
    rounds: u64,
    size: [u32; 2],
    seed: u64,
    only: Vec<String>,
}

impl Arguments {
    fn read(arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut read = Self { parts: 40, rounds: 1, size: [320, 240], seed: 1, only: Vec::new() };
        let mut arguments = arguments;
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("expected a value after {name}, found none"))?;
            match name.as_str() {
                "--parts" => read.parts = value.parse()?,
                "--rounds" => read.rounds = value.parse()?,
                "--seed" => read.seed = value.parse()?,
                "--only" => read.only = value.split(',').map(str::to_owned).collect(),
                "--size" => {
                    let (width, height) =
                        value.split_once('x').ok_or_else(|| format!("expected --size WxH, found {value}"))?;
                    read.size = [width.parse()?, height.parse()?];
                }
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

fn main() -> Result<()> {
    let arguments = Arguments::read(std::env::args().skip(1))?;
    let start = Instant::now();
    let mut parts = draw_parts(&arguments)?;
    let num_pictures: usize = parts.iter().map(|part| part.pictures.len()).sum();
    eprintln!("{} parts, {num_pictures} pictures, {:.0} s", parts.len(), start.elapsed().as_secs_f64());

    let held_out = parts.split_off(parts.len() / 2);
    let options = FitOptions { seed: arguments.seed, only: arguments.only };
    let report = fit(&parts, &held_out, &options, &mut |event| {
        let seconds = start.elapsed().as_secs_f64();
        match event {
            FitEvent::Searching { constant, value } => eprintln!("{seconds:6.0} s  {constant} = {value}"),
            FitEvent::Joint(report) => eprintln!("{report}"),
            FitEvent::Fitted(report) => eprintln!("{report}  {}", report.tried()),
            _ => {}
        }
    })?;
    println!("{report}");
    Ok(())
}

/// Parts that can be taught, each with its pictures.
fn draw_parts(arguments: &Arguments) -> Result<Vec<FitPart>> {
    let [width, height] = arguments.size;
    let photo = PhotoConfig { width, height, ..PhotoConfig::default() };
    // The same photo as the scenes' truth refers to.
    let photo_seed = SceneConfig::default().photo_seed;
    let mut generated = Vec::new();
    let mut parts = Vec::new();
    for seed in (0u64..).map(|i| arguments.seed.wrapping_mul(1_000_000).wrapping_add(i)) {
        let part = Part::generate(seed);
        let demonstration = demonstration(&part, &photo, photo_seed);
        match TaughtDemonstration::new(&demonstration) {
            Ok(_) => {
                parts.push(FitPart { demonstration, symmetry: part.symmetry(), pictures: Vec::new() });
                generated.push(part);
            }
            Err(error) => eprintln!("part {seed} is left out: {error}"),
        }
        if parts.len() == arguments.parts {
            break;
        }
    }
    let absent = |condition| SceneConfig { absent_share: 1.0, ..SceneConfig::only(condition) };
    let kinds = Condition::ALL
        .map(|condition| (SceneConfig::only(condition), 1))
        .into_iter()
        .chain([(absent(Condition::LookAlikes), 2), (absent(Condition::Clutter), 2)]);
    for (kind_idx, (config, a_round)) in kinds.enumerate() {
        let config = SceneConfig { width, height, photo, photo_seed, ..config };
        let scenes = Scenes::new(&generated, config, arguments.seed.wrapping_mul(100).wrapping_add(kind_idx as u64))?;
        for index in 0..parts.len() as u64 * a_round * arguments.rounds {
            let sample = scenes.sample(index);
            let instances = sample.instances.iter().map(|instance| FitInstance {
                grasp: instance.grasp,
                image_from_demonstration: instance.image_from_demonstration,
            });
            parts[sample.part_idx].pictures.push(FitPicture { instances: instances.collect(), image: sample.image });
        }
    }
    Ok(parts)
}
