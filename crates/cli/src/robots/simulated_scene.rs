//! `sim:PART?seed=N` for a simulated arm: the scene on its table; and workcells that are not simulated.

use std::path::Path;

use anyhow::{Result, bail};
use sdg_cell::footprints_on_table;
use sdg_kinematics::collision::Obstacle;
use sdg_robot::workcell::{RobotModel, Workcell};
use sdg_simulation::scene::{SceneVariation, VariationConfig};

use crate::exit::Usage;
use crate::parts::part_named;

/// The scene of an address, given without its `sim:`, among obstacles.
///
/// # Errors
/// The part or an option is unknown.
pub(crate) fn simulated_scene(text: &str, obstacles: &[Obstacle]) -> Result<SceneVariation> {
    let (part, options) = text.split_once('?').unwrap_or((text, ""));
    let part = part_named("--from", part)?;
    let mut seed = 1;
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let number = option.strip_prefix("seed=").and_then(|number| number.parse().ok());
        seed = number.ok_or_else(|| {
            Usage(format!("--from: with --robot sim expected sim:PART?seed=N, found the option \"{option}\""))
        })?;
    }
    let variation = VariationConfig { taken: footprints_on_table(obstacles), ..VariationConfig::default() };
    Ok(SceneVariation::sample(Some(&part), &variation, seed))
}

/// Rejects a workcell that differs from the simulated one: a Panda at a table of the height of its base.
///
/// # Errors
/// Another model, or another height; the error names the workcell's file.
pub(crate) fn check_simulated(workcell: &Workcell, path: &Path) -> Result<()> {
    if workcell.robot != RobotModel::Panda {
        let found = workcell.robot.name();
        bail!("{}: model: expected \"panda\", the simulated arm, found \"{found}\"", path.display());
    }
    if workcell.table_height_m != 0.0 {
        let found_mm = workcell.table_height_m * 1e3;
        bail!("{}: height_mm: expected 0, the simulated table's height, found {found_mm}", path.display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_and_a_seed_make_a_scene() {
        let scene = |text: &str| simulated_scene(text, &[]).unwrap().object.unwrap();
        assert_eq!(scene("pendulum").spec.name, "pendulum");
        assert_ne!(scene("key?seed=2").base_from_object, scene("key?seed=3").base_from_object);
        assert!(simulated_scene("key?speed=3", &[]).unwrap_err().is::<Usage>());
        assert!(simulated_scene("keys", &[]).unwrap_err().is::<Usage>());
    }
}
