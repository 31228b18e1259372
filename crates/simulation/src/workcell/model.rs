//! The workcell's MJCF: the robot, the table, the objects on it, and the camera at its pose.

use std::sync::Arc;

use sdg_kinematics::HandGeometry;
use sdg_robot::CameraPose;

use crate::camera::{WRIST_FOCAL_LENGTH_PX, optical_from_mujoco_camera, vertical_field_of_view_rad};
use crate::error::Result;
use crate::lens::Frustum;
use crate::model::Model;
use crate::obstacles::obstacles_mjcf;
use crate::panda::{PANDA_FILE, changed_panda_asset};
use crate::scene::pose_attributes;

use super::config::WorkcellConfig;

/// Name of a camera beside the robot.
pub(crate) const CAMERA_IN_BASE: &str = "beside";

/// Distance of the floor below the table, in metres.
const FLOOR_BELOW_TABLE_M: f64 = 0.75;

/// Capacity of MuJoCo's lists of contacts and constraint rows: five times the need of attempts with shipped parts and
/// of crowded scenes (78 contacts, 289 rows). It is limited because MuJoCo allocates memory in proportion to the square
/// of the rows, and sets it to zero for each scene: 28 MB for 1500 rows, 76 MB for 2500.
const NUM_CONTACTS: usize = 400;
const NUM_ROWS: usize = 1500;
/// Number of collision shapes of a part for which this capacity is sufficient; shipped parts have up to 17.
const NUM_SHAPES: usize = 20;
/// Contacts of each further shape, a box of an extruded part, with the table, and rows of a contact with friction.
const CONTACTS_PER_BOX: usize = 4;
const ROWS_PER_CONTACT: usize = 4;

/// Builds MuJoCo's model of the robot, the table and the objects on it, with further MJCF sections.
pub(crate) fn build_model(config: &WorkcellConfig, sections: &str) -> Result<Arc<Model>> {
    let mut fragment = config.scene.fragment_on_table(config.table_height_m);
    let num_more_shapes = fragment.sections.matches("_collision_").count().saturating_sub(NUM_SHAPES);
    let num_more_contacts = CONTACTS_PER_BOX * num_more_shapes;
    if let Some(seen) = &config.seen_part {
        fragment.append(seen.fragment());
    }
    let fovy_deg = match &config.wrist_camera {
        Some(camera) => Some(Frustum::around(camera)?.vertical_field_of_view_rad().to_degrees()),
        None => None,
    };
    let (mut hand_from_camera, mut camera_in_base) = (None, String::new());
    match config.camera_pose {
        None => {}
        Some(CameraPose::OnFlange(flange_from_camera)) => {
            let flange_from_hand = HandGeometry::franka().flange_from_hand;
            hand_from_camera = Some(flange_from_hand.inverse() * flange_from_camera * optical_from_mujoco_camera());
        }
        Some(CameraPose::InBase(base_from_camera)) => {
            let pose = pose_attributes(&(base_from_camera * optical_from_mujoco_camera()));
            let fovy_deg = fovy_deg
                .unwrap_or(vertical_field_of_view_rad(WRIST_FOCAL_LENGTH_PX, config.wrist_render.height).to_degrees());
            camera_in_base =
                format!("<worldbody><camera name=\"{CAMERA_IN_BASE}\" {pose} fovy=\"{fovy_deg:.12}\"/></worldbody>");
        }
    }
    let obstacles = match &config.obstacles[..] {
        [] => String::new(),
        obstacles => format!("<worldbody>{}</worldbody>", obstacles_mjcf(obstacles, "rgba=\"0.85 0.55 0.25 1\"")),
    };
    let xml = include_str!("../../assets/workcell.xml")
        .replace("PANDA_FILE", PANDA_FILE)
        .replace("NUM_CONTACTS", &(NUM_CONTACTS + num_more_contacts).to_string())
        .replace("NUM_ROWS", &(NUM_ROWS + ROWS_PER_CONTACT * num_more_contacts).to_string())
        .replace("FLOOR_Z_M", &(config.table_height_m - FLOOR_BELOW_TABLE_M).to_string())
        .replace("<!-- SCENE -->", &(fragment.sections + &camera_in_base + &obstacles + sections));
    let mut assets = fragment.files;
    assets.push(changed_panda_asset(config.errors.pad_friction, fovy_deg, hand_from_camera.as_ref()));
    Ok(Arc::new(Model::from_xml(&xml, &assets)?))
}
