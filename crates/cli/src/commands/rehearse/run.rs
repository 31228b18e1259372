//! `sdg rehearse`: grasp attempts in MuJoCo with a taught model.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use sdg_evaluation::rehearsal::{Rehearsal, RehearsalErrors, RehearsedPlace};
use sdg_evaluation::run_page::{self, RunPage};
use sdg_evaluation::{Assumption, OwnPart, OwnPartError, OwnPartSizes, attempt_in_words, quoted, run_json};
use sdg_geometry::PinholeCamera;
use sdg_grasp::{GraspError, GraspModel};
use sdg_inputs::camera_files::CameraFile;
use sdg_report::AttemptSummary;

use super::RehearseArgs;
use crate::commands::devices;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::parts::part_named;
use crate::robots;
use crate::shared_args::{OwnPartArgs, verification};

/// Runs the attempts and writes the report; after Ctrl-C, the report of the attempts so far.
pub fn run(args: &RehearseArgs) -> Result<Outcome> {
    let shipped = args.object.as_deref().map(|name| part_named("--object", name)).transpose()?;
    sdg_simulation::load()?;
    let model = sdg_inputs::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    let mut camera = args.camera.as_deref().map(CameraFile::read_intrinsics).transpose()?;
    let model_file = args.grasp_model.display().to_string();
    let (object, model) = match shipped {
        Some(object) => (object, model),
        None => {
            let OwnPart { object, model, facts } = own_part(args, model, &model_file)?;
            eprintln!("{facts}");
            // Sizes are known in metres, so a calibrated camera is always used.
            camera = camera.or(Some(PinholeCamera::WRIST));
            (object, model)
        }
    };
    if camera.is_some() && model.facts().lengths.is_none() {
        return Err(GraspError::NoLengths).context(model_file);
    }
    let place = match (&args.place, &args.workcell) {
        (Some(place), Some(workcell)) => Some(rehearsed_place(place, workcell)?),
        _ => None,
    };
    sdg_files::prepare_folder(&args.out)?;
    let verification = verification(args.no_verify, &model);
    let rehearsal = Rehearsal {
        model: &model,
        object: &object,
        attempts: args.attempts,
        seed: args.seed,
        verification,
        errors: RehearsalErrors::default(),
        camera,
        place,
    };
    rehearsal.check_room().map_err(|error| Usage(format!("--place: {error}")))?;
    let interrupt = Interrupt::watch();
    let rehearsed = rehearsal.run(&mut |attempt| show_attempt(attempt, args.attempts, &interrupt))?;
    let command = command(args);
    let page = RunPage { model: &model, object: &object, rehearsed: &rehearsed, command: &command };
    let report = run_page::rehearsal(&page)?.write(&args.out)?;
    finish(&page, None, &report, args.json)
}

/// The command that repeats the attempts.
fn command(args: &RehearseArgs) -> String {
    let mut command = "sdg rehearse".to_owned();
    let mut option = |name: &str, value: &str| command += &format!(" --{name} {}", quoted(value));
    option("grasp-model", &args.grasp_model.display().to_string());
    if let Some(object) = &args.object {
        option("object", object);
    }
    let OwnPartArgs { height_mm, length_mm, mass_g, friction } = args.own_part;
    for (name, value) in
        [("height-mm", height_mm), ("length-mm", length_mm), ("mass-g", mass_g), ("friction", friction)]
    {
        if let Some(value) = value {
            option(name, &value.to_string());
        }
    }
    option("attempts", &args.attempts.to_string());
    option("seed", &args.seed.to_string());
    if let Some(camera) = &args.camera {
        option("camera", &camera.display().to_string());
    }
    if let (Some(place), Some(workcell)) = (&args.place, &args.workcell) {
        option("place", place);
        option("workcell", &workcell.display().to_string());
    }
    command += &args.compute.in_command();
    if args.no_verify { command + " --no-verify" } else { command }
}

