//! The sets of pictures: other cameras, axes, and parts of other sizes.

use anyhow::Result;
use nalgebra::{Isometry3, Vector3};
use sdg_simulation::CameraView;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{Axis, OTHER_CAMERAS, OnTable, other_view};

use crate::simulated::axes::{draw, instances_in_picture};

/// Sizes of parts that must be refused, in percent of the taught part's size.
const OTHER_SIZES_PERCENT: [u32; 4] = [80, 90, 110, 125];

/// A set of pictures with its own row in the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureSet {
    /// Pictures of one of [`OTHER_CAMERAS`].
    Camera(usize),
    /// Pictures of the wrist camera along an axis of difficulty.
    Axis(Axis),
    /// Pictures of all [`OTHER_CAMERAS`], one after another, in which a part of another size replaces the part.
    OtherSizes,
}

/// A picture with its ground truth.
pub(super) struct Shown {
    pub view: CameraView,
    /// Poses of the part's instances in the base frame.
    pub instances: Vec<Isometry3<f64>>,
}

impl PictureSet {
    /// All sets, in the order of the reports.
    pub fn all() -> Vec<Self> {
        // Slants are an axis for cameras without calibration.
        let is_shown = |axis: &Axis| ![Axis::LookAlikes, Axis::Slant].contains(axis);
        let axes = Axis::ALL.into_iter().filter(is_shown).map(Self::Axis);
        (0..OTHER_CAMERAS.len()).map(Self::Camera).chain(axes).chain([Self::OtherSizes]).collect()
    }

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera(idx) => OTHER_CAMERAS[idx].name,
            Self::Axis(axis) => axis.name(),
            Self::OtherSizes => "other-sizes",
        }
    }

    /// Number of instances of the part in each picture.
    pub(super) fn num_instances(self) -> usize {
        match self {
            Self::Camera(_) => 1,
            Self::Axis(axis) => instances_in_picture(axis),
            Self::OtherSizes => 0,
        }
    }

    /// Renders a picture.
    pub(super) fn draw(self, part: &ObjectSpec, number: u64, of: u64, seed: u64) -> Result<Shown> {
        let (on_table, camera) = match self {
            Self::Axis(axis) => {
                let shown = draw(part, axis, (number, of), seed)?;
                let instances = shown.truths.iter().map(|truth| truth.grasp.base_from_object).collect();
                return Ok(Shown { view: shown.view, instances });
            }
            Self::Camera(idx) => (OnTable::Part, &OTHER_CAMERAS[idx]),
            Self::OtherSizes => {
                let percent = OTHER_SIZES_PERCENT[number as usize % OTHER_SIZES_PERCENT.len()];
                let camera = &OTHER_CAMERAS[(number as usize / OTHER_SIZES_PERCENT.len()) % OTHER_CAMERAS.len()];
                (OnTable::Scaled(percent), camera)
            }
        };
        let shown = other_view(part, on_table, camera, (number, of), seed)?;
        Ok(Shown { view: shown.view, instances: shown.truth.iter().map(|truth| truth.base_from_object).collect() })
    }
}

impl Shown {
    /// Height of the camera above the table, in metres, and its tilt from the vertical, in degrees.
    pub fn height_and_tilt(&self) -> (f64, f64) {
        let camera = self.view.camera.world_from_camera;
        let down = -(camera * Vector3::z()).z;
        (camera.translation.z, down.clamp(-1.0, 1.0).acos().to_degrees())
    }
}
