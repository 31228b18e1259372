//! `sim:PART?seed=N` for a simulated arm: the scene on its table.

use anyhow::Result;
use sdg_simulation::scene::{SceneVariation, VariationConfig};

use crate::exit::Usage;
use crate::parts::part_named;

/// The scene of an address, given without its `sim:`.
///
/// # Errors
/// The part or an option is unknown.
pub(crate) fn simulated_scene(text: &str) -> Result<SceneVariation> {
    let (part, options) = text.split_once('?').unwrap_or((text, ""));
    let part = part_named("--from", part)?;
    let mut seed = 1;
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let number = option.strip_prefix("seed=").and_then(|number| number.parse().ok());
        seed = number.ok_or_else(|| {
            Usage(format!("--from: with --robot sim expected sim:PART?seed=N, found the option \"{option}\""))
        })?;
    }
    Ok(SceneVariation::sample(Some(&part), &VariationConfig::default(), seed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_and_a_seed_make_a_scene() {
        let scene = |text: &str| simulated_scene(text).unwrap().object.unwrap();
        assert_eq!(scene("pendulum").spec.name, "pendulum");
        assert_ne!(scene("key?seed=2").base_from_object, scene("key?seed=3").base_from_object);
        assert!(simulated_scene("key?speed=3").unwrap_err().is::<Usage>());
        assert!(simulated_scene("keys").unwrap_err().is::<Usage>());
    }
}
