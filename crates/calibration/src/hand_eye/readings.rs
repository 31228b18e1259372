//! Readings of the robot poses: other conventions, in which poses are often written by mistake.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use sdg_geometry::Mount;

use super::closed_form;
use super::euler::Recomposition;
use super::view::motion;

/// Robot poses in another reading.
pub(super) struct Reading {
    /// The reading in words, as part of a sentence.
    pub(super) name: String,
    /// Whether the reading implies the other mount: beside the robot instead of on the hand, or the reverse.
    pub(super) is_other_mount: bool,
    /// `base_from_flange` of each picture.
    pub(super) robot: Vec<Isometry3<f64>>,
}

/// The conversion of a given pose to the intended one.
type OfPose = fn(&Isometry3<f64>) -> Isometry3<f64>;

/// Mistakes other than Euler angles, the simplest first. Poses of a camera on the hand, inverted, have the same
/// equation as poses of a camera beside the robot.
const READINGS: [(&str, bool, OfPose); 8] = [
    ("rotation_xyzw seems to have w first", false, w_first),
    ("the poses seem to be flange_from_base, or the mount to be the other one", true, Isometry3::inverse),
    (
        "the rotations seem to be transposed (flange_from_base, with translations of base_from_flange)",
        false,
        transposed,
    ),
    ("the translations seem to be in millimetres", false, |pose| {
        Isometry3::from_parts((pose.translation.vector / 1000.0).into(), pose.rotation)
    }),
    ("the translations seem to be those of flange_from_base, unlike the rotations", false, |pose| {
        Isometry3::from_parts((-(pose.rotation * pose.translation.vector)).into(), pose.rotation)
    }),
    ("rotation_xyzw seems to have w first, and the mount to be the other one", true, |pose| w_first(pose).inverse()),
    ("rotation_xyzw seems to have w first, and the rotations to be transposed", false, |pose| {
        transposed(&w_first(pose))
    }),
    ("the rotations seem to be transposed, and the mount to be the other one", true, |pose| transposed(pose).inverse()),
];

/// A reading of Euler angles is kept if its closed-form residual is below this fraction of the residual of the given
/// rotations.
const MAX_TURNS_SHARE: f64 = 0.5;
/// Number of readings of Euler angles that are evaluated further: the most likely of those with the smallest residuals.
const NUM_EULER: usize = 3;
/// Ratio of two readings' residuals up to which they count as equal.
const ALIKE: f64 = 1.1;
/// Residual below which all digits are rounding errors, in radians.
const ROUNDING_RAD: f64 = 1e-5;
/// If all rotations are smaller than this, in radians, they may be radians that were read as degrees: half a rotation
/// about each axis is then 3.14 "degrees".
const MAX_TINY_RAD: f64 = 0.1;

/// The readings whose rotations match the board's at least as well as the given ones do, the simplest first.
pub(super) fn plausible(mount: Mount, robot: &[Isometry3<f64>], boards: &[Isometry3<f64>]) -> Vec<Reading> {
    let left = |robot: &[Isometry3<f64>]| {
        let motions: Vec<_> = robot.iter().map(|pose| motion(mount, pose)).collect();
        closed_form::turns_left(&motions, boards)
    };
    let given = left(robot);
    let mut readings: Vec<Reading> = READINGS
        .iter()
        .map(|&(name, is_other_mount, of_pose)| Reading {
            name: name.to_owned(),
            is_other_mount,
            robot: robot.iter().map(of_pose).collect(),
        })
        // Readings of translations leave the rotations unchanged, and so pass this filter.
        .filter(|reading| left(&reading.robot) <= given)
        .collect();
    let is_tiny = robot.iter().all(|pose| pose.rotation.angle() < MAX_TINY_RAD);
    let units: &[f64] = if is_tiny { &[1_f64.to_degrees(), 1.0] } else { &[1.0] };
    let rotations: Vec<_> = robot.iter().map(|pose| pose.rotation).collect();
    let turns = |k: usize, j: usize| boards[k].rotation.angle_to(&boards[j].rotation);
    let recomposed = |way: &Recomposition, first: usize| -> Vec<Isometry3<f64>> {
        let meant = way.apply(&rotations, first, &turns);
        robot.iter().zip(meant).map(|(pose, rotation)| Isometry3::from_parts(pose.translation, rotation)).collect()
    };
    let mut ways: Vec<(f64, Recomposition, usize)> = units
        .iter()
        .flat_map(|unit| Recomposition::all(*unit))
        .flat_map(|way| [(way, 0), (way, 1)])
        .map(|(way, first)| (left(&recomposed(&way, first)), way, first))
        .filter(|(left, ..)| *left < MAX_TURNS_SHARE * given)
        .collect();
    let least = ways.iter().map(|(left, ..)| *left).fold(f64::INFINITY, f64::min);
    // Among equal residuals, the more likely reading comes first.
    ways.retain(|(left, ..)| *left <= ALIKE * least + ROUNDING_RAD);
    let likeliest = ways.iter().take(NUM_EULER);
    readings.extend(likeliest.map(|(_, way, first)| Reading {
        name: name(way),
        is_other_mount: false,
        robot: recomposed(way, *first),
    }));
    readings
}

fn name(way: &Recomposition) -> String {
    let unit = if way.unit > 1.0 { ", and their radians read as degrees" } else { "" };
    if way.composed == way.meant {
        return format!(
            "the rotations seem to be composed of radians that were read as degrees ({})",
            way.meant.formula()
        );
    }
    format!(
        "the rotations seem to be composed as {} from angles meant for {}{unit}",
        way.composed.formula(),
        way.meant.formula()
    )
}

/// The pose whose quaternion was written in the order w, x, y, z and read as x, y, z, w.
fn w_first(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let read = pose.rotation.coords;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(read[0], read[1], read[2], read[3]));
    Isometry3::from_parts(pose.translation, rotation)
}

/// The pose whose rotation was inverted, but not its translation.
fn transposed(pose: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(pose.translation, pose.rotation.inverse())
}
