//! Types common to the axes: the requested picture, and the result.

use std::ops::Range;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::axis_name::Axis;
use crate::camera::CameraView;
use crate::objects::ObjectSpec;
use crate::scene::{SceneVariation, VariationConfig};
use crate::views::seed::seed_of;
use crate::workcell::Workcell;

/// Number of strata of an axis, and of pictures of a complete round: one for each stratum.
pub const PICTURES_PER_AXIS: u64 = 20;

/// The stratum of picture `number` of `of`. The pictures of a last, incomplete round are spread over the strata.
pub fn axis_stratum(number: u64, of: u64) -> u64 {
    let (in_round, num_last) = (number % PICTURES_PER_AXIS, of % PICTURES_PER_AXIS);
    match num_last == 0 || number < of - num_last {
        true => in_round,
        false => (2 * in_round + 1) * PICTURES_PER_AXIS / (2 * num_last),
    }
}

/// The amount of change of a picture along its axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisParameter {
    /// The number, in `unit`.
    pub value: f64,
    /// Unit of the number, such as `of the usual height`, `degrees`, `px`.
    pub unit: &'static str,
    /// A description for people.
    pub description: String,
}

/// The request of a picture: part, axis, number and seed, in the form that the axes' modules need.
pub(super) struct Request<'a> {
    pub(super) spec: &'a ObjectSpec,
    pub(super) number: u64,
    /// Seed of the ordinary scene.
    pub(super) scene_seed: u64,
    /// Position of the picture in the axis' range, 0 to 1.
    pub(super) level: f64,
    /// Random numbers for the axis.
    pub(super) rng: Pcg64Mcg,
}

impl<'a> Request<'a> {
    pub(super) fn new(spec: &'a ObjectSpec, axis: Axis, (number, of): (u64, u64), seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed_of(spec.name.bytes(), number, seed) ^ ((axis as u64) << 56));
        let scene_seed = rng.random();
        let stratum = axis_stratum(number, of) as f64;
        let level = (stratum + rng.random_range(0.0..1.0)) / PICTURES_PER_AXIS as f64;
        Self { spec, number, scene_seed, level, rng }
    }

    /// The picture's value in a range.
    pub(super) fn between(&self, range: Range<f64>) -> f64 {
        range.start + self.level * (range.end - range.start)
    }

    pub(super) fn ordinary_scene(&self) -> SceneVariation {
        SceneVariation::sample(Some(self.spec), &VariationConfig::default(), self.scene_seed)
    }
}

/// The result of an axis: the picture before its ground truth is measured.
pub(super) struct Drawn {
    pub(super) cell: Workcell,
    pub(super) scene: SceneVariation,
    pub(super) view: CameraView,
    pub(super) parameter: AxisParameter,
}
