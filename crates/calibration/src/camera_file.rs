//! The camera file: `camera_info` in the form of ROS's `camera_calibration`, with the camera's pose.
//!
//! ```yaml
//! image_width: 640
//! image_height: 480
//! camera_name: wrist
//! camera_matrix: {rows: 3, cols: 3, data: [612.3, 0, 318.7, 0, 609.8, 244.1, 0, 0, 1]}
//! distortion_model: plumb_bob
//! distortion_coefficients: {rows: 1, cols: 5, data: [-0.28, 0.11, 0.0013, -0.0007, -0.02]}
//! table:                       # ours; ROS ignores it
//!   frame: base                # or: table
//!   height_m: 0.0              # the table's z in that frame
//!   frame_from_camera:
//!     translation_m: [0.5, 0.0, 0.58]
//!     rotation_xyzw: [1.0, 0.0, 0.0, 0.0]
//!   workspace_m: {x: [0.3, 0.7], y: [-0.3, 0.3]}   # may be left out
//! hand_eye:                    # ours; the camera's pose on the robot's hand
//!   flange_from_camera: {translation_m: [0.05, 0.0, 0.06], rotation_xyzw: [0.0, 0.0, 0.0, 1.0]}
//! ```

use nalgebra::{Isometry3, Point2, Quaternion, Translation3, UnitQuaternion};
use sdg_geometry::{PinholeCamera, PlumbBob, PosedCamera, Workspace};
use serde::{Deserialize, Serialize};

use crate::camera_sections::merged;
use crate::error::CameraFileError;

/// Frame of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// On the table, `z` up: the frame of a printed sheet.
    Table,
    /// The robot's base frame.
    Base,
}

impl Frame {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Base => "base",
        }
    }
}

/// A calibrated camera, above a table or on the robot's hand.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedCamera {
    /// The name in the file.
    pub name: String,
    /// Size, focal length, lens.
    pub intrinsics: PinholeCamera,
    /// The camera's pose above the table; `None` if the file has no `table:`.
    pub table: Option<TablePose>,
    /// For a camera on the hand: the transform from the optical frame to the robot's flange, in metres.
    pub flange_from_camera: Option<Isometry3<f64>>,
}

/// A camera's pose and the table below it.
#[derive(Debug, Clone, PartialEq)]
pub struct TablePose {
    /// The target frame of `frame_from_camera`.
    pub frame: Frame,
    /// The table's z in `frame`, in metres.
    pub height_m: f64,
    /// Transform from the optical frame (x right, y down, z forward) to `frame`, in metres.
    pub frame_from_camera: Isometry3<f64>,
    /// The region in which parts may lie; `None` for all that the camera sees.
    pub workspace: Option<Workspace>,
}

/// Range of the camera's height above the table, in metres. Chosen by hand: no grasp was taught from a greater
/// distance, and a height given in millimetres is out of range.
const HEIGHTS_M: [f64; 2] = [0.05, 20.0];
/// Largest absolute x and y of camera and workspace in the frame, in metres: larger than robot cells, and smaller than
/// usual positions given in millimetres.
const MAX_ASIDE_M: f64 = 50.0;
/// Tolerance of a quaternion's length, for rounding in files.
const MAX_QUATERNION_ERROR: f64 = 1e-3;

/// The written sections, in this order.
const SECTIONS: [&str; 10] = [
    "image_width",
    "image_height",
    "camera_name",
    "camera_matrix",
    "distortion_model",
    "distortion_coefficients",
    "rectification_matrix",
    "projection_matrix",
    "table",
    "hand_eye",
];
/// The sections that another program computed from the intrinsics, and for a stereo camera from the other camera.
const OF_RECTIFICATION: [&str; 2] = ["rectification_matrix", "projection_matrix"];
/// Largest distance of a camera from the flange, in metres.
const MAX_ON_HAND_M: f64 = 2.0;

