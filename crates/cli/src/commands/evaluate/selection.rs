//! Arguments of the evaluations in the simulator (protocol, axes, cameras): parts, preset and workers.

use anyhow::Result;
use sdg_evaluation::Settings;
use sdg_grasp::{GraspError, ModelKind, Preset};
use sdg_simulation::objects::ObjectSpec;

use super::args::EvaluateArgs;
use crate::exit::Usage;
use crate::parts::part_named;

/// The preset, and the settings on which the stored results depend.
///
/// # Errors
/// The preset is unknown, or the networks of these models cannot be taught with it, because it needs base weights.
pub fn settings(args: &EvaluateArgs, models: &[ModelKind]) -> Result<(Preset, Settings)> {
    let wrong = |error: GraspError| Usage(format!("--preset: {error}"));
    let preset: Preset = args.preset.parse().map_err(wrong)?;
    let is_teaching = !args.sharing.list_units && !args.sharing.collect;
    if is_teaching && models.iter().any(|model| model.has_network()) {
        // Otherwise, models that were never taught would count as models that find nothing.
        preset.check_shipped_start().map_err(wrong)?;
    }
    let settings = Settings {
        protocol: Settings::PROTOCOL,
        preset: preset.name().to_owned(),
        steps: args.steps,
        time_budget: args.time_budget,
        seed: args.seed,
        attempts: args.attempts,
        views: args.views,
        scenes: args.scenes,
        program: None,
    };
    Ok((preset, settings))
}

/// Number of units to run in parallel: as given, or else one per core.
pub fn jobs(args: &EvaluateArgs) -> usize {
    args.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), |jobs| jobs as usize)
}

/// The parts with these names, or `all` if there are no names.
pub fn objects(names: &[String], all: impl Iterator<Item = &'static str>) -> Result<Vec<ObjectSpec>> {
    let names: Vec<String> = if names.is_empty() { all.map(str::to_owned).collect() } else { names.to_vec() };
    let mut objects: Vec<ObjectSpec> = Vec::new();
    for name in names {
        let object = part_named("--objects", &name)?;
        if objects.iter().any(|known| known.name == object.name) {
            return Err(Usage(format!("--objects: expected each part once, found {} again", object.name)).into());
        }
        objects.push(object);
    }
    Ok(objects)
}
