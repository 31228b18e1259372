//! The layout of a workcell file, and the checks of its values.

use nalgebra::Vector3;
use sdg_geometry::Mount;
use sdg_kinematics::{JointLimits, JointVector, NUM_JOINTS};
use serde::Deserialize;
use toml::Spanned;

use super::error::WorkcellError;
use super::obstacle::{ObstacleSection, obstacles};
use super::place_sections::{BinSection, PlaceSection, Room, TraySection, places};
use super::source::{MAX_REACH_MM, METRES, Numbers, Source};
use super::{RobotModel, Workcell};
use crate::robot_address::RobotAddress;
use crate::safety::WorkspaceBox;
use crate::sequence::LookOut;

/// Value of `format` in files of this layout.
const FORMAT: i64 = 1;
/// Largest distance of a table from the base's height, mm.
const MAX_TABLE_MM: f64 = 1000.0;
/// Largest length of a finger beyond the tcp, mm.
const MAX_FINGERTIP_MM: f64 = 100.0;
/// Smallest length of a finger beyond the tcp other than 0, mm: a smaller one is probably in metres.
const MIN_FINGERTIP_MM: f64 = 0.1;
/// Largest force that the hand can hold permanently, N.
const MAX_FORCE_N: f64 = 70.0;
/// Default extent of a part from its grasp, mm.
const PART_RADIUS_MM: f64 = 60.0;
/// Largest extent of a part from its grasp, mm.
const MAX_PART_MM: f64 = 500.0;
/// Payload of a Panda, kg.
const MAX_LOAD_KG: f64 = 3.0;
/// Smallest and largest height of a camera above the table, mm.
const CAMERA_HEIGHTS_MM: [f64; 2] = [150.0, 1200.0];
/// Distance of Franka's own finger tips beyond its tcp, mm.
const FINGERTIP_MM: f64 = 9.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: Spanned<i64>,
    robot: Robot,
    #[serde(default)]
    tool: Tool,
    camera: Camera,
    table: Table,
    workspace: Workspace,
    look_out: Spanned<Vec<Spanned<LookOutSection>>>,
    #[serde(default)]
    obstacle: Vec<Spanned<ObstacleSection>>,
    #[serde(default)]
    place: Vec<Spanned<PlaceSection>>,
    #[serde(default)]
    tray: Vec<Spanned<TraySection>>,
    #[serde(default)]
    bin: Vec<Spanned<BinSection>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Robot {
    model: Spanned<String>,
    address: Option<Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct Tool {
    fingertip_beyond_tcp_mm: Option<Spanned<f64>>,
    grasp_force_n: Option<Spanned<f64>>,
    part_mass_kg: Option<Spanned<f64>>,
    part_radius_mm: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    file: Option<Spanned<String>>,
    mounting: Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    height_mm: Spanned<f64>,
    x_mm: Option<Spanned<Numbers<2>>>,
    y_mm: Option<Spanned<Numbers<2>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Workspace {
    x_mm: Spanned<Numbers<2>>,
    y_mm: Spanned<Numbers<2>>,
    z_mm: Spanned<Numbers<2>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LookOutSection {
    camera_at_mm: Option<Spanned<Numbers<3>>>,
    yaw_deg: Option<Spanned<f64>>,
    joints_deg: Option<Spanned<Numbers<NUM_JOINTS>>>,
}

impl Workcell {
    /// Reads a workcell file.
    ///
    /// # Errors
    /// [`WorkcellError`] with the line and the cause.
    pub fn from_toml(text: &str) -> Result<Self, WorkcellError> {
        read(text)
    }
}

fn read(text: &str) -> Result<Workcell, WorkcellError> {
    let source = Source(text);
    let file: File = toml::from_str(text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        // The parser's message spans several lines.
        source.error(at, error.message().split_whitespace().collect::<Vec<_>>().join(" "))
    })?;
    if *file.format.get_ref() != FORMAT {
        return Err(source.expected(&file.format, "format", &FORMAT.to_string(), file.format.get_ref()));
    }
    let robot = match file.robot.model.get_ref().as_str() {
        "panda" => RobotModel::Panda,
        "fr3" => RobotModel::Fr3,
        other => {
            return Err(source.expected(&file.robot.model, "model", "\"panda\" or \"fr3\"", format!("\"{other}\"")));
        }
    };
    if let Some(address) = &file.robot.address
        && let Err(why) = address.get_ref().parse::<RobotAddress>()
    {
        return Err(source.error(address.span().start, format!("address: {why}")));
    }
    let mount = match file.camera.mounting.get_ref().as_str() {
        "hand" => Mount::Hand,
        "base" => Mount::Base,
        other => {
            return Err(source.expected(
                &file.camera.mounting,
                "mounting",
                "\"hand\" or \"base\"",
                format!("\"{other}\""),
            ));
        }
    };
    let option = |value: &Option<Spanned<f64>>, name: &str, range: [f64; 2]| {
        value.as_ref().map(|value| source.number(value, name, range)).transpose()
    };
    let tool = &file.tool;
    let fingertip_mm = option(&tool.fingertip_beyond_tcp_mm, "fingertip_beyond_tcp_mm", [0.0, MAX_FINGERTIP_MM])?;
    if let (Some(value), Some(found)) = (&tool.fingertip_beyond_tcp_mm, fingertip_mm)
        && (f64::MIN_POSITIVE..MIN_FINGERTIP_MM).contains(&found)
    {
        let expected = format!("0, or a number from {MIN_FINGERTIP_MM} to {MAX_FINGERTIP_MM}");
        return Err(source.expected(value, "fingertip_beyond_tcp_mm", &expected, format!("{found}{METRES}")));
    }
    let [x, y, z] = [
        source.range_m(&file.workspace.x_mm, "x_mm")?,
        source.range_m(&file.workspace.y_mm, "y_mm")?,
        source.range_m(&file.workspace.z_mm, "z_mm")?,
    ];
    let look_outs = file.look_out.get_ref();
    if look_outs.is_empty() {
        return Err(source.expected(&file.look_out, "look_out", "at least one", "none"));
    }
    let table_height_m = source.length_mm(&file.table.height_mm, "height_mm", [-MAX_TABLE_MM, MAX_TABLE_MM])? * 1e-3;
    let table_m = match (&file.table.x_mm, &file.table.y_mm) {
        (None, None) => None,
        (Some(x), Some(y)) => Some([source.range_m(x, "x_mm")?, source.range_m(y, "y_mm")?]),
        (Some(one), None) | (None, Some(one)) => {
            return Err(source.error(one.span().start, "table: expected x_mm and y_mm, or neither"));
        }
    };
    let workspace = WorkspaceBox { min_m: Vector3::new(x[0], y[0], z[0]), max_m: Vector3::new(x[1], y[1], z[1]) };
    let room = Room { table_height_m, table_m, workspace: &workspace };
    let places = places(&source, &file.place, &file.tray, &file.bin, &room)?;
    let limits = robot.geometry().limits;
    Ok(Workcell {
        robot,
        address: file.robot.address.map(Spanned::into_inner),
        fingertip_beyond_tcp_m: fingertip_mm.unwrap_or(FINGERTIP_MM) * 1e-3,
        grasp_force_n: option(&tool.grasp_force_n, "grasp_force_n", [1.0, MAX_FORCE_N])?.unwrap_or(40.0),
        part_mass_kg: option(&tool.part_mass_kg, "part_mass_kg", [0.0, MAX_LOAD_KG])?,
        part_radius_m: option(&tool.part_radius_mm, "part_radius_mm", [1.0, MAX_PART_MM])?.unwrap_or(PART_RADIUS_MM)
            * 1e-3,
        camera_file: file.camera.file.map(Spanned::into_inner),
        mount,
        table_height_m,
        table_m,
        workspace,
        places,
        obstacles: obstacles(&source, &file.obstacle)?,
        look_outs: look_outs
            .iter()
            .map(|section| look_out(&source, section, mount, &limits))
            .collect::<Result<_, _>>()?,
    })
}

fn look_out(
    source: &Source<'_>,
    section: &Spanned<LookOutSection>,
    mount: Mount,
    limits: &JointLimits,
) -> Result<LookOut, WorkcellError> {
    let LookOutSection { camera_at_mm, yaw_deg, joints_deg } = section.get_ref();
    match (camera_at_mm, joints_deg) {
        (Some(at), None) if mount == Mount::Hand => {
            let Numbers([x, y, height]) = *at.get_ref();
            if ![x, y].iter().all(|value| value.abs() <= MAX_REACH_MM) {
                let expected = format!("x and y within {MAX_REACH_MM} mm of the base");
                return Err(source.expected(at, "camera_at_mm", &expected, format!("[{x}, {y}, {height}]")));
            }
            let [min, max] = CAMERA_HEIGHTS_MM;
            if !(min..=max).contains(&height) {
                let expected = format!("a height from {min} to {max} mm above the table");
                return Err(source.expected(at, "camera_at_mm", &expected, height));
            }
            let yaw_deg = yaw_deg.as_ref().map(|yaw| source.number(yaw, "yaw_deg", [-360.0, 360.0])).transpose()?;
            Ok(LookOut::CameraAt {
                at_m: [x * 1e-3, y * 1e-3],
                height_m: height * 1e-3,
                yaw_rad: yaw_deg.unwrap_or(0.0).to_radians(),
            })
        }
        (None, Some(joints)) => {
            if let Some(yaw) = yaw_deg {
                return Err(source.error(yaw.span().start, "yaw_deg: expected with camera_at_mm only"));
            }
            let q = JointVector::from(joints.get_ref().0.map(f64::to_radians));
            match limits.worst_violation(&q, 0.0) {
                None if q.iter().all(|value| value.is_finite()) => Ok(LookOut::Joints(q)),
                None => Err(source.expected(
                    joints,
                    "joints_deg",
                    "seven finite numbers",
                    format!("{:?}", joints.get_ref().0),
                )),
                Some(violation) => {
                    let [min, max] = [violation.min_rad, violation.max_rad].map(f64::to_degrees);
                    let expected = format!("joint {} from {min:.1} to {max:.1} degrees", violation.joint);
                    let hint = match limits.are_radians_given_as_degrees(&q) {
                        true => ": radians given as degrees?",
                        false => "",
                    };
                    let found = format!("{:.1}{hint}", violation.found_rad.to_degrees());
                    Err(source.expected(joints, "joints_deg", &expected, found))
                }
            }
        }
        (Some(at), None) => {
            let why =
                "camera_at_mm: expected joints_deg, since a camera that is mounted on the base is not moved by the arm";
            Err(source.error(at.span().start, why))
        }
        (None, None) => {
            Err(source.error(section.span().start, "look_out: expected camera_at_mm or joints_deg, found neither"))
        }
        (Some(_), Some(joints)) => {
            Err(source.error(joints.span().start, "look_out: expected camera_at_mm or joints_deg, found both"))
        }
    }
}