#[derive(Deserialize)]
struct File {
    image_width: u32,
    image_height: u32,
    #[serde(default)]
    camera_name: String,
    /// Name of the projection in files of Kalibr and other programs.
    #[serde(default)]
    camera_model: Option<String>,
    #[serde(default)]
    lens_model: Option<String>,
    #[serde(default)]
    projection_model: Option<String>,
    /// The mirror parameter of an omnidirectional camera.
    #[serde(default)]
    xi: Option<f64>,
    #[serde(default)]
    fisheye: Option<bool>,
    camera_matrix: Matrix,
    distortion_model: String,
    distortion_coefficients: Matrix,
    #[serde(default)]
    table: Option<Table>,
    #[serde(default)]
    hand_eye: Option<HandEyeSection>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HandEyeSection {
    flange_from_camera: Pose,
}

#[derive(Deserialize)]
struct Matrix {
    data: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    frame: Frame,
    #[serde(default)]
    height_m: f64,
    frame_from_camera: Pose,
    #[serde(default)]
    workspace_m: Option<Ranges>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    translation_m: Vec<f64>,
    rotation_xyzw: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ranges {
    x: [f64; 2],
    y: [f64; 2],
}

impl CalibratedCamera {
    /// Reads a camera file.
    ///
    /// # Errors
    /// The file is not a `camera_info` with a `plumb_bob` lens, the camera matrix is invalid, the lens folds the
    /// picture, or a pose or the workspace is impossible.
    pub fn from_yaml(text: &str) -> Result<Self, CameraFileError> {
        let file: File = serde_saphyr::from_str(text).map_err(|error| {
            // Only the first line: the further ones repeat the position in the file.
            let message = error.to_string();
            let first = message.lines().next().unwrap_or_default();
            CameraFileError::Unreadable { found: first.trim_start_matches("error: ").to_owned() }
        })?;
        Ok(Self {
            intrinsics: intrinsics(&file)?,
            table: file.table.map(TablePose::read).transpose()?,
            flange_from_camera: file.hand_eye.map(|section| on_hand(&section.flange_from_camera)).transpose()?,
            name: file.camera_name,
        })
    }

    /// Writes the file; [`Self::from_yaml`] reads the same values from it.
    pub fn to_yaml(&self) -> String {
        self.sections().into_iter().map(|(_, section)| section).collect()
    }

    /// Returns the text of an existing file with this camera's values. Data of other programs and comments are kept,
    /// and with equal intrinsics also the matrices of rectification and projection.
    ///
    /// # Errors
    /// The errors of [`Self::from_yaml`] if this camera is impossible; [`CameraFileError::NotUpdatable`] if the file
    /// does not have ROS's layout.
    pub fn update_yaml(&self, existing: &str) -> Result<String, CameraFileError> {
        // An impossible value is no fault of the existing file.
        Self::from_yaml(&self.to_yaml())?;
        let is_recalibrated = !Self::from_yaml(existing).is_ok_and(|old| old.intrinsics == self.intrinsics);
        let is_ours = |name: &str| is_recalibrated || !OF_RECTIFICATION.contains(&name);
        let known: Vec<&str> = SECTIONS.into_iter().filter(|&name| is_ours(name)).collect();
        let sections: Vec<_> = self.sections().into_iter().filter(|&(name, _)| is_ours(name)).collect();
        let updated = merged(existing, &known, &sections);
        match Self::from_yaml(&updated) {
            Ok(read) if read.is_near(self) => Ok(updated),
            _ => Err(CameraFileError::NotUpdatable),
        }
    }

    /// Whether both are equal except for small differences of the poses, whose quaternions are normalised on reading.
    fn is_near(&self, other: &Self) -> bool {
        let poses =
            |camera: &Self| [camera.table.as_ref().map(|table| table.frame_from_camera), camera.flange_from_camera];
        let is_near = |(a, b): (Option<Isometry3<f64>>, Option<Isometry3<f64>>)| match (a, b) {
            (Some(a), Some(b)) => (a.to_homogeneous() - b.to_homogeneous()).norm() < MAX_QUATERNION_ERROR,
            (a, b) => a == b,
        };
        let without_poses = |camera: &Self| {
            let mut camera = Self { flange_from_camera: None, ..camera.clone() };
            if let Some(table) = &mut camera.table {
                table.frame_from_camera = Isometry3::identity();
            }
            camera
        };
        without_poses(self) == without_poses(other) && poses(self).into_iter().zip(poses(other)).all(is_near)
    }

