//! The parts to grasp: their masses, marks and grasps, and their MJCF.
//!
//! A part is a folder with `object.json` (numbers and marks, see [`ObjectSpec`]), `object.xml` (MJCF with one body
//! named `object` and its free joint `object_joint`) and the meshes and textures that the MJCF names. The parts of
//! `datasets/objects` are compiled in; any other folder can be read by [`ObjectSpec::from_folder`].
//!
//! In the **object frame**, z points up while the part rests on the table. The **marks** `grasp_start` and `grasp_end`
//! are on the part's axis, where the gripper holds the part. The jaws close across the line between the marks. The tool
//! centre point moves to the mean of the marks in x and y, at `grasp_height_m` above the table.

mod embedded;
mod extruded;
mod feature_moved;
mod features;
mod folder;
mod height_map;
mod look_alike;
mod metadata;
mod mjcf_tags;
mod obj_mesh;
mod shape;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_geometry::Angle;

use crate::error::{Result, SimulationError};
use crate::model::Asset;
use crate::scene::MjcfFragment;
use crate::scene::pose_attributes;

use embedded::{EMBEDDED, NUM_PAPER_PARTS};
use metadata::Metadata;

pub use extruded::Extrusion;
pub use metadata::{LARGEST_JAW_WIDTH_M, OBJECT_FORMAT};

pub(crate) use height_map::HeightMap;
pub use look_alike::{LookAlike, LookAlikeKind};
pub use sdg_geometry::RotationalSymmetry;

/// The body tag, which occurs once in every `object.xml`. The part's pose is inserted into it.
const BODY_TAG: &str = "<body name=\"object\">";

/// A part: its lengths in metres and mass in kilograms, its marks in the object frame, and its MJCF.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectSpec {
    /// Name at the command line, such as `fuel_line`.
    pub name: String,
    /// Name in texts, such as "Fuel line".
    pub title: String,
    /// Description of the part.
    pub description: String,
    /// Mass in kilograms.
    pub mass_kg: f64,
    /// Coefficient of sliding friction of the surface.
    pub friction: f64,
    /// First mark, in the object frame.
    pub grasp_start: Point3<f64>,
    /// Second mark, in the object frame.
    pub grasp_end: Point3<f64>,
    /// Width of the part between the jaws, in metres.
    pub jaw_width_m: f64,
    /// Height of the tool centre point above the table when the part is held.
    pub grasp_height_m: f64,
    /// Height of the marks above the table: the plane of the marks in a picture.
    ///
    /// For a round bar this is the height of its axis, because its outline in a picture stays centred on the
    /// axis for any camera position above it.
    pub mark_height_m: f64,
    /// Height above the table of the visible surface at the marks; above `mark_height_m` for a round bar.
    pub seen_height_m: f64,
    /// Height of the object frame's origin above the table for the part at rest.
    pub rest_height_m: f64,
    /// The rotations about z that change neither the appearance nor the grasp of the part.
    pub symmetry: RotationalSymmetry,
    /// The convex hull of the part from above, counter-clockwise, in the object frame.
    pub footprint: Vec<Point2<f64>>,
    mjcf: String,
    files: Vec<Asset>,
}

/// Offset of a grasp from the true one, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspError {
    /// Distance of the tool centre points in x and y, in metres.
    pub distance_m: f64,
    /// Angle between the lines across which the jaws close, in radians, modulo the part's symmetry.
    pub angle_rad: f64,
}

