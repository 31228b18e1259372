//! The demonstrations in datasets/, compiled into the program, so that `sdg demo` runs in any folder.

use anyhow::{Context, Result, bail};
use sdg_demonstration::{Annotation, Demonstration};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{DemonstrationView, demonstration_view_at};

macro_rules! shipped {
    ($($name:literal),*) => {
        [$((
            $name,
            include_bytes!(concat!("../../../datasets/demonstrations/", $name, "/image.png")).as_slice(),
            include_bytes!(concat!("../../../datasets/demonstrations/", $name, "/annotation.json")).as_slice(),
        )),*]
    };
}

/// Name, photo and annotation of each demonstration.
static SHIPPED: [(&str, &[u8], &[u8]); 12] = shipped![
    "pendulum",
    "fuel_line",
    "rod_end",
    "housing",
    "pneumatic_cylinder",
    "ball_bearing",
    "common_line",
    "cranfield_face",
    "key",
    "pliers",
    "circuit_board",
    "spring_clip"
];

/// The demonstration of a shipped object.
pub fn demonstration(object: &str) -> Result<Demonstration> {
    let Some((name, photo, annotation)) = SHIPPED.iter().find(|(name, ..)| *name == object) else {
        let known: Vec<&str> = SHIPPED.iter().map(|(name, ..)| *name).collect();
        bail!("expected an object out of {}, found \"{object}\"", known.join(", "));
    };
    Demonstration::decode(photo, annotation, Some("image.png"))
        .with_context(|| format!("the shipped demonstration of {name}"))
}

/// A simulated photo by the camera of the shipped demonstrations, with the part at another place (x, y in metres and
/// yaw in radians, in the base frame). The marks are exact, and the annotation is otherwise that of the shipped photo.
pub fn demonstration_at(object: &ObjectSpec, place: (f64, f64, f64)) -> Result<Demonstration> {
    let shipped = demonstration(&object.name)?;
    let DemonstrationView { view, truth, outline, .. } = demonstration_view_at(object, place)?;
    let annotation =
        Annotation { bbox: outline.bounds(), grasp: Some(truth.line), outline: Some(outline), ..shipped.annotation };
    Ok(Demonstration { image: view.image, annotation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_object_has_a_demonstration_with_all_marks() {
        for name in ObjectSpec::names() {
            let demonstration = demonstration(name).unwrap();
            assert!(demonstration.annotation.require_grasp().is_ok(), "{name}");
            assert!(demonstration.annotation.require_outline().is_ok(), "{name}");
            assert_eq!(demonstration.annotation.label, name);
        }
    }

    #[test]
    fn an_unknown_object_is_told_the_known_ones() {
        let error = demonstration("teapot").unwrap_err().to_string();
        assert_eq!(
            error,
            "expected an object out of pendulum, fuel_line, rod_end, housing, pneumatic_cylinder, ball_bearing, \
             common_line, cranfield_face, key, pliers, circuit_board, spring_clip, found \"teapot\""
        );
    }
}