    fn sections(&self) -> Vec<(&'static str, String)> {
        let PinholeCamera { width, height, fx, fy, cx, cy, lens } = self.intrinsics;
        let (cx, cy) = (cx - 0.5, cy - 0.5);
        let matrix = |name: &str, rows: u32, columns: u32, data: &[f64]| {
            format!("{name}:\n  rows: {rows}\n  cols: {columns}\n  data: {data:?}\n")
        };
        let unit = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let projection = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
        let texts = [
            Some(format!("image_width: {width}\n")),
            Some(format!("image_height: {height}\n")),
            Some(format!("camera_name: {:?}\n", self.name)),
            Some(matrix("camera_matrix", 3, 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])),
            Some("distortion_model: plumb_bob\n".to_owned()),
            Some(matrix("distortion_coefficients", 1, 5, &lens.to_array())),
            Some(matrix("rectification_matrix", 3, 3, &unit)),
            Some(matrix("projection_matrix", 3, 4, &projection)),
            self.table.as_ref().map(TablePose::to_yaml),
            self.flange_from_camera
                .as_ref()
                .map(|pose| format!("hand_eye:\n  flange_from_camera:\n{}", pose_yaml(pose))),
        ];
        SECTIONS.into_iter().zip(texts).filter_map(|(name, text)| Some((name, text?))).collect()
    }

    /// The camera with its pose in the frame [`TablePose::frame`], and that [`TablePose`].
    ///
    /// # Errors
    /// [`CameraFileError::NoPose`] if the file has no `table:`.
    pub fn posed(&self) -> Result<(PosedCamera, &TablePose), CameraFileError> {
        let table = self.table.as_ref().ok_or(CameraFileError::NoPose)?;
        Ok((PosedCamera { intrinsics: self.intrinsics, world_from_camera: table.frame_from_camera }, table))
    }

    /// Checks that a picture can be from this camera.
    ///
    /// # Errors
    /// [`CameraFileError::OtherSize`] if its dimensions are different.
    pub fn check_picture(&self, (found_width, found_height): (u32, u32)) -> Result<(), CameraFileError> {
        let PinholeCamera { width, height, .. } = self.intrinsics;
        if (width, height) == (found_width, found_height) {
            return Ok(());
        }
        Err(CameraFileError::OtherSize { width, height, found_width, found_height })
    }
}

/// Accepted values of the fields `camera_model`, `lens_model` and `projection_model`.
const PINHOLE_NAMES: [&str; 6] = ["pinhole", "perspective", "plumb_bob", "radtan", "brown", "opencv"];
/// Number of intervals along each side of the picture between the points at which the lens is checked.
const TRIED_A_SIDE: u32 = 16;

/// Rejects a file in which another field than `distortion_model` names a camera that is not a pinhole.
fn check_model(file: &File) -> Result<(), CameraFileError> {
    let other = |key, found: &dyn std::fmt::Display| Err(CameraFileError::OtherModel { key, found: found.to_string() });
    let named = [
        ("camera_model", &file.camera_model),
        ("lens_model", &file.lens_model),
        ("projection_model", &file.projection_model),
    ];
    for (key, name) in named {
        if let Some(name) = name.as_ref().filter(|name| !PINHOLE_NAMES.contains(&name.to_lowercase().as_str())) {
            return other(key, name);
        }
    }
    match (file.xi, file.fisheye) {
        (Some(xi), _) if xi != 0.0 => other("xi", &xi),
        (_, Some(true)) => other("fisheye", &true),
        _ => Ok(()),
    }
}

/// Rejects a lens that shows two points or none at a pixel of the picture. Checked at the border.
fn check_does_not_fold(camera: &PinholeCamera) -> Result<(), CameraFileError> {
    let [width, height] = [camera.width, camera.height].map(f64::from);
    let border = (0..=TRIED_A_SIDE).map(|step| f64::from(step) / f64::from(TRIED_A_SIDE)).flat_map(|share| {
        [(share * width, 0.0), (share * width, height), (0.0, share * height), (width, share * height)]
    });
    for (x, y) in border {
        let seen = camera.unproject(&Point2::new(x, y)).map(|point| point.xy());
        if !seen.is_some_and(|point| camera.lens.jacobian(&point).determinant() > 0.0) {
            return Err(CameraFileError::Folds { found: camera.lens.to_array().to_vec(), x, y });
        }
    }
    Ok(())
}

fn intrinsics(file: &File) -> Result<PinholeCamera, CameraFileError> {
    check_model(file)?;
    let coefficients = &file.distortion_coefficients.data;
    let lens = match (file.distortion_model.as_str(), coefficients.len()) {
        ("plumb_bob", 4 | 5) => {
            let mut five = [0.0; 5];
            five[..coefficients.len()].copy_from_slice(coefficients);
            PlumbBob::from_array(five)
        }
        (found, coefficients) => return Err(CameraFileError::Lens { found: found.to_owned(), coefficients }),
    };
    if !coefficients.iter().all(|value| value.is_finite()) {
        return Err(CameraFileError::Coefficients { found: coefficients.clone() });
    }
    let (width, height) = (file.image_width, file.image_height);
    let refused = || CameraFileError::Matrix { found: file.camera_matrix.data.clone(), width, height };
    let &[fx, skew, cx, zero, fy, cy, p, q, one] = &file.camera_matrix.data[..] else { return Err(refused()) };
    let is_in_picture = |center: f64, side: u32| (0.0..f64::from(side)).contains(&center);
    let is_one = [skew, zero, p, q] == [0.0; 4] && one == 1.0 && is_in_picture(cx, width) && is_in_picture(cy, height);
    let camera = PinholeCamera { width, height, fx, fy, cx: cx + 0.5, cy: cy + 0.5, lens };
    let camera = camera.checked().ok().filter(|_| is_one).ok_or_else(refused)?;
    check_does_not_fold(&camera)?;
    Ok(camera)
}

impl TablePose {
    fn read(file: Table) -> Result<Self, CameraFileError> {
        let frame_from_camera = read_pose(&file.frame_from_camera, "table.frame_from_camera")?;
        let [x, y, z]: [f64; 3] = frame_from_camera.translation.vector.into();
        let is_far = |values: &[f64]| values.iter().any(|value| value.abs() > MAX_ASIDE_M);
        if is_far(&[x, y]) {
            let expected = "within 50 m of the frame's origin (millimetres given as metres?)";
            let name = "table.frame_from_camera.translation_m";
            return Err(pose_error(name, expected, &file.frame_from_camera.translation_m));
        }
        let height = z - file.height_m;
        if !(HEIGHTS_M[0]..=HEIGHTS_M[1]).contains(&height) {
            let hint = if height.abs() > HEIGHTS_M[1] { ": millimetres given as metres?" } else { "" };
            return Err(CameraFileError::Height { height, hint });
        }
        let workspace = file.workspace_m.map(|Ranges { x, y }| Workspace { x_m: x, y_m: y });
        if let Some(Workspace { x_m: x, y_m: y }) = workspace
            && !(x[0] < x[1] && y[0] < y[1])
        {
            return Err(CameraFileError::Workspace { x, y });
        }
        if let Some(Workspace { x_m: [a, b], y_m: [c, d] }) = workspace
            && is_far(&[a, b, c, d])
        {
            let expected = "within 50 m of the frame's origin (millimetres given as metres?)";
            return Err(pose_error("table.workspace_m", expected, &[a, b, c, d]));
        }
        Ok(Self { frame: file.frame, height_m: file.height_m, frame_from_camera, workspace })
    }