/// The part that the model was taught from.
fn own_part(args: &RehearseArgs, model: GraspModel, model_file: &str) -> Result<OwnPart> {
    let OwnPartArgs { height_mm, length_mm, mass_g, friction } = args.own_part;
    let sizes = OwnPartSizes { height_mm, length_mm, mass_g, friction };
    let in_words = |assumption| match assumption {
        Assumption::Mass => "the mass, of 1.5 g/cm³ (--mass-g)",
        Assumption::Friction => "the friction (--friction)",
        Assumption::UprightWalls => "upright walls",
        Assumption::PhotoFromAbove => "a photo from straight above",
        Assumption::BoxAsOutline => "the box as its outline, since none was marked",
    };
    let needed = |option: &str, what: &str| {
        format!(
            "expected --object NAME for a shipped part, or {option} for the part of {model_file}: {what}, which a model \
             taught without --camera does not know"
        )
    };
    OwnPart::make(model, model_file, &sizes, &in_words).map_err(|error| match error.downcast_ref() {
        Some(OwnPartError::NeedsLength) => Usage(needed("--length-mm MM", "the longer side of its box")).into(),
        Some(OwnPartError::NeedsHeight) => Usage(needed("--height-mm MM", "its height above the table")).into(),
        Some(OwnPartError::LengthIsKnown { known_mm }) => Usage(format!(
            "--length-mm: expected a model taught without --camera, found {model_file}, whose part is {known_mm:.1} \
             mm long"
        ))
        .into(),
        Some(OwnPartError::HeightIsKnown { known_mm }) => Usage(format!(
            "--height-mm: expected a model taught without --camera, found {model_file}, whose marks are {known_mm:.1} \
             mm above the table"
        ))
        .into(),
        _ => error,
    })
}

/// A place in the workcell file.
fn rehearsed_place(text: &str, path: &Path) -> Result<RehearsedPlace> {
    let (workcell, _) = sdg_inputs::read_workcell(path)?;
    robots::check_simulated(&workcell, path)?;
    Ok(RehearsedPlace::named(text, workcell).map_err(|error| Usage(format!("--{error}")))?)
}

/// Prints one line per attempt; breaks after Ctrl-C.
pub fn show_attempt(attempt: &AttemptSummary, of: u32, interrupt: &Interrupt) -> ControlFlow<()> {
    eprintln!("attempt {} of {of}: {}", attempt.number, attempt_in_words(attempt));
    if interrupt.is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Prints the closing lines, or the JSON object of `--json` (docs/command-line.md).
pub fn finish(page: &RunPage, teach_seconds: Option<f64>, report: &std::path::Path, json: bool) -> Result<Outcome> {
    let RunPage { object, rehearsed, .. } = page;
    if json {
        println!("{}", json_line(&run_json(page, teach_seconds, report))?);
    } else {
        if let Some(seconds) = teach_seconds {
            println!("taught the {} from one photo in {seconds:.0} s", object.title.to_lowercase());
        }
        let done = if rehearsed.is_placing() { "placed" } else { "grasped" };
        println!("{done} it in {} of {} attempts", rehearsed.successes(), rehearsed.attempts.len());
        if let Some(told) = rehearsed.interruption() {
            println!("{told}");
        }
        println!("report: {}", report.display());
    }
    Ok(if rehearsed.found_nothing() { Outcome::NothingToGrasp } else { Outcome::Done })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;

    #[test]
    fn the_command_of_the_page_repeats_the_attempts() {
        let line = "sdg rehearse --device wgpu --no-verify --grasp-model";
        let line = line.split(' ').chain(["my part.sdg"]);
        let Command::Rehearse(args) = Args::try_parse_from(line).unwrap().command else { panic!("another command") };
        assert_eq!(
            command(&args),
            "sdg rehearse --grasp-model 'my part.sdg' --attempts 10 --seed 1 --device wgpu --no-verify"
        );
    }
}
