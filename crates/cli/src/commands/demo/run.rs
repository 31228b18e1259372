//! `sdg demo`: the complete task with shipped data, from a photo to grasps.

use std::time::Duration;

use anyhow::Result;
use sdg_evaluation::TaughtFile;
use sdg_evaluation::rehearsal::{Rehearsal, RehearsalErrors};
use sdg_evaluation::run_page::{self, RunPage, TaughtHere};
use sdg_evaluation::shipped;
use sdg_evaluation::trial::try_views;
use sdg_files::write_atomically;
use sdg_grasp::{CheckConfig, TeachOptions, Verification};

use super::DemoArgs;
use crate::commands::rehearse::{finish, show_attempt};
use crate::exit::Outcome;
use crate::interrupt::Interrupt;
use crate::parts::part_named;
use crate::teaching_progress::TeachingProgress;

/// Number of test pictures with the part, and number without it.
const VIEWS: (usize, usize) = (12, 12);
/// Seed of the test pictures for the default seed, far from the usual seeds of the attempts.
const VIEWS_SEED: u64 = 7_000_000;
/// Distance of the test pictures' seeds of consecutive seeds, larger than the number of pictures.
const VIEWS_SEED_STEP: u64 = 1000;

/// Teaches, tests, grasps and writes the report.
pub fn run(args: &DemoArgs) -> Result<Outcome> {
    let object = part_named("--object", &args.object)?;
    let demonstration = shipped::demonstration(&args.object)?;
    sdg_simulation::load()?;
    sdg_files::prepare_folder(&args.out)?;

    let interrupt = Interrupt::watch();
    eprintln!("teaching the {} from one photo", object.title.to_lowercase());
    let mut options = TeachOptions::new(args.seed);
    // The camera of the workcell is at the height from which the photo was taken.
    options.size_tolerance = CheckConfig::FIXED_HEIGHT_TOLERANCE;
    options.time_budget = args.time_budget.map(Duration::from_secs_f64);
    options.symmetry = object.symmetry;
    let mut progress = TeachingProgress::new(interrupt.clone());
    let file = TaughtFile::teach(std::slice::from_ref(&demonstration), &options, &mut |event| progress.show(event));
    progress.finish();
    // The model as read from its file is tested and rehearsed, because a person will use the file.
    let TaughtFile { taught, bytes, model } = file?;
    let model_file = args.out.join(format!("{}.sdg", object.name));
    write_atomically(&model_file, &bytes)?;
    eprintln!("taught in {:.0} s; the model is {}", model.facts().seconds, model_file.display());

    let views_seed = VIEWS_SEED.wrapping_add(args.seed.wrapping_sub(1).wrapping_mul(VIEWS_SEED_STEP));
    let mut trials = try_views(&model, &object, true, VIEWS.0, views_seed, Verification::ByShape)?;
    trials.extend(try_views(&model, &object, false, VIEWS.1, views_seed, Verification::ByShape)?);
    eprintln!(
        "tested on unseen pictures: correct in {} of {} with the part, {} false alarms in {} without",
        trials.iter().filter(|trial| trial.is_right()).count(),
        VIEWS.0,
        trials.iter().filter(|trial| trial.is_false_alarm()).count(),
        VIEWS.1
    );

    let rehearsal = Rehearsal {
        model: &model,
        object: &object,
        attempts: args.attempts,
        seed: args.seed,
        verification: Verification::ByShape,
        errors: RehearsalErrors::default(),
        camera: None,
        place: None,
    };
    let rehearsed = rehearsal.run(&mut |attempt| show_attempt(attempt, args.attempts, &interrupt))?;
    let mut command = format!("sdg demo --object {} --attempts {} --seed {}", args.object, args.attempts, args.seed);
    if let Some(secs) = args.time_budget {
        command += &format!(" --time-budget {secs}");
    }
    let page = RunPage { model: &model, object: &object, rehearsed: &rehearsed, command: &command };
    let taught_here = TaughtHere {
        demonstration: &demonstration,
        history: taught.history.as_ref(),
        trials: &trials,
        seed: args.seed,
    };
    let report = run_page::demo(&page, &taught_here)?.write(&args.out)?;
    finish(&page, Some(model.facts().seconds), &report, args.json)
}
