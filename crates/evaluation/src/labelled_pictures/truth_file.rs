//! `truth.json`: all pictures of a folder with the part's instances, each with its own size and symmetry.
//!
//! A list with an entry for each picture; docs/file-formats.md describes the fields. Other fields are ignored.

use std::path::Path;

use anyhow::{Context, Result, bail};
use nalgebra::{Point2, Vector2};
use sdg_cell::Perception;
use sdg_demonstration::IMAGE_EXTENSIONS;
use sdg_geometry::{Angle, BoundingBox, GraspLine, RotationalSymmetry};
use serde::Deserialize;
use serde_json::Value;

use super::picture::{Extent, Instance, LabelledPicture, LeftOut, file_name};
use super::taught::taught_grasps;

/// The name of the file in a folder of pictures.
pub const TRUTH_FILE: &str = "truth.json";
/// Value of `kind` for a picture with a look-alike of the part.
const LOOK_ALIKE: &str = "neg_look";
/// Value of `what` for a look-alike that is the part's mirror image.
const MIRROR_IMAGE: &str = "mirror image";
/// The kind of pictures with a mirrored look-alike.
const MIRRORED_LOOK_ALIKE: &str = "neg_mirror";
/// Maximum deviation of a symmetry from 360 degrees divided by an integer, in degrees; smaller deviations are rounded.
const MAX_ROUNDING_DEG: f64 = 0.01;

/// The entry of one picture.
#[derive(Debug)]
pub struct TruthEntry {
    /// The picture's file name.
    pub image: String,
    pub instances: Vec<Instance>,
    pub kind: Option<String>,
}

/// An entry as stored in the file.
#[derive(Deserialize)]
struct RawEntry {
    image: String,
    present: bool,
    instances: Vec<RawInstance>,
    kind: Option<String>,
    what: Option<String>,
}

#[derive(Deserialize)]
struct RawInstance {
    points_px: [[f64; 2]; 2],
    centre_px: [f64; 2],
    angle_deg: f64,
    diag_px: f64,
    symmetry_deg: f64,
    optional: bool,
}

impl TruthEntry {
    /// Reads and checks the file of a folder, except for the pictures' contents.
    ///
    /// # Errors
    /// The file is not a list of entries, an entry lacks a field or has a wrong value, or a picture is missing or has
    /// two entries.
    pub fn read_all(folder: &Path) -> Result<Vec<Self>> {
        let path = folder.join(TRUTH_FILE);
        let bytes = sdg_files::read(&path, sdg_inputs::MAX_ANNOTATION_BYTES)?;
        let list: Vec<Value> = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: expected a JSON list with an entry for each picture", path.display()))?;
        let mut entries: Vec<Self> = Vec::with_capacity(list.len());
        for (idx, value) in list.into_iter().enumerate() {
            let image = value["image"].as_str().map(|image| format!(" ({image})")).unwrap_or_default();
            let place = || format!("{}, entry {}{image}", path.display(), idx + 1);
            let raw: RawEntry = serde_json::from_value(value).with_context(place)?;
            let entry = raw.checked(folder).with_context(place)?;
            if entries.iter().any(|known| known.image == entry.image) {
                bail!("{}: expected one entry for each picture, found another one", place());
            }
            entries.push(entry);
        }
        Ok(entries)
    }
}

impl RawEntry {
    fn checked(self, folder: &Path) -> Result<TruthEntry> {
        let picture = folder.join(&self.image);
        if !picture.is_file() || !sdg_files::has_extension(&picture, &IMAGE_EXTENSIONS) {
            bail!("expected the name of a picture in this folder as image, found \"{}\"", self.image);
        }
        if self.present == self.instances.is_empty() {
            bail!("expected instances where present is true and none elsewhere, found {}", self.instances.len());
        }
        let checked = |(idx, raw): (usize, &RawInstance)| raw.checked().with_context(|| format!("instances[{idx}]"));
        let instances = self.instances.iter().enumerate().map(checked).collect::<Result<_>>()?;
        let kind = match (self.kind.as_deref(), self.what.as_deref()) {
            (Some(LOOK_ALIKE), Some(MIRROR_IMAGE)) => Some(MIRRORED_LOOK_ALIKE.to_owned()),
            _ => self.kind,
        };
        Ok(TruthEntry { image: self.image, instances, kind })
    }
}

impl RawInstance {
    fn checked(&self) -> Result<Instance> {
        let [start, end] = self.points_px.map(Point2::from);
        let half_length = 0.5 * (end - start).norm();
        for (field, length) in [("diag_px", self.diag_px), ("the distance of points_px", half_length)] {
            if length <= 0.0 {
                bail!("expected {field} to be positive, found {length}");
            }
        }
        let turns = (360.0 / self.symmetry_deg).round();
        if !(1.0..=360.0).contains(&turns) || (360.0 / turns - self.symmetry_deg).abs() > MAX_ROUNDING_DEG {
            bail!("expected symmetry_deg to be 360 over an integer of 1 to 360, found {}", self.symmetry_deg);
        }
        let symmetry = if turns == 1.0 { RotationalSymmetry::None } else { RotationalSymmetry::Fold(turns as u32) };
        // The points were rounded. Only their distance is used; centre and direction have their own fields.
        let (sin, cos) = Angle::from_degrees(self.angle_deg).radians().sin_cos();
        let (center, half) = (Point2::from(self.centre_px), half_length * Vector2::new(cos, sin));
        // The file has no box; a square with the same diagonal replaces it.
        let side = self.diag_px * std::f64::consts::FRAC_1_SQRT_2;
        let [left, top] = self.centre_px.map(|middle| middle - 0.5 * side);
        Ok(Instance {
            bbox: BoundingBox { x1: left, y1: top, x2: left + side, y2: top + side },
            grasp: Some(GraspLine::new(center - half, center + half)),
            optional: self.optional,
            extent: Some(Extent { diagonal_px: self.diag_px, symmetry }),
        })
    }
}