impl ObjectSpec {
    /// The names of the compiled-in parts: the paper's, then the held-out ones.
    pub fn names() -> impl Iterator<Item = &'static str> {
        EMBEDDED.iter().map(|(name, _)| *name)
    }

    /// The names of the paper's eight parts.
    pub fn paper_names() -> impl Iterator<Item = &'static str> {
        Self::names().take(NUM_PAPER_PARTS)
    }

    /// The names of four further parts. No constant may be fitted on them, and their results are reported separately
    /// from those of the paper's parts.
    pub fn held_out_names() -> impl Iterator<Item = &'static str> {
        Self::names().skip(NUM_PAPER_PARTS)
    }

    /// One of the compiled-in parts.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] with the names that exist.
    pub fn by_name(name: &str) -> Result<Self> {
        let Some((_, files)) = EMBEDDED.iter().find(|(known, _)| *known == name) else {
            return Err(SimulationError::UnknownName {
                kind: "part",
                name: name.to_owned(),
                existing: Self::names().map(str::to_owned).collect(),
            });
        };
        Self::read(Path::new(name), |file| {
            files
                .iter()
                .find(|(known, _)| *known == file)
                .map(|(_, bytes)| Cow::Borrowed(*bytes))
                .ok_or_else(|| "not compiled in".to_owned())
        })
    }

    /// Reads a user's own part from its folder.
    ///
    /// # Errors
    /// [`SimulationError::File`] if a file is missing, cannot be read or has invalid content.
    pub fn from_folder(folder: &Path) -> Result<Self> {
        Self::read(folder, |file| std::fs::read(folder.join(file)).map(Cow::Owned).map_err(|error| error.to_string()))
    }

    fn read<'a>(folder: &Path, read: impl Fn(&str) -> std::result::Result<Cow<'a, [u8]>, String>) -> Result<Self> {
        let fail = |file: &str, reason: String| SimulationError::File { path: folder.join(file), reason };
        let load = |file: &str| read(file).map_err(|reason| fail(file, reason));

        let metadata: Metadata =
            serde_json::from_slice(&load("object.json")?).map_err(|error| fail("object.json", error.to_string()))?;
        metadata.check().map_err(|reason| fail("object.json", reason))?;

        let mjcf_name = metadata.mjcf.as_str();
        let text =
            String::from_utf8(load(mjcf_name)?.into_owned()).map_err(|error| fail(mjcf_name, error.to_string()))?;
        let mjcf = sections_of(&text).map_err(|reason| fail(mjcf_name, reason))?;
        let mut files = Vec::new();
        for name in files_named_in(mjcf) {
            if name.is_empty() || name.contains(['/', '\\']) {
                return Err(fail(mjcf_name, format!("file {name:?}: expected a plain file name beside the MJCF")));
            }
            if !files.iter().any(|asset: &Asset| asset.name == name) {
                files.push(Asset { name: name.to_owned(), bytes: load(name)?.into_owned() });
            }
        }
        let mjcf = mjcf.to_owned();
        Ok(Self {
            name: metadata.name,
            title: metadata.title,
            description: metadata.description,
            mass_kg: metadata.mass_kg,
            friction: metadata.friction,
            grasp_start: metadata.grasp_start.into(),
            grasp_end: metadata.grasp_end.into(),
            jaw_width_m: metadata.jaw_width_m,
            grasp_height_m: metadata.grasp_height_m,
            mark_height_m: metadata.mark_height_m,
            seen_height_m: metadata.seen_height_m.unwrap_or(metadata.mark_height_m),
            rest_height_m: metadata.rest_height_m,
            symmetry: metadata.symmetry,
            footprint: metadata.footprint.into_iter().map(Point2::from).collect(),
            mjcf,
            files,
        })
    }

    /// The pose of the part at rest on the table (z = 0), with its origin above (x, y), rotated by `yaw_rad`.
    pub fn base_from_object(&self, x: f64, y: f64, yaw_rad: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::new(x, y, self.rest_height_m),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
        )
    }

    /// The two marks in the base frame.
    pub fn marks_in_base(&self, base_from_object: &Isometry3<f64>) -> [Point3<f64>; 2] {
        [base_from_object * self.grasp_start, base_from_object * self.grasp_end]
    }

    /// The tool centre point for a part at rest, and the direction of the marked line in the base frame (radians
    /// about z from x); the jaws close across that direction.
    pub fn grasp_in_base(&self, base_from_object: &Isometry3<f64>) -> (Point3<f64>, f64) {
        let [start, end] = self.marks_in_base(base_from_object);
        let middle = nalgebra::center(&start, &end);
        let along = end - start;
        (Point3::new(middle.x, middle.y, self.grasp_height_m), along.y.atan2(along.x))
    }

    /// Offset of a grasp from the marked one, for a part at rest, up to the part's symmetry.
    ///
    /// In `base_from_tcp`, x points along the line across which the jaws close.
    pub fn grasp_error(&self, base_from_object: &Isometry3<f64>, base_from_tcp: &Isometry3<f64>) -> GraspError {
        let (marked, direction_rad) = self.grasp_in_base(base_from_object);
        let along = base_from_tcp * Vector3::x();
        let found = Angle::from_direction(along.x, along.y);
        GraspError {
            distance_m: (base_from_tcp.translation.vector.xy() - marked.coords.xy()).norm(),
            angle_rad: self.symmetry.distance(found, Angle::from_radians(direction_rad)),
        }
    }

    /// The part's MJCF at a pose, with the body `object` and its joint `object_joint`.
    pub fn fragment(&self, base_from_object: &Isometry3<f64>) -> MjcfFragment {
        let placed = format!("<body name=\"object\" {}>", pose_attributes(base_from_object));
        MjcfFragment { sections: self.mjcf.replace(BODY_TAG, &placed), files: self.files.clone() }
    }

    /// One more body of the part, `instance_{index}`, in a scene that already contains [`ObjectSpec::fragment`], whose
    /// meshes and materials it uses.
    pub(crate) fn instance_fragment(&self, index: usize, base_from_object: &Isometry3<f64>) -> MjcfFragment {
        const OPEN: &str = "<worldbody>";
        const CLOSE: &str = "</worldbody>";
        let mut sections = String::new();
        let mut rest = self.mjcf.as_str();
        while let Some((from, to)) = rest.find(OPEN).and_then(|from| Some((from, from + rest[from..].find(CLOSE)?))) {
            sections.push_str(&rest[from..to + CLOSE.len()]);
            rest = &rest[to + CLOSE.len()..];
        }
        let placed = format!("<body name=\"object\" {}>", pose_attributes(base_from_object));
        let sections =
            sections.replace(BODY_TAG, &placed).replace(" name=\"object", &format!(" name=\"instance_{index}"));
        MjcfFragment { sections, files: Vec::new() }
    }
}

