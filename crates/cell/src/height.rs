//! What a model knows that a height is measured by.

use sdg_grasp::GraspModel;
use sdg_robot::height::{HeightMeasurement, ToldHeight};

/// How a part's height is measured with a camera on the hand, where the model knows lengths; `told` is z of the base, m.
pub fn height_measurement(model: &GraspModel, told: Option<ToldHeight>) -> Option<HeightMeasurement> {
    let lengths = model.facts().lengths?;
    Some(HeightMeasurement { told, ..HeightMeasurement::new(lengths.mark_height_m, lengths.grasp_height_m) })
}
