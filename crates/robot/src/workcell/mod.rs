//! A workcell file: the robot, its load, the camera, the table, the workspace, look-out poses, obstacles and places.
//!
//! ```toml
//! format = 1
//!
//! [robot]
//! model = "panda"                   # or "fr3"
//! address = "172.16.0.2"            # optional; --robot sets it too
//!
//! [tool]                            # optional
//! fingertip_beyond_tcp_mm = 9.0     # distance of the finger tips beyond the tcp
//! grasp_force_n = 40.0
//! part_mass_kg = 0.2                # given to the controller while the part is held
//! part_radius_mm = 60               # extent of the part from its grasp; the held part is kept away from the obstacles
//!
//! [camera]
//! file = "camera.yaml"              # beside this file; --camera sets it too
//! mounting = "hand"                 # or "base"
//!
//! [table]
//! height_mm = 0.0                   # its z in the robot's base frame
//! x_mm = [100, 900]                 # range of the table, optional: no place may extend beyond it
//! y_mm = [-600, 600]
//!
//! [workspace]                       # allowed range of tcp and flange, mm in the base frame
//! x_mm = [200, 800]
//! y_mm = [-450, 450]
//! z_mm = [0, 900]
//!
//! [[look_out]]                      # one or more, used in order until the part is found
//! camera_at_mm = [480, 0, 580]      # x, y in the base frame, height above the table; or
//! joints_deg = [0, -45, 0, -135, 0, 90, 45]
//! yaw_deg = 0                       # with camera_at_mm; optional
//!
//! [[obstacle]]                      # any number; motions are planned around them
//! name = "fixture"
//! box_mm = [200, 100, 300]          # or cylinder_mm = [diameter, length] or capsule_mm = [diameter, length over all],
//!                                   # along z; or plane_normal = [x, y, z], out of the solid
//! at_mm = [500, 300, 150]           # centre, or a point of the plane, in the base frame
//! rpy_deg = [0, 0, 30]              # roll, pitch, yaw; optional
//!
//! [[place]]                         # one pose for a part: sdg grasp --place shelf
//! name = "shelf"
//! at_mm = [450, 300]                # x, y of the part's grasp, base frame
//! yaw_deg = 90                      # direction of its marked line; optional
//! height_mm = 0                     # of its surface, above the table; optional
//!
//! [[tray]]                          # a grid of cells: sdg grasp --place tray:7; yaw_deg and height_mm as above
//! name = "tray"
//! first_mm = [350, 250]             # centre of the first cell
//! columns = 5                       # cells along its x, the direction of yaw_deg
//! rows = 4
//! pitch_mm = [60, 60]               # from one cell to the next along its x and its y
//!
//! [[bin]]                           # parts lie in it in any pose; yaw_deg and height_mm as above
//! name = "bin"
//! at_mm = [450, -300]               # its centre
//! size_mm = [200, 150]              # inner size, along its x and its y
//! ```
//! Every [`WorkcellError`] contains the number of the line. This crate reads no files: it converts a text to a
//! [`Workcell`].

mod error;
mod file;
mod obstacle;
mod place_sections;
mod source;

use sdg_geometry::Mount;
use sdg_kinematics::collision::{CollisionError, CollisionModel, Obstacle};
use sdg_kinematics::{ArmGeometry, JointVector};

use crate::error::{Result as RobotResult, RobotError};
use crate::place::{Place, PlaceGoal};
use crate::safety::{SafetyLimits, WorkspaceBox};
use crate::sequence::{GraspConfig, LookOut};
use crate::surroundings;

pub use error::WorkcellError;

/// The robot's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotModel {
    /// Franka Emika Robot, "Panda".
    Panda,
    /// Franka Research 3.
    Fr3,
}

impl RobotModel {
    /// The name in the workcell file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Panda => "panda",
            Self::Fr3 => "fr3",
        }
    }

    /// Links, limits and hand of the model.
    pub fn geometry(self) -> ArmGeometry {
        match self {
            Self::Panda => ArmGeometry::panda(),
            Self::Fr3 => ArmGeometry::fr3(),
        }
    }
}