/// The content of the `<mujoco>` element.
fn sections_of(text: &str) -> std::result::Result<&str, String> {
    let inside = text
        .find("<mujoco")
        .and_then(|open| Some(open + text[open..].find('>')? + 1))
        .zip(text.rfind("</mujoco>"))
        .filter(|(from, to)| from <= to)
        .map(|(from, to)| &text[from..to])
        .ok_or("expected a <mujoco> element")?;
    let bodies = inside.matches(BODY_TAG).count();
    if bodies != 1 {
        return Err(format!("expected {BODY_TAG} once, found {bodies} times"));
    }
    if !inside.contains("name=\"object_joint\"") {
        return Err("expected a free joint named object_joint in the body".to_owned());
    }
    Ok(inside)
}

/// The values of all `file="…"` attributes.
fn files_named_in(mjcf: &str) -> impl Iterator<Item = &str> {
    mjcf.split(" file=\"").skip(1).filter_map(|rest| rest.split('"').next())
}

/// The folder of this repository that contains the parts, for tools that write them.
pub fn source_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/objects")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::data::Data;
    use crate::model::{Body, Model};
    use crate::scene::SceneVariation;
    use approx::assert_relative_eq;

    #[test]
    fn every_part_compiled_in_reads_and_equals_its_folder() {
        assert_eq!(ObjectSpec::names().count(), 12);
        for name in ObjectSpec::names() {
            let spec = ObjectSpec::by_name(name).unwrap();
            assert_eq!(spec.name, name);
            assert!(spec.mass_kg < 1.0 && spec.jaw_width_m < 0.055, "{name}");
            assert_eq!(spec, ObjectSpec::from_folder(&source_folder().join(name)).unwrap());
        }
    }

    #[test]
    fn held_out_parts_follow_the_papers() {
        let paper: Vec<_> = ObjectSpec::paper_names().collect();
        assert_eq!((paper.len(), paper[0], paper[7]), (8, "pendulum", "cranfield_face"));
        assert!(ObjectSpec::held_out_names().eq(["key", "pliers", "circuit_board", "spring_clip"]));
    }

    #[test]
    fn grasp_turns_with_the_part() {
        let spec = ObjectSpec::by_name("pendulum").unwrap();
        let base_from_object = spec.base_from_object(0.5, -0.1, std::f64::consts::FRAC_PI_2);
        let (tcp, direction) = spec.grasp_in_base(&base_from_object);
        assert_relative_eq!(tcp, Point3::new(0.5, -0.1, spec.grasp_height_m), epsilon = 1e-12);
        assert_relative_eq!(direction, std::f64::consts::FRAC_PI_2, epsilon = 1e-12);
        let [start, end] = spec.marks_in_base(&base_from_object);
        assert!(start.y < end.y && (start.z - spec.mark_height_m).abs() < 1e-12);
    }

    /// Extent of a part from the origin of the object frame in a direction (rad).
    fn reach_m(spec: &ObjectSpec, direction: f64) -> f64 {
        let (sin, cos) = direction.sin_cos();
        spec.footprint.iter().map(|p| p.x * cos + p.y * sin).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn outlines_are_as_symmetric_as_declared() {
        for name in ObjectSpec::names() {
            let spec = ObjectSpec::by_name(name).unwrap();
            // Largest change of the outline by a rotation.
            let change_m = |turn: f64| {
                (0..180)
                    .map(|degrees| f64::from(2 * degrees).to_radians())
                    .map(|angle| (reach_m(&spec, angle) - reach_m(&spec, angle + turn)).abs())
                    .fold(0.0, f64::max)
            };
            // Symmetries of 2, 3 and 4 folds.
            for turn in [2.0, 3.0, 4.0].map(|parts| std::f64::consts::TAU / parts) {
                let hidden = spec.symmetry.distance(Angle::from_radians(turn), Angle::ZERO) < 1e-9;
                let change_m = change_m(turn);
                assert_eq!(change_m < 0.0005, hidden, "{name} turned by {turn} rad: {change_m} m");
                assert!(hidden || change_m > 0.004, "{name} turned by {turn} rad: {change_m} m");
            }
        }
    }

    #[test]
    fn grasp_error_leaves_out_turns_that_cannot_be_seen() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let base_from_object = spec.base_from_object(0.5, -0.1, 2.0);
        let turned = spec.base_from_object(0.503, -0.104, 2.0 - 0.25);
        let beside = crate::oracle::marked_grasp(&spec, &turned).base_from_tcp;
        let error = spec.grasp_error(&base_from_object, &beside);
        assert_relative_eq!(error.distance_m, 0.005, epsilon = 1e-9);
        assert_relative_eq!(error.angle_rad, 0.25, epsilon = 1e-9);
        for (symmetry, expected) in [(RotationalSymmetry::Fold(24), 0.25 - 0.261799), (RotationalSymmetry::Full, 0.0)] {
            let error = ObjectSpec { symmetry, ..spec.clone() }.grasp_error(&base_from_object, &beside);
            assert_relative_eq!(error.angle_rad, f64::abs(expected), epsilon = 1e-5);
        }
    }

    #[test]
    fn unknown_name_lists_the_parts() {
        let message = ObjectSpec::by_name("piston").unwrap_err().to_string();
        assert!(message.contains("piston") && message.contains("rod_end"), "{message}");
    }

    #[test]
    fn bad_mjcf_is_refused() {
        let body = "<body name=\"object\"><freejoint name=\"object_joint\"/></body>";
        assert!(sections_of(&format!("<mujoco model=\"a\">{body}</mujoco>")).is_ok());
        assert!(sections_of(&format!("<mujoco>{body}{body}</mujoco>")).unwrap_err().contains("2 times"));
        assert!(sections_of("<mujoco><body name=\"object\"/></mujoco>").is_err());
        assert!(sections_of(body).is_err());
        assert!(sections_of("</mujoco><mujoco").is_err());
    }

    #[test]
    fn every_part_lies_still_on_the_table() {
        for name in ObjectSpec::names() {
            let spec = ObjectSpec::by_name(name).unwrap();
            let placed = spec.base_from_object(0.5, 0.1, 0.7);
            let fragment = SceneVariation::nominal(Some((&spec, placed))).fragment();
            let model = Arc::new(Model::from_xml(&fragment.to_standalone_mjcf(), &fragment.files).unwrap());
            let body = model.id::<Body>("object").unwrap();
            assert_relative_eq!(model.mass_kg(body), spec.mass_kg, epsilon = 1e-4);
            let mut data = Data::new(model.clone()).unwrap();
            while data.time_secs() < 2.0 {
                data.step().unwrap();
            }
            let drift = placed.inverse() * data.world_from_body(body);
            assert!(drift.translation.vector.norm() < 1e-3, "{name} moved by {}", drift.translation);
            assert!(drift.rotation.angle() < 0.01, "{name} turned by {} rad", drift.rotation.angle());
        }
    }
}
