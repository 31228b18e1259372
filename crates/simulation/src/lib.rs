//! A Franka Panda with a wrist camera at a table, in MuJoCo: pictures, motions, and grasp attempts.
//!
//! ```text
//! objects ─┐                      ┌─> Renderer ─> CameraView ─> PartFinder ─> GraspTarget ─┐
//! scene   ─┴─> Workcell (MJCF) ─> Model, Data                                              │
//!                                 └<── controller, gripper <── Arm <── sdg_robot::grasp <──┘
//! ```
//!
//! This renders a picture of an MJCF model:
//!
//! ```
//! use std::sync::Arc;
//! use sdg_simulation::{CameraView, Data, Model, RenderConfig, Renderer};
//!
//! # fn main() -> Result<(), sdg_simulation::SimulationError> {
//! let xml = "<mujoco><worldbody><light pos='0 0 1'/><geom name='ball' size='.05' rgba='1 0 0 1'/>\
//!            <camera name='above' pos='0 0 1' fovy='47.15'/></worldbody></mujoco>";
//! let model = Arc::new(Model::from_xml(xml, &[])?); // files of the MJCF go into the slice of `Asset`s
//! let mut data = Data::new(model.clone())?;
//! let mut renderer = Renderer::new(&model, RenderConfig::default())?;
//! let view = CameraView::capture(&mut renderer, &mut data, model.id("above")?)?;
//! let [red, green, _] = view.image.get_pixel(320, 240).0;
//! assert!(red > 2 * green);
//! # Ok(())
//! # }
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod arm;
mod attempt;
mod attempt_errors;
mod camera;
mod collision_world;
mod compliant;
mod controller;
mod data;
mod egl;
mod error;
mod extent;
mod fci_plant;
mod fragment;
mod gripper;
mod guard;
mod inverse_dynamics;
mod lens;
mod model;
mod normal;
pub mod objects;
mod obstacles;
mod oracle;
mod panda;
mod planning_problem;
mod record;
mod reference;
mod render;
pub mod scene;
mod self_distance;
mod shake;
pub mod shapes;
pub mod table_camera;
pub mod views;
mod workcell;

pub use attempt::{AttemptConfig, AttemptReport};
pub use attempt_errors::{ArmFault, ArmFaultKind, AttemptErrors, Shake};
pub use camera::{CameraView, WRIST_FOCAL_LENGTH_PX, posed_camera, vertical_field_of_view_rad};
pub use collision_world::{CollisionWorld, Overlap};
pub use controller::{ArmController, ArmReference};
pub use data::{Contact, Data};
pub use error::{Result, SimulationError};
pub use extent::lowest_point_m;
pub use fci_plant::{PandaPlant, SharedPositions};
pub use gripper::{Gripper, MAX_FINGER_FORCE_N};
pub use inverse_dynamics::InverseDynamics;
pub use model::{Actuator, Asset, Body, Camera, Geom, Id, Joint, Kind, Model, Site};
pub use obstacles::{obstacles_mjcf, random_obstacles};
pub use oracle::{marked_grasp, part_shape};
pub use panda::{
    ArmVector, FINGER_TRAVEL_M, FINGERTIP_BEYOND_TCP_M, NUM_ARM_JOINTS, PANDA_FILE, PandaIds, panda_asset,
};
pub use planning_problem::PlanningProblem;
pub use record::RecordConfig;
pub use render::{RenderConfig, Renderer, Segmentation, Tessellation};
pub use workcell::{Workcell, WorkcellConfig};

/// Loads MuJoCo and EGL, which the simulator and its pictures need. A call before a long computation reports missing
/// libraries at once.
///
/// # Errors
/// [`SimulationError::Library`] without MuJoCo 2.2.2, [`SimulationError::Rendering`] without EGL or its surfaceless
/// platform.
pub fn load() -> Result<()> {
    guard::initialise()?;
    egl::load()
}
