//! Measures the speed of drawing samples: pictures per second, and processor time per picture.
//!
//! Usage: `cargo run --release -p sdg-part-generator --example speed [SAMPLES [THREADS [NAME]]]`
//!
//! Prints the time to make ten parts, then a line for the default scenes and one for each single condition, at 320x240
//! pixels. With a name (`default`, `tilt`, …), prints only the line of that name after the time. Processor time is that
//! of the process, so it is also meaningful on a busy machine.

use std::time::Instant;

use rayon::prelude::*;
use sdg_part_generator::{Condition, Part, SceneConfig, Scenes};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let samples: u64 = arguments.first().map_or(Ok(300), |count| count.parse())?;
    let threads: usize = arguments.get(1).map_or(Ok(2), |count| count.parse())?;
    let only = arguments.get(2);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;

    let (wall, before) = (Instant::now(), cpu_seconds());
    let parts: Vec<Part> = pool.install(|| (0..10).into_par_iter().map(Part::generate).collect());
    println!(
        "10 parts: {:.1} ms of processor time each, {:.2} s",
        100.0 * (cpu_seconds() - before),
        wall.elapsed().as_secs_f64()
    );
    let configs = std::iter::once(("default", SceneConfig::default()))
        .chain(Condition::ALL.map(|condition| (condition.name(), SceneConfig::only(condition))));
    for (name, config) in configs.filter(|(name, _)| only.is_none_or(|only| only == name)) {
        let before = cpu_seconds();
        let scenes = pool.install(|| Scenes::new(&parts, config, 1))?;
        let prepared = cpu_seconds() - before;
        let (wall, before) = (Instant::now(), cpu_seconds());
        let bytes: u64 =
            pool.install(|| (0..samples).into_par_iter().map(|k| u64::from(scenes.sample(k).image.as_raw()[0])).sum());
        let (seconds, cpu) = (wall.elapsed().as_secs_f64(), cpu_seconds() - before);
        println!(
            "{name:12} {:6.0} samples/s on {threads} threads, {:5.2} ms of processor time a sample \
             (prepared in {prepared:.2} s, first bytes {bytes})",
            samples as f64 / seconds,
            1000.0 * cpu / samples as f64
        );
    }
    Ok(())
}

/// Processor time of this process so far, in seconds.
fn cpu_seconds() -> f64 {
    // The fields of /proc/self/stat after the program's name, which may contain blanks: 14 and 15 are user and system
    // time in ticks of 10 ms.
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |idx: usize| fields.get(idx).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (ticks(11) + ticks(12)) / 100.0
}
