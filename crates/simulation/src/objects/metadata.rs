//! The content of `object.json`, and the checks of its values.

use nalgebra::Point3;
use sdg_geometry::RotationalSymmetry;
use sdg_kinematics::HAND_OPENING_MAX_M;
use serde::Deserialize;

/// Version of `object.json` that this reader understands.
pub const OBJECT_FORMAT: u32 = 1;

/// Largest width of a part that the Panda's hand can grasp, in metres.
pub const LARGEST_JAW_WIDTH_M: f64 = HAND_OPENING_MAX_M;

/// The content of `object.json`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Metadata {
    pub(super) format: u32,
    pub(super) name: String,
    pub(super) title: String,
    pub(super) description: String,
    pub(super) mass_kg: f64,
    pub(super) friction: f64,
    pub(super) grasp_start: [f64; 3],
    pub(super) grasp_end: [f64; 3],
    pub(super) jaw_width_m: f64,
    pub(super) grasp_height_m: f64,
    pub(super) mark_height_m: f64,
    /// Default: `mark_height_m`.
    pub(super) seen_height_m: Option<f64>,
    pub(super) rest_height_m: f64,
    pub(super) symmetry: RotationalSymmetry,
    pub(super) footprint: Vec<[f64; 2]>,
    pub(super) mjcf: String,
}

impl Metadata {
    /// Checks the values; the error states the field, the expected and the found value.
    pub(super) fn check(&self) -> std::result::Result<(), String> {
        if self.format != OBJECT_FORMAT {
            return Err(format!("format: expected {OBJECT_FORMAT}, found {}", self.format));
        }
        let ranges = [
            ("mass_kg", self.mass_kg, 1e-4, 3.0),
            ("friction", self.friction, 0.01, 5.0),
            ("jaw_width_m", self.jaw_width_m, 1e-3, LARGEST_JAW_WIDTH_M),
            ("grasp_height_m", self.grasp_height_m, 0.0, 0.5),
            ("mark_height_m", self.mark_height_m, 0.0, 0.5),
            ("seen_height_m", self.seen_height_m.unwrap_or(self.mark_height_m), 0.0, 0.5),
            ("rest_height_m", self.rest_height_m, -0.5, 0.5),
        ];
        for (field, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(format!("{field}: expected {low} to {high}, found {value}"));
            }
        }
        let (start, end) = (Point3::from(self.grasp_start), Point3::from(self.grasp_end));
        let length = (end.xy() - start.xy()).norm();
        if length.is_nan() || length < 1e-3 {
            return Err(format!("grasp_start, grasp_end: expected marks at least 0.001 m apart, found {length} m"));
        }
        if self.footprint.len() < 3 || self.footprint.iter().flatten().any(|value| !value.is_finite()) {
            return Err(format!("footprint: expected three or more finite points, found {:?}", self.footprint));
        }
        match self.symmetry {
            // A fold of zero or one has no meaning.
            RotationalSymmetry::Fold(count @ 0..=1) => Err(format!("symmetry: expected fold 2 or more, found {count}")),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::objects::{ObjectSpec, RotationalSymmetry, source_folder};

    #[test]
    fn a_symmetry_is_a_word_or_a_number() {
        for (text, expected) in [
            ("\"none\"", RotationalSymmetry::None),
            ("{\"fold\": 3}", RotationalSymmetry::Fold(3)),
            ("\"full\"", RotationalSymmetry::Full),
        ] {
            assert_eq!(serde_json::from_str::<RotationalSymmetry>(text).unwrap(), expected);
        }
    }

    #[test]
    fn bad_metadata_names_the_field() {
        let good = std::fs::read_to_string(source_folder().join("pendulum/object.json")).unwrap();
        for (from, to, expected) in [
            ("\"format\": 1", "\"format\": 7", "format: expected 1, found 7"),
            ("\"jaw_width_m\": 0.016", "\"jaw_width_m\": 0.09", "jaw_width_m: expected 0.001 to 0.08, found 0.09"),
            ("\"symmetry\": \"none\"", "\"symmetry\": \"some\"", "some"),
            ("\"symmetry\": \"none\"", "\"symmetry\": {\"fold\": 1}", "symmetry: expected fold 2 or more, found 1"),
            ("\"mass_kg\"", "\"mass\"", "mass"),
            ("\"object.xml\"", "\"absent.xml\"", "absent.xml"),
        ] {
            assert!(good.contains(from), "{from}");
            let folder = std::env::temp_dir().join(format!("sdg-object-{}-{}", std::process::id(), to.len()));
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join("object.json"), good.replace(from, to)).unwrap();
            let message = ObjectSpec::from_folder(&folder).unwrap_err().to_string();
            std::fs::remove_dir_all(&folder).unwrap();
            assert!(message.contains(expected), "{message}");
        }
    }
}
