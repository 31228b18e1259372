//! The objects on the table under the camera, and the range of each part.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};

use super::config::TableCameraConfig;
use super::motion::Bounds;
use crate::camera::{WRIST_FOCAL_LENGTH_PX, optical_from_mujoco_camera, vertical_field_of_view_rad};
use crate::model::Asset;
use crate::objects::ObjectSpec;
use crate::render::RenderConfig;
use crate::scene::{
    MjcfFragment, PlacedObject, SceneVariation, VariationConfig, pose_attributes, sample_distractors_between,
};
use crate::views::base_from_look_camera;

/// The table area for objects, inside the camera's view from its usual height, in the base frame.
const SHOWN: Bounds = Bounds { x_m: [0.26, 0.70], y_m: [-0.31, 0.31] };
/// Width along y of the strip with the distractors, in metres.
const STRIP_M: f64 = 0.10;
/// z of hidden objects, below the table, in metres.
const AWAY_M: f64 = -3.0;
/// Half of the card's side, in metres.
const CARD_HALF_M: f64 = 0.06;

/// A pose outside every picture.
pub(super) fn away() -> Isometry3<f64> {
    Isometry3::translation(0.5, 0.0, AWAY_M)
}

/// Centre of the outline's box from above, and the outline's largest distance from this centre.
pub(super) fn middle_of(spec: &ObjectSpec) -> (Point2<f64>, f64) {
    let bounds = |k: usize| {
        let values = spec.footprint.iter().map(|point| point[k]);
        0.5 * (values.clone().fold(f64::INFINITY, f64::min) + values.fold(f64::NEG_INFINITY, f64::max))
    };
    let middle = Point2::new(bounds(0), bounds(1));
    (middle, spec.footprint.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max))
}

/// Equal intervals of the table along y, one for each part. With distractors, a strip at the upper end of y is left for
/// them.
pub(super) fn lanes(count: usize, with_things: bool) -> Vec<Bounds> {
    let [low, high] = SHOWN.y_m;
    let high = if with_things { high - STRIP_M } else { high };
    let width = (high - low) / count as f64;
    (0..count).map(|idx| Bounds { y_m: [low + width * idx as f64, low + width * (idx + 1) as f64], ..SHOWN }).collect()
}

/// The scene of the seed: light and table, all instances of the part, and the distractors in their strip.
pub(super) fn scene(config: &TableCameraConfig, spec: &ObjectSpec) -> SceneVariation {
    let mut scene = SceneVariation::sample(
        None,
        &VariationConfig { distractors: 0..=0, ..VariationConfig::default() },
        config.seed,
    );
    let placed = || PlacedObject { spec: spec.clone(), base_from_object: away() };
    scene.object = Some(placed());
    scene.instances = (1..config.count).map(|_| placed()).collect();
    let strip = SHOWN.y_m[1] - STRIP_M..SHOWN.y_m[1];
    // A distractor may reach the border of the lanes, but not beyond it.
    let end_m = strip.start - VariationConfig::default().clearance_m;
    let lanes = [[-1.0, -1.0], [2.0, -1.0], [2.0, end_m], [-1.0, end_m]].map(Point2::from).to_vec();
    let x_m = SHOWN.x_m[0]..SHOWN.x_m[1];
    scene.distractors = sample_distractors_between(x_m, strip, vec![lanes], config.num_things, config.seed);
    scene
}

/// The MJCF of the scene, the card and the camera.
pub(super) fn mjcf(config: &TableCameraConfig, fragment: &MjcfFragment) -> String {
    let fovy = vertical_field_of_view_rad(WRIST_FOCAL_LENGTH_PX, RenderConfig::default().height).to_degrees();
    let look = base_from_look_camera();
    let at = Translation3::new(look.translation.x, look.translation.y, config.height_m);
    // The camera is tilted about the point at the centre of its view, which stays there.
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), config.tilt_rad);
    let foot = Translation3::new(at.x, at.y, 0.0);
    let optical = foot * tilt * foot.inverse() * Isometry3::from_parts(at, look.rotation);
    let pose = pose_attributes(&(optical * optical_from_mujoco_camera().rotation));
    let mut text = String::new();
    let _ = write!(
        text,
        "<mujoco><compiler angle='radian'/><option timestep='0.001'><flag contact='disable'/></option>\
         <statistic center='0.4 0 0.3' extent='1.2'/><worldbody><camera name='over_table' {pose} fovy='{:.12}'/>\
         <body name='card' pos='0.5 0 {AWAY_M}'><freejoint name='card_joint'/>\
         <geom name='card' type='box' size='{CARD_HALF_M} {CARD_HALF_M} 0.001' rgba='0.75 0.7 0.6 1' contype='0' conaffinity='0' \
         group='1'/></body></worldbody>{}</mujoco>",
        fovy, fragment.sections
    );
    text
}

/// Renames the objects and files of a part, so that another part can be in the same scene.
pub(super) fn renamed(fragment: MjcfFragment) -> MjcfFragment {
    let sections = fragment.sections.replace("=\"object", "=\"beside").replace(" file=\"", " file=\"beside_");
    let files = fragment
        .files
        .into_iter()
        .map(|asset| Asset { name: format!("beside_{}", asset.name), bytes: asset.bytes })
        .collect();
    MjcfFragment { sections, files }
}