/// A workcell, as its file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Workcell {
    /// The robot's model.
    pub robot: RobotModel,
    /// The robot's network address.
    pub address: Option<String>,
    /// Distance of the finger tips beyond the tcp, m.
    pub fingertip_beyond_tcp_m: f64,
    /// Force of each finger, N.
    pub grasp_force_n: f64,
    /// Mass of the part, kg.
    pub part_mass_kg: Option<f64>,
    /// Extent of the part to all sides of its grasp, m.
    pub part_radius_m: f64,
    /// The camera file, as written in the workcell file.
    pub camera_file: Option<String>,
    /// How the camera is mounted.
    pub mount: Mount,
    /// The table's z in the base frame, m.
    pub table_height_m: f64,
    /// Range of the table along x and y of the base frame, m, if given.
    pub table_m: Option<[[f64; 2]; 2]>,
    /// Box that limits tcp and flange, in the base frame.
    pub workspace: WorkspaceBox,
    /// The look-out poses of the arm.
    pub look_outs: Vec<LookOut>,
    /// Obstacles in the cell besides the table.
    pub obstacles: Vec<Obstacle>,
    /// Places for putting parts down.
    pub places: Vec<Place>,
}

impl Workcell {
    /// The limits of every motion in this workcell.
    pub fn safety_limits(&self) -> SafetyLimits {
        let of_robot = match self.robot {
            RobotModel::Panda => SafetyLimits::default(),
            RobotModel::Fr3 => SafetyLimits::fr3(),
        };
        SafetyLimits {
            workspace: Some(self.workspace),
            table_height_m: self.table_height_m,
            fingertip_beyond_tcp_m: self.fingertip_beyond_tcp_m,
            ..of_robot
        }
    }

    /// The sequence's settings in this workcell, at the pace of rehearsals. The centre of the part's mass is assumed at
    /// the tcp.
    pub fn grasp_config(&self) -> GraspConfig {
        let load = self.part_mass_kg.map(|mass_kg| crate::arm_state::Load {
            mass_kg,
            center_in_flange_m: self.robot.geometry().flange_from_tcp().translation.vector.into(),
        });
        GraspConfig {
            look_outs: self.look_outs.clone(),
            grasp_force_n: self.grasp_force_n,
            load,
            obstacles: self.obstacles.clone(),
            part_radius_m: self.part_radius_m,
            places: self.places.clone(),
            ..GraspConfig::default()
        }
    }

    /// Collision model of the arm with its fingers at an opening (m), the table and the obstacles.
    ///
    /// # Errors
    /// [`CollisionError`] for an opening outside the hand's range; the obstacles were checked when the file was read.
    pub fn collision_model(&self, opening_m: f64) -> Result<CollisionModel, CollisionError> {
        surroundings::collision_model(&self.robot.geometry(), self.table_height_m, &self.obstacles, opening_m)
    }

    /// The place of this name, or the cell of a tray: `NAME` or `NAME:CELL`.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] if there is no such place; it lists the existing places or cells.
    pub fn place(&self, text: &str) -> RobotResult<PlaceGoal> {
        let wrong = |expected: String| RobotError::Configuration {
            what: "place".to_owned(),
            expected,
            found: format!("\"{text}\""),
        };
        let (name, cell) = match text.split_once(':') {
            None => (text, None),
            Some((name, cell)) => {
                let expected = || "NAME, or NAME:CELL with a cell's number from 1 on".to_owned();
                (name, Some(cell.parse::<u32>().map_err(|_| wrong(expected()))?))
            }
        };
        let Some(place) = self.places.iter().find(|place| place.name == name) else {
            let names: Vec<&str> = self.places.iter().map(|place| place.name.as_str()).collect();
            return Err(wrong(match names.is_empty() {
                true => "a [[place]], [[tray]] or [[bin]] in the workcell file".to_owned(),
                false => format!("one of {}", names.join(", ")),
            }));
        };
        let num = place.num_cells();
        match cell.or((num == 1).then_some(1)) {
            Some(cell) if (1..=num).contains(&cell) => place.goal(cell),
            _ if num == 1 => Err(wrong(format!("{name}, which has no cells"))),
            _ => Err(wrong(format!("{name}:1 to {name}:{num}, a cell of the tray"))),
        }
    }

    /// Joint angles of the first look-out pose that is given by joint angles.
    pub fn home(&self) -> Option<JointVector> {
        self.look_outs.iter().find_map(|look_out| match look_out {
            LookOut::Joints(q) => Some(*q),
            LookOut::CameraAt { .. } => None,
        })
    }
}

#[cfg(test)]
mod tests;
