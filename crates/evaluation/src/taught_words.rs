//! Texts about a teaching run.

use sdg_demonstration::Demonstration;
use sdg_grasp::{EdgeHeight, Ending, GraspModel, Lengths, Taught};
use sdg_kinematics::HAND_OPENING_MAX_M;

/// A warning if the jaws of a demonstration are wider than the hand opens: the detected part could not be grasped.
pub fn too_wide(model: &GraspModel) -> Option<String> {
    let pixels_per_m = model.facts().lengths.as_ref()?.pixels_per_m;
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

/// Minimum height of the marks for the advice to take a second photo, in metres. Chosen by hand.
const HIGH_M: f64 = 0.010;

/// The measured height of the compared edges, or for a high part the advice to measure it.
pub fn edges(model: &GraspModel) -> Option<String> {
    edges_of(model.facts().lengths.as_ref()?, model.demonstrations().len())
}

fn edges_of(lengths: &Lengths, photos: usize) -> Option<String> {
    match lengths.edges {
        Some(EdgeHeight { height_m, sigma_m }) => Some(format!(
            "edges of the part: {:.1} mm above the marks (standard deviation {:.1} mm), measured with {photos} photos",
            1e3 * height_m,
            1e3 * sigma_m,
        )),
        None if lengths.mark_height_m < HIGH_M => None,
        None if photos == 1 => Some(
            "the part is high: with a second photo of it, near the border of the picture, its place under a tilted \
             camera is more exact"
                .to_owned(),
        ),
        None => Some(
            "the height of the part's edges was not measured: the photos show it from nearly the same side, or their \
             marks do not fit each other"
                .to_owned(),
        ),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_of_edges_or_for_a_high_part_the_advice_to_measure_it_is_told() {
        let low = Lengths::of_level_photos(1000.0, 0.009, 0.005);
        let high = Lengths { mark_height_m: 0.010, ..low.clone() };
        assert_eq!([1, 2].map(|photos| edges_of(&low, photos)), [None, None]);
        assert!(edges_of(&high, 1).unwrap().contains("a second photo"));
        assert!(edges_of(&high, 2).unwrap().contains("from nearly the same side"));
        let edges = Some(EdgeHeight { height_m: -0.0034, sigma_m: 0.0021 });
        assert_eq!(
            edges_of(&Lengths { edges, ..low }, 3).unwrap(),
            "edges of the part: -3.4 mm above the marks (standard deviation 2.1 mm), measured with 3 photos"
        );
    }
}