    fn to_yaml(&self) -> String {
        let (frame, height, pose) = (self.frame.name(), self.height_m, pose_yaml(&self.frame_from_camera));
        let workspace = match self.workspace {
            Some(Workspace { x_m, y_m }) => format!("  workspace_m: {{x: {x_m:?}, y: {y_m:?}}}\n"),
            None => String::new(),
        };
        format!("table:\n  frame: {frame}\n  height_m: {height:?}\n  frame_from_camera:\n{pose}{workspace}")
    }
}

fn pose_yaml(pose: &Isometry3<f64>) -> String {
    let [x, y, z]: [f64; 3] = pose.translation.vector.into();
    let [i, j, k, w]: [f64; 4] = pose.rotation.coords.into();
    format!("    translation_m: [{x:?}, {y:?}, {z:?}]\n    rotation_xyzw: [{i:?}, {j:?}, {k:?}, {w:?}]\n")
}

fn on_hand(pose: &Pose) -> Result<Isometry3<f64>, CameraFileError> {
    let read = read_pose(pose, "hand_eye.flange_from_camera")?;
    if read.translation.vector.norm() > MAX_ON_HAND_M {
        let expected = "within 2 m of the flange (millimetres given as metres?)";
        return Err(pose_error("hand_eye.flange_from_camera.translation_m", expected, &pose.translation_m));
    }
    Ok(read)
}

fn read_pose(pose: &Pose, name: &str) -> Result<Isometry3<f64>, CameraFileError> {
    let Pose { translation_m, rotation_xyzw } = pose;
    let translation = |expected| pose_error(&format!("{name}.translation_m"), expected, translation_m);
    let rotation = |expected| pose_error(&format!("{name}.rotation_xyzw"), expected, rotation_xyzw);
    let &[x, y, z] = &translation_m[..] else { return Err(translation("three numbers")) };
    let &[i, j, k, w] = &rotation_xyzw[..] else { return Err(rotation("four numbers")) };
    if ![x, y, z].iter().all(|value| value.is_finite()) {
        return Err(translation("finite"));
    }
    let quaternion = Quaternion::new(w, i, j, k);
    let has_unit_length = (quaternion.norm() - 1.0).abs() <= MAX_QUATERNION_ERROR;
    if !has_unit_length {
        return Err(rotation("a quaternion of length 1"));
    }
    let unit = UnitQuaternion::from_quaternion(quaternion);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), unit))
}