/// The pictures of the file, each with the grasp points of the model's own demonstrations that were cut out of it.
///
/// # Errors
/// The errors of [`TruthEntry::read_all`]; or pictures cannot be read.
pub(super) fn read_truth(
    folder: &Path,
    detector: &Perception,
    left_out: &mut Vec<LeftOut>,
) -> Result<Vec<(LabelledPicture, Vec<Point2<f64>>)>> {
    let entries = TruthEntry::read_all(folder)?;
    for path in sdg_files::entries(folder)?.iter().filter(|path| sdg_files::has_extension(path, &IMAGE_EXTENSIONS)) {
        if !entries.iter().any(|entry| folder.join(&entry.image) == **path) {
            left_out.push(LeftOut { file: file_name(path), why: format!("{TRUTH_FILE} does not name it") });
        }
    }
    let picture = |entry: TruthEntry| {
        let path = folder.join(&entry.image);
        let image = sdg_inputs::read_image(&path)?;
        let taught = detector.taught_grasps(&image, taught_grasps).with_context(|| path.display().to_string())?;
        let picture = LabelledPicture {
            path,
            labels: folder.join(TRUTH_FILE),
            size: image.dimensions().into(),
            instances: entry.instances,
            kind: entry.kind,
        };
        Ok((picture, taught))
    };
    entries.into_iter().map(picture).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A picture with an instance with a diagonal of 100 pixels and a symmetry of 180 degrees.
    fn entry() -> Value {
        let instance = serde_json::json!({"points_px": [[10, 20], [40, 60]], "centre_px": [25, 40], "angle_deg": 53.13,
            "diag_px": 100, "symmetry_deg": 180, "optional": false, "how": "by eye"});
        serde_json::json!({"image": "a.png", "present": true, "instances": [instance], "kind": "plain"})
    }

    fn read(text: &str) -> Result<Vec<TruthEntry>> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.png"), "").unwrap();
        fs::write(folder.path().join(TRUTH_FILE), text).unwrap();
        TruthEntry::read_all(folder.path())
    }

    #[test]
    fn an_instance_has_the_marks_size_and_symmetry_of_its_entry() {
        let entries = read(&format!("[{}]", entry())).unwrap();
        let instance = &entries[0].instances[0];
        let line = instance.grasp.unwrap();
        assert!((line.center() - Point2::new(25.0, 40.0)).norm() < 1e-9 && (line.length() - 50.0).abs() < 1e-9);
        assert!((line.angle().degrees() - 53.13).abs() < 1e-9);
        assert_eq!(instance.extent, Some(Extent { diagonal_px: 100.0, symmetry: RotationalSymmetry::Fold(2) }));
        assert!((instance.bbox.width().hypot(instance.bbox.height()) - 100.0).abs() < 1e-9);
        assert_eq!(entries[0].kind.as_deref(), Some("plain"));
    }

    #[test]
    fn mirrored_look_alikes_are_a_kind_of_their_own() {
        for (what, kind) in [("mirror image", "neg_mirror"), ("hole moved", "neg_look")] {
            let entry = serde_json::json!([{"image": "a.png", "present": false, "instances": [], "kind": "neg_look", "what": what}]);
            assert_eq!(read(&entry.to_string()).unwrap()[0].kind.as_deref(), Some(kind));
        }
    }

    #[test]
    fn a_wrong_entry_is_told_with_its_place() {
        let with = |pointer: &str, value: Value| {
            let mut entry = entry();
            *entry.pointer_mut(pointer).unwrap() = value;
            format!("[{entry}]")
        };
        for (text, parts) in [
            ("[{".to_owned(), &["truth.json: expected a JSON list", "line 1"][..]),
            ("{}".to_owned(), &["truth.json: expected a JSON list", "map"]),
            ("[1]".to_owned(), &["truth.json, entry 1", "integer `1`"]),
            (with("/image", "b.png".into()), &["entry 1 (b.png)", "a picture in this folder", "\"b.png\""]),
            (with("/present", "yes".into()), &["entry 1 (a.png)", "\"yes\"", "boolean"]),
            (with("/present", false.into()), &["none elsewhere, found 1"]),
            (with("/instances", Value::Array(Vec::new())), &["present is true", "found 0"]),
            (with("/instances/0/diag_px", 0.into()), &["instances[0]", "diag_px to be positive, found 0"]),
            (with("/instances/0/symmetry_deg", 100.into()), &["instances[0]", "symmetry_deg", "found 100"]),
            (with("/instances/0/symmetry_deg", 0.into()), &["symmetry_deg", "found 0"]),
            (with("/instances/0/angle_deg", Value::Null), &["entry 1 (a.png)", "invalid type: null"]),
            (format!("[{}, {}]", entry(), entry()), &["entry 2 (a.png)", "one entry for each picture"]),
        ] {
            let error = sdg_inputs::one_line(&read(&text).unwrap_err());
            for part in parts {
                assert!(error.contains(part), "expected {part} in: {error}");
            }
        }
    }
}
