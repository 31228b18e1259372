//! Three instances of the part on one table.

use std::f64::consts::PI;

use nalgebra::Point2;
use rand::Rng;

use super::request::{AxisParameter, Drawn, Request};
use crate::error::{Result, SimulationError};
use crate::scene::{PlacedObject, SceneVariation, VariationConfig, sample_distractors};
use crate::shapes::footprint;
use crate::views::base_from_look_camera;
use crate::workcell::{Workcell, WorkcellConfig};

/// Number of instances of the part.
const NUM_INSTANCES: usize = 3;

/// Number of poses tried for one instance.
const TRIES_PER_INSTANCE: usize = 60;
/// Maximum number of attempts to place all instances.
const MAX_ROUNDS: usize = 60;

/// A scene with light and table as usual, three instances of the part and up to three distractors.
pub(super) fn draw_three(request: &mut Request<'_>) -> Result<Drawn> {
    let config = VariationConfig { distractors: 0..=3, ..VariationConfig::default() };
    let mut scene = SceneVariation::sample(Some(request.spec), &config, request.scene_seed);
    let mut instances =
        (0..MAX_ROUNDS).find_map(|_| placed_apart(request, &config)).ok_or_else(|| SimulationError::Configuration {
            field: "instances",
            expected: format!("room for {NUM_INSTANCES} of the part"),
            found: format!("none for {}", request.spec.name),
        })?;
    let taken = instances.iter().map(PlacedObject::footprint).collect();
    scene.distractors = sample_distractors(taken, &config, &mut request.rng);
    scene.object = Some(instances.remove(0));
    scene.instances = instances;
    let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
    let view = cell.view_from(&base_from_look_camera())?;
    let parameter = AxisParameter {
        value: NUM_INSTANCES as f64,
        unit: "instances",
        description: format!("{NUM_INSTANCES} of the part"),
    };
    Ok(Drawn { cell, scene, view, parameter })
}

/// Instances at random poses with a distance between them; `None` if there is no room for one of them.
fn placed_apart(request: &mut Request<'_>, config: &VariationConfig) -> Option<Vec<PlacedObject>> {
    let rng = &mut request.rng;
    let mut taken: Vec<Vec<Point2<f64>>> = Vec::new();
    let mut instances = Vec::new();
    for _ in 0..NUM_INSTANCES {
        let free = (0..TRIES_PER_INSTANCE).find_map(|_| {
            let (x, y) = (rng.random_range(config.object_x_m.clone()), rng.random_range(config.object_y_m.clone()));
            let base_from_object = request.spec.base_from_object(x, y, rng.random_range(-PI..PI));
            let placed = PlacedObject { spec: request.spec.clone(), base_from_object };
            let outline = placed.footprint();
            taken
                .iter()
                .all(|other| footprint::separation(&outline, other) >= config.clearance_m)
                .then_some((placed, outline))
        })?;
        taken.push(free.1);
        instances.push(free.0);
    }
    Some(instances)
}
