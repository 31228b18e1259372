//! Texts about a teaching run.

use sdg_demonstration::Demonstration;
use sdg_grasp::{Ending, GraspModel, Taught};
use sdg_kinematics::HAND_OPENING_MAX_M;

/// A warning if the jaws of a demonstration are wider than the hand opens: the detected part could not be grasped.
pub fn too_wide(model: &GraspModel) -> Option<String> {
    let pixels_per_m = model.facts().lengths?.pixels_per_m;
    let widest = model.demonstrations().iter().map(|taught| taught.marks.width_px / pixels_per_m).fold(0.0, f64::max);
    (widest > HAND_OPENING_MAX_M).then(|| {
        format!(
            "the marked jaws open {:.0} mm, and the hand {:.0} mm at most: mark the grasp where the part is narrower, \
             or rotate it",
            1e3 * widest,
            1e3 * HAND_OPENING_MAX_M
        )
    })
}

/// Warnings about jaws that open as wide as the box because neither an outline nor a jaw width is marked. If the part
/// lies obliquely in the box, a smaller opening is enough.
pub fn openings_by_the_box(model: &GraspModel, demonstrations: &[Demonstration]) -> Vec<String> {
    let told = model.demonstrations().iter().zip(demonstrations).filter_map(|(taught, demonstration)| {
        let annotation = &demonstration.annotation;
        (annotation.outline.is_none() && annotation.jaw_width.is_none()).then(|| {
            format!(
                "the opening of the jaws, {:.0} px, is taken from the box of \"{}\", which may be wider than the part: draw its \
                 outline, or mark the jaws (`sdg annotate`)",
                taught.marks.width_px, annotation.label
            )
        })
    });
    told.collect()
}

/// How the training of the network ended; empty for a model without a network.
pub fn training(taught: &Taught) -> String {
    let facts = taught.model.facts();
    let Some(history) = &taught.history else { return String::new() };
    let ending = match history.ending {
        Ending::Completed => "",
        Ending::EarlyStop => ", stopped early: good enough",
        Ending::TimeBudget => ", stopped by the time budget",
        Ending::Interrupted => ", interrupted",
    };
    let orientation = facts.orientation.map_or(String::new(), |cnn| {
        format!("; angles alone: {:.0} % within 10°, median {:.1}°", 100.0 * cnn.hit_rate, cnn.error_degrees)
    });
    format!(" ({} steps{ending}{orientation})", facts.steps)
}