fn pose_error(name: &str, expected: &'static str, found: &[f64]) -> CameraFileError {
    CameraFileError::Pose { name: name.to_owned(), expected, found: found.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file saved by `ros2 run camera_calibration cameracalibrator`.
    const OF_ROS: &str = "\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.000000, 0.000000, 1.000000]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.000000, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000, 0.000000, 0.000000, 1.000000]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.000000, 322.797939, 0.000000, 0.000000, 241.090902, 0.000000, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000]
";
    const TABLE: &str = "\
table:
  frame: base
  height_m: 0.01
  frame_from_camera: {translation_m: [0.5, 0, 0.58], rotation_xyzw: [1, 0, 0, 0]}
  workspace_m: {x: [0.3, 0.7], y: [-0.3, 0.3]}
";

    fn read(text: &str) -> Result<CalibratedCamera, CameraFileError> {
        CalibratedCamera::from_yaml(text)
    }

    #[test]
    fn a_file_of_ros_is_read_half_a_pixel_further() {
        let camera = read(OF_ROS).unwrap();
        assert_eq!((camera.intrinsics.cx, camera.intrinsics.cy), (306.093336, 244.238352));
        assert_eq!(camera.intrinsics.lens.to_array(), [-0.361976, 0.110510, 0.001014, 0.000505, 0.0]);
        assert_eq!(camera.posed(), Err(CameraFileError::NoPose));
        assert!(camera.check_picture((640, 480)).is_ok());
        assert!(matches!(camera.check_picture((1280, 960)), Err(CameraFileError::OtherSize { .. })));
    }

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let camera = read(&format!("{OF_ROS}{TABLE}")).unwrap();
        let (posed, table) = camera.posed().unwrap();
        assert_eq!((table.frame, table.height_m), (Frame::Base, 0.01));
        assert_eq!(posed.world_from_camera.translation.z, 0.58);
        let again = read(&camera.to_yaml()).unwrap();
        assert_eq!(again, camera);
        let named = CalibratedCamera { name: "a \"camera\": {with} # marks".to_owned(), table: None, ..camera };
        assert_eq!(read(&named.to_yaml()).unwrap(), named);
        let on_hand = CalibratedCamera { flange_from_camera: Some(Isometry3::translation(0.05, 0.0, 0.06)), ..named };
        assert_eq!(read(&on_hand.to_yaml()).unwrap(), on_hand);
    }

    #[test]
    fn cameras_that_differ_in_one_value_are_not_near() {
        let camera = read(&format!("{OF_ROS}{TABLE}")).unwrap();
        assert!(camera.is_near(&camera));
        let changes: [&dyn Fn(&mut CalibratedCamera); 6] = [
            &|camera| camera.name.push('2'),
            &|camera| camera.intrinsics.fx += 1.0,
            &|camera| camera.flange_from_camera = Some(Isometry3::identity()),
            &|camera| camera.table.as_mut().unwrap().height_m += 0.001,
            &|camera| camera.table.as_mut().unwrap().workspace = None,
            &|camera| camera.table.as_mut().unwrap().frame_from_camera.translation.z += 0.01,
        ];
        for (index, change) in changes.iter().enumerate() {
            let mut changed = camera.clone();
            change(&mut changed);
            assert!(!changed.is_near(&camera), "change {index}");
        }
    }

    #[test]
    fn an_existing_file_keeps_what_is_not_ours() {
        let existing = format!("# bought 2019\n{OF_ROS}serial_number: 17  # on the back\n{TABLE}");
        let mut camera = read(&existing).unwrap();
        camera.intrinsics.fx = 500.0;
        camera.table = None;
        camera.flange_from_camera = Some(Isometry3::translation(0.05, 0.0, 0.06));
        let updated = camera.update_yaml(&existing).unwrap();
        assert!(updated.starts_with("# bought 2019\n") && updated.contains("serial_number: 17  # on the back\n"));
        assert_eq!(read(&updated).unwrap(), camera);
        assert_eq!(camera.update_yaml("{a: 1}"), Err(CameraFileError::NotUpdatable));
        let mut below = read(&existing).unwrap();
        below.table.as_mut().unwrap().height_m = 5.0;
        assert!(matches!(below.update_yaml(&existing), Err(CameraFileError::Height { .. })));
    }

    #[test]
    fn a_new_pose_keeps_the_projection_and_a_new_calibration_replaces_it() {
        let posed = read(&format!("{OF_ROS}{TABLE}")).unwrap();
        let updated = posed.update_yaml(OF_ROS).unwrap();
        assert!(updated.starts_with(OF_ROS.split("camera_name").next().unwrap()) && updated.contains("393.653800"));
        assert_eq!(read(&updated).unwrap(), posed);
        let mut recalibrated = posed;
        recalibrated.intrinsics.fx = 500.0;
        assert!(!recalibrated.update_yaml(OF_ROS).unwrap().contains("393.653800"));
    }

    #[test]
    fn nonsense_is_refused_with_what_was_expected() {
        let with = |from: &str, to: &str| {
            let text = format!("{OF_ROS}{TABLE}");
            assert!(text.contains(from), "{from}");
            read(&text.replace(from, to)).unwrap_err()
        };
        assert!(matches!(read("no: camera"), Err(CameraFileError::Unreadable { .. })));
        assert!(matches!(read("[1, 2"), Err(CameraFileError::Unreadable { .. })));
        assert!(matches!(with("plumb_bob", "equidistant"), CameraFileError::Lens { coefficients: 5, .. }));
        assert!(matches!(with("0.001014, 0.000505, 0.000000", "0.1"), CameraFileError::Lens { coefficients: 3, .. }));
        for line in
            ["camera_model: fisheye", "camera_model: omni", "lens_model: Kannala-Brandt", "xi: 1.2", "fisheye: true"]
        {
            let error = with("distortion_model", &format!("{line}\ndistortion_model"));
            assert!(matches!(error, CameraFileError::OtherModel { .. }), "{line}: {error}");
        }
        for line in ["camera_model: pinhole", "camera_model: Plumb_Bob", "fisheye: false", "xi: 0"] {
            assert!(read(&format!("{line}\n{OF_ROS}")).is_ok(), "{line}");
        }
        for number in [".nan", ".inf"] {
            assert!(matches!(
                with("0.001014, 0.000505", &format!("{number}, 0.000505")),
                CameraFileError::Coefficients { .. }
            ));
        }
        // Barrel distortion so strong that the radius decreases again before the corner; a p1 that folds a border.
        for coefficients in ["[-1.5, 0, 0, 0, 0]", "[0, 0, 2.5, 0, 0]"] {
            let data = OF_ROS.split("data: ").nth(2).unwrap().lines().next().unwrap();
            let error = with(data, coefficients);
            assert!(matches!(error, CameraFileError::Folds { .. }), "{coefficients}: {error}");
        }
        assert!(matches!(with("438.783367", "-438.8"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("438.783367, 0.000000", "438.783367, 0.5"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("305.593336", "1305.6"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("305.593336", ".nan"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("[1, 0, 0, 0]}", "[1, 1, 0, 0]}"), CameraFileError::Pose { .. }));
        assert!(matches!(with("[1, 0, 0, 0]}", "[1, 0, 0]}"), CameraFileError::Pose { .. }));
        let metres = with("0.58]", "580]").to_string();
        assert!(metres.contains("579.99 m: millimetres given as metres?"), "{metres}");
        assert!(matches!(with("0.58]", "-0.58]"), CameraFileError::Height { hint: "", .. }));
        for (from, to) in [("[0.5, 0, 0.58]", "[500, 0, 0.58]"), ("{x: [0.3, 0.7]", "{x: [300, 700]")] {
            let text = with(from, to).to_string();
            assert!(text.contains("millimetres given as metres?"), "{text}");
        }
        assert!(matches!(
            read(&format!(
                "{OF_ROS}hand_eye:\n  flange_from_camera: {{translation_m: [50, 0, 60], rotation_xyzw: [0, 0, 0, 1]}}\n"
            )),
            Err(CameraFileError::Pose { .. })
        ));
        assert!(matches!(with("[0.3, 0.7]", "[0.7, 0.3]"), CameraFileError::Workspace { .. }));
    }
}
