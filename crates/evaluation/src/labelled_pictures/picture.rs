//! A labelled picture: its file, and the instances of the part in it.

use std::path::{Path, PathBuf};

use sdg_geometry::{BoundingBox, GraspLine, RotationalSymmetry};
use serde::Serialize;

/// An instance of the part in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// The box around the instance.
    pub bbox: BoundingBox,
    /// The marked grasp; only an optional instance may lack it.
    pub grasp: Option<GraspLine>,
    /// Whether the instance counts neither as missed nor as wrong: it is flagged as optional, was used for teaching, or
    /// is not completely in the searched region.
    pub optional: bool,
    /// Size and symmetry, if the labels state them.
    pub extent: Option<Extent>,
}

/// The size and symmetry of an instance, by which hits are measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// The diagonal of the demonstration's box, scaled to the instance's size.
    pub diagonal_px: f64,
    /// The equivalent rotations.
    pub symmetry: RotationalSymmetry,
}

/// A picture and its labels.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledPicture {
    pub path: PathBuf,
    /// The label file of the picture.
    pub labels: PathBuf,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The instances of the part; empty if the part is not in the picture.
    pub instances: Vec<Instance>,
    /// The kind of picture, if the labels state it.
    pub kind: Option<String>,
}

impl LabelledPicture {
    /// Makes an instance optional if it is not completely in the searched region.
    pub fn mark_outside(&mut self, searched: &BoundingBox) {
        for instance in &mut self.instances {
            let BoundingBox { x1, y1, x2, y2 } = instance.bbox;
            let is_inside = searched.x1 <= x1 && searched.y1 <= y1 && x2 <= searched.x2 && y2 <= searched.y2;
            instance.optional |= !is_inside;
        }
    }

    /// The file name.
    pub fn name(&self) -> String {
        file_name(&self.path)
    }
}

/// A file of the folder that is left out, and the reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    pub file: String,
    /// The reason, for display.
    pub why: String,
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_reaches_out_of_the_searched_part_may_be_missed() {
        let instance = |x1: f64| {
            let bbox = BoundingBox { x1, y1: 20.0, x2: x1 + 40.0, y2: 60.0 };
            Instance { bbox, grasp: None, optional: false, extent: None }
        };
        let instances = [10.0, 60.0, 61.0, 150.0].map(instance).to_vec();
        let mut picture =
            LabelledPicture { path: "a.png".into(), labels: "a.json".into(), size: [200, 100], instances, kind: None };
        picture.mark_outside(&BoundingBox { x1: 10.0, y1: 10.0, x2: 100.0, y2: 60.0 });
        let optional: Vec<bool> = picture.instances.iter().map(|instance| instance.optional).collect();
        assert_eq!(optional, [false, false, true, true]);
    }
}
