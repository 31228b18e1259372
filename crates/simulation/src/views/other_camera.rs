//! Cameras other than the robot's wrist camera, each with its own lens, resolution and pose above the table.
//!
//! ```text
//! (part, camera, number, seed) ─ ordinary scene, the arm pointing away ─ camera at a height and tilt ─ picture with distortion
//! ```
//! These cameras represent a user's second camera, which differs from the camera that took the demonstration's photo.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{PinholeCamera, PlumbBob, PosedCamera};

use super::seed::seed_of;
use super::tilted::tilted_camera;
use super::{GraspTruth, shows_whole};
use crate::camera::{CameraView, optical_from_mujoco_camera};
use crate::data::Data;
use crate::error::{Result, SimulationError};
use crate::lens::Frustum;
use crate::objects::{LookAlikeKind, ObjectSpec};
use crate::panda::PandaIds;
use crate::render::{RenderConfig, Renderer};
use crate::scene::{PlacedObject, SceneVariation, VariationConfig, pose_attributes};
use crate::workcell::{WorkcellConfig, build_model};

/// A camera model and its possible poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherCamera {
    /// The name in tables.
    pub name: &'static str,
    /// Resolution, focal length, axis and lens.
    pub intrinsics: PinholeCamera,
    /// Smallest and largest distance to the point on the table at which the camera is aimed, in metres.
    pub distances_m: [f64; 2],
}

/// Three cameras with other focal lengths, lenses and distances than the wrist camera (640 × 480 pixels, focal length
/// 550 px, distance 0.58 m).
pub const OTHER_CAMERAS: [OtherCamera; 3] = [
    OtherCamera {
        name: "webcam",
        intrinsics: PinholeCamera {
            width: 640,
            height: 480,
            fx: 452.0,
            fy: 449.0,
            cx: 327.0,
            cy: 233.5,
            lens: PlumbBob { k1: -0.27, k2: 0.08, p1: 0.0012, p2: -0.0008, k3: 0.0 },
        },
        distances_m: [0.42, 0.55],
    },
    OtherCamera {
        name: "phone",
        intrinsics: PinholeCamera {
            width: 960,
            height: 720,
            fx: 742.0,
            fy: 742.0,
            cx: 475.0,
            cy: 364.0,
            lens: PlumbBob { k1: 0.09, k2: -0.16, p1: -0.0004, p2: 0.0006, k3: 0.0 },
        },
        distances_m: [0.50, 0.75],
    },
    OtherCamera {
        name: "overhead",
        intrinsics: PinholeCamera {
            width: 1280,
            height: 720,
            fx: 921.0,
            fy: 923.0,
            cx: 648.5,
            cy: 352.0,
            lens: PlumbBob { k1: -0.12, k2: 0.04, p1: 0.0, p2: 0.0011, k3: 0.0 },
        },
        distances_m: [0.72, 0.94],
    },
];

/// Smallest and largest tilt from straight down, in degrees.
const TILTS_DEG: [f64; 2] = [0.0, 25.0];
/// Largest distance in x and in y between the part and the point at which the camera is aimed, in metres.
const MAX_LOOK_OFFSET_M: f64 = 0.05;
/// Maximum number of poses that are tried until the whole part is in the picture.
const MAX_TRIES: usize = 40;
/// Angle of the first joint at which the arm points away from the table, in radians.
const TURNED_AWAY_RAD: f64 = 2.7;

/// The object on the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnTable {
    /// The part.
    Part,
    /// The part in another size, in percent of its true size.
    Scaled(u32),
}

/// A picture with its ground truth.
#[derive(Debug, Clone)]
pub struct OtherView {
    /// The picture and its camera.
    pub view: CameraView,
    /// Ground truth of the part; `None` if another object is shown instead.
    pub truth: Option<GraspTruth>,
    /// Height of the camera above the table, in metres.
    pub height_m: f64,
    /// Tilt from straight down, in degrees.
    pub tilt_deg: f64,
}

/// Renders picture `number` (of `of`) of a part by a camera: distance and tilt vary over their ranges with the number.
///
/// # Errors
/// As for [`crate::Workcell::new`]; [`SimulationError::Configuration`] if no pose shows the whole part.
pub fn other_view(
    spec: &ObjectSpec,
    on_table: OnTable,
    camera: &OtherCamera,
    (number, of): (u64, u64),
    seed: u64,
) -> Result<OtherView> {
    let mut rng = rng_of(&spec.name, camera.name, number, seed);
    let scene_seed = rng.random();
    let shown = match on_table {
        OnTable::Part => spec.clone(),
        OnTable::Scaled(percent) => spec.look_alike(LookAlikeKind::Scaled { percent }, rng.random())?.spec,
    };
    let scene = SceneVariation::sample(Some(&shown), &VariationConfig::default(), scene_seed);
    let part = scene.object.clone().ok_or_else(|| no_place(camera, &spec.name))?;
    let within = |[low, high]: [f64; 2], share: f64| low + share.clamp(0.0, 1.0) * (high - low);
    // Distance and tilt vary over their ranges in different orders, so that they are independent.
    let share = |k: u64| (k % of) as f64 / of.max(1) as f64;
    let tilt_deg = within(TILTS_DEG, share(number) + rng.random_range(0.0..1.0 / of.max(1) as f64));
    let distance_share = share(distance_step(of) * number + 3) + rng.random_range(0.0..1.0 / of.max(1) as f64);
    let distance_m = within(camera.distances_m, distance_share);
    let posed = (0..MAX_TRIES)
        .map(|_| PosedCamera {
            intrinsics: camera.intrinsics,
            world_from_camera: looking_at(&part, distance_m, tilt_deg, &mut rng),
        })
        .find(|posed| shows_whole(posed, &part))
        .ok_or_else(|| no_place(camera, &spec.name))?;
    let image = draw(scene, &posed)?;
    let truth = match on_table {
        OnTable::Part => Some(GraspTruth::new(&part, &posed).ok_or_else(|| no_place(camera, &spec.name))?),
        OnTable::Scaled(_) => None,
    };
    let height_m = posed.world_from_camera.translation.z;
    Ok(OtherView { view: CameraView { image, camera: posed }, truth, height_m, tilt_deg })
}

