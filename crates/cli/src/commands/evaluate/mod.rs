//! `sdg evaluate`: the paper's protocol, as a whole or in units; pictures along axes; other cameras; labelled pictures;
//! sets on both sides of a split.

mod args;
#[cfg(feature = "simulation")]
mod axes;
#[cfg(feature = "simulation")]
mod cameras;
mod model_names;
mod pictures;
#[cfg(feature = "simulation")]
mod protocol;
#[cfg(feature = "simulation")]
mod selection;
#[cfg(feature = "simulation")]
mod sharing;
mod sharing_args;
mod split;
mod split_args;

use anyhow::Result;

pub use args::EvaluateArgs;

use crate::exit::Outcome;

/// Runs the kind of evaluation that the arguments select.
pub fn run(args: &EvaluateArgs) -> Result<Outcome> {
    if args.pictures.is_some() {
        return pictures::run(args);
    }
    if let Some(split) = &args.split.split {
        return split::run(args, split);
    }
    #[cfg(feature = "simulation")]
    if args.sharing.is_asked_for() {
        return sharing::run(args);
    }
    #[cfg(feature = "simulation")]
    sdg_simulation::load()?;
    #[cfg(feature = "simulation")]
    return match (&args.axes, &args.cameras) {
        (Some(names), _) => axes::run(args, names),
        (None, Some(names)) => cameras::run(args, names),
        (None, None) => protocol::run(args),
    };
    #[cfg(not(feature = "simulation"))]
    Err(crate::exit::without_simulator())
}
