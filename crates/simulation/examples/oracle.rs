//! Grasps parts whose true pose is known, to measure the success rate and the time of the robot alone.
//!
//! `cargo run --release -p sdg-simulation --example oracle [OBJECT] [ATTEMPTS] [FIRST_SEED] [FOLDER]`
//! writes the pictures of the first attempt into FOLDER.

use std::time::Instant;

use sdg_robot::GraspOutcome;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{AttemptConfig, RecordConfig, Workcell, WorkcellConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "pendulum".into());
    let num_attempts: u64 = arguments.next().map_or(Ok(20), |n| n.parse())?;
    let first_seed: u64 = arguments.next().map_or(Ok(0), |n| n.parse())?;
    let folder = arguments.next().map(std::path::PathBuf::from);
    let spec = ObjectSpec::by_name(&name)?;
    let (mut successes, mut build_secs, mut wall_secs, mut simulated_secs) = (0, 0.0, 0.0, 0.0);
    for seed in first_seed..first_seed + num_attempts {
        let started = Instant::now();
        let scene = SceneVariation::sample(Some(&spec), &VariationConfig::default(), seed);
        let mut cell = Workcell::new(&WorkcellConfig::new(scene))?;
        build_secs += started.elapsed().as_secs_f64();
        let record = (seed == first_seed && folder.is_some()).then(RecordConfig::default);
        let report = cell.run_oracle_attempt(&AttemptConfig { record, ..AttemptConfig::default() }, seed)?;
        wall_secs += report.wall_secs;
        simulated_secs += report.simulated_secs;
        if report.outcome.is_held() {
            successes += 1;
        }
        for (step, why) in &report.hand_verdicts {
            // The last verdict must agree with the outcome of the grasp; the earlier ones must say that the part is
            // held.
            let is_last = Some(step) == report.hand_verdicts.last().map(|(step, _)| step);
            if why.is_none() != (!is_last || report.outcome.is_held()) {
                println!("{name} seed {seed}: after {step} failure by the hand {why:?}, outcome {:?}", report.outcome);
            }
        }
        if let GraspOutcome::Failed { step, why } = &report.outcome {
            println!("{name} seed {seed}: {step}: {why}");
        }
        if let (true, Some(folder)) = (seed == first_seed, &folder) {
            for (index, frame) in report.frames.iter().enumerate() {
                frame.save(folder.join(format!("frame_{index:03}.png")))?;
            }
        }
    }
    let n = num_attempts as f64;
    println!(
        "{name}: {successes} of {num_attempts}; build {:.0} ms, attempt {:.0} ms, simulated {:.1} s, each",
        build_secs / n * 1e3,
        wall_secs / n * 1e3,
        simulated_secs / n
    );
    Ok(())
}