/// A picture of a scene by a fixed camera beside the robot, whose arm points away.
///
/// # Errors
/// As for [`crate::Workcell::new`]; [`SimulationError::Configuration`] for a lens whose model does not cover its
/// picture's corners.
fn draw(scene: SceneVariation, camera: &PosedCamera) -> Result<image::RgbImage> {
    let frustum = Frustum::around(&camera.intrinsics)?;
    let mujoco = camera.world_from_camera * optical_from_mujoco_camera().rotation;
    let named = format!(
        "<worldbody><camera name=\"beside\" {} fovy=\"{:.12}\"/></worldbody>",
        pose_attributes(&mujoco),
        frustum.vertical_field_of_view_rad().to_degrees()
    );
    let model = build_model(&WorkcellConfig::new(scene), &named)?;
    let mut renderer = Renderer::new(&model, frustum.render_config(&RenderConfig::default()))?;
    let mut data = Data::new(model.clone())?;
    let arm = PandaIds::find(&model)?;
    let mut q = sdg_kinematics::ready_pose();
    q[0] = TURNED_AWAY_RAD;
    arm.set_position(&mut data, &q);
    data.forward()?;
    let drawn = renderer.image(&mut data, model.id("beside")?)?;
    Ok(frustum.resample(&drawn, &camera.intrinsics))
}

/// Step between the distances of consecutive pictures, without a common divisor with their number, so that each picture
/// has its own distance.
fn distance_step(of: u64) -> u64 {
    (7..).find(|&step| gcd(step, of) == 1).unwrap_or(1)
}

/// The greatest common divisor.
fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn looking_at(part: &PlacedObject, distance_m: f64, tilt_deg: f64, rng: &mut Pcg64Mcg) -> Isometry3<f64> {
    let at = part.base_from_object.translation.vector;
    let offset = [0; 2].map(|_: i32| rng.random_range(-MAX_LOOK_OFFSET_M..MAX_LOOK_OFFSET_M));
    let aim = Vector3::new(at.x + offset[0], at.y + offset[1], 0.0);
    let [axis_rad, yaw_rad]: [f64; 2] = [0; 2].map(|_: i32| rng.random_range(-PI..PI));
    tilted_camera(&aim, distance_m, yaw_rad, axis_rad, tilt_deg)
}

fn no_place(camera: &OtherCamera, part: &str) -> SimulationError {
    SimulationError::Configuration {
        field: "camera",
        expected: "a place that shows the whole part".into(),
        found: format!("none of {} for {part}", camera.name),
    }
}

/// Random numbers of a picture.
fn rng_of(part: &str, camera: &str, number: u64, seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed_of(part.bytes().chain([0]).chain(camera.bytes()), number, seed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_camera_shows_the_part_where_the_truth_says() {
        let spec = ObjectSpec::by_name("cranfield_face").unwrap();
        for camera in &OTHER_CAMERAS {
            let [first, again] = [0, 1].map(|_| other_view(&spec, OnTable::Part, camera, (18, 20), 3).unwrap());
            assert_eq!(first.view, again.view);
            assert!((20.0..25.0).contains(&first.tilt_deg), "{}", first.tilt_deg);
            assert!((0.35..0.95).contains(&first.height_m), "{}", first.height_m);
            let empty = SceneVariation { object: None, ..scene_of(&spec, camera) };
            let without = draw(empty, &first.view.camera).unwrap();
            // The centre of the pixels that differ is less than the part's size from the marks.
            let changed: Vec<Vector3<f64>> = first
                .view
                .image
                .enumerate_pixels()
                .filter(|&(x, y, color)| (0..3).any(|c| color[c].abs_diff(without.get_pixel(x, y)[c]) > 40))
                .map(|(x, y, _)| Vector3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0))
                .collect();
            let middle = changed.iter().sum::<Vector3<f64>>() / changed.len() as f64;
            let marks = first.truth.as_ref().unwrap().line.center();
            assert!(
                changed.len() > 500 && (middle.xy() - marks.coords).norm() < 60.0,
                "{}: {middle}, {marks}",
                camera.name
            );
        }
    }

    #[test]
    fn every_picture_has_its_own_distance() {
        assert_eq!([1, 12, 20, 25].map(distance_step), [7; 4]);
        for of in 1..=70 {
            let mut shares: Vec<u64> = (0..of).map(|number| (distance_step(of) * number + 3) % of).collect();
            shares.sort_unstable();
            assert!(shares.into_iter().eq(0..of), "{of}");
        }
    }

    fn scene_of(spec: &ObjectSpec, camera: &OtherCamera) -> SceneVariation {
        let mut rng = rng_of(&spec.name, camera.name, 18, 3);
        SceneVariation::sample(Some(spec), &VariationConfig::default(), rng.random())
    }
}
