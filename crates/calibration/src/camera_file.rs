//! The camera's file: `camera_info` as ROS's `camera_calibration` writes it, and beside it where the camera is.
//!
//! ```yaml
//! image_width: 640
//! image_height: 480
//! camera_name: wrist
//! camera_matrix: {rows: 3, cols: 3, data: [612.3, 0, 318.7, 0, 609.8, 244.1, 0, 0, 1]}
//! distortion_model: plumb_bob
//! distortion_coefficients: {rows: 1, cols: 5, data: [-0.28, 0.11, 0.0013, -0.0007, -0.02]}
//! table:                       # ours; ROS's readers pass over it
//!   frame: base                # or: table
//!   height_m: 0.0              # the table's z in that frame
//!   frame_from_camera:
//!     translation_m: [0.5, 0.0, 0.58]
//!     rotation_xyzw: [1.0, 0.0, 0.0, 0.0]
//!   workspace_m: {x: [0.3, 0.7], y: [-0.3, 0.3]}   # may be left out
//! ```

use std::fmt::Write;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use sdg_geometry::{PinholeCamera, PlumbBob, PosedCamera, Workspace};
use serde::{Deserialize, Serialize};

use crate::error::CameraFileError;

/// What poses are given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// On the table, `z` up: where a printed sheet lay.
    Table,
    /// The robot's base.
    Base,
}

impl Frame {
    /// The name, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Base => "base",
        }
    }
}

/// A camera over a table.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedCamera {
    /// The name in the file.
    pub name: String,
    /// Size, focal length, lens.
    pub intrinsics: PinholeCamera,
    /// Where it is; `None` in a file of intrinsics alone.
    pub table: Option<TablePose>,
}

/// Where a camera is.
#[derive(Debug, Clone, PartialEq)]
pub struct TablePose {
    /// What `frame_from_camera` leads to.
    pub frame: Frame,
    /// The table's z in the frame.
    pub height_m: f64,
    /// From the optical frame (x right, y down, z forward) to the frame, in metres.
    pub frame_from_camera: Isometry3<f64>,
    /// Where parts may lie; all that the camera sees where `None`.
    pub workspace: Option<Workspace>,
}

/// Metres over the table. Chosen by hand: no grasp was ever taught from farther, and a height in millimetres lies beyond.
const HEIGHTS_M: [f64; 2] = [0.05, 20.0];
/// How far a quaternion may be from length 1: files round.
const MAX_QUATERNION_ERROR: f64 = 1e-3;

#[derive(Deserialize)]
struct File {
    image_width: u32,
    image_height: u32,
    #[serde(default)]
    camera_name: String,
    camera_matrix: Matrix,
    distortion_model: String,
    distortion_coefficients: Matrix,
    #[serde(default)]
    table: Option<Table>,
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
    /// Reads a camera's file.
    ///
    /// # Errors
    /// Anything but a `camera_info` of a `plumb_bob` lens, and a pose that no camera over a table has.
    pub fn from_yaml(text: &str) -> Result<Self, CameraFileError> {
        let file: File = serde_saphyr::from_str(text).map_err(|error| {
            // The lines below it show the place in the file once more.
            let said = error.to_string();
            let first = said.lines().next().unwrap_or_default();
            CameraFileError::Unreadable { found: first.trim_start_matches("error: ").to_owned() }
        })?;
        Ok(Self {
            intrinsics: intrinsics(&file)?,
            table: file.table.map(TablePose::read).transpose()?,
            name: file.camera_name,
        })
    }

    /// The file, which [`Self::from_yaml`] reads to the same values.
    pub fn to_yaml(&self) -> String {
        let PinholeCamera { width, height, fx, fy, cx, cy, lens } = self.intrinsics;
        let (cx, cy) = (cx - 0.5, cy - 0.5);
        let coefficients = lens.to_array();
        let mut text = format!(
            "image_width: {width}\nimage_height: {height}\ncamera_name: {:?}\n\
             camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{fx:?}, 0.0, {cx:?}, 0.0, {fy:?}, {cy:?}, 0.0, 0.0, 1.0]\n\
             distortion_model: plumb_bob\n\
             distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: {coefficients:?}\n\
             rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n\
             projection_matrix:\n  rows: 3\n  cols: 4\n  \
             data: [{fx:?}, 0.0, {cx:?}, 0.0, 0.0, {fy:?}, {cy:?}, 0.0, 0.0, 0.0, 1.0, 0.0]\n",
            self.name
        );
        if let Some(table) = &self.table {
            table.write(&mut text);
        }
        text
    }

    /// The camera in its frame, and where the table is.
    ///
    /// # Errors
    /// [`CameraFileError::NoPose`] where that was not measured.
    pub fn posed(&self) -> Result<(PosedCamera, &TablePose), CameraFileError> {
        let table = self.table.as_ref().ok_or(CameraFileError::NoPose)?;
        Ok((PosedCamera { intrinsics: self.intrinsics, world_from_camera: table.frame_from_camera }, table))
    }

    /// Whether a picture can be this camera's.
    ///
    /// # Errors
    /// [`CameraFileError::OtherSize`] where it has other dimensions.
    pub fn check_picture(&self, (found_width, found_height): (u32, u32)) -> Result<(), CameraFileError> {
        let PinholeCamera { width, height, .. } = self.intrinsics;
        if (width, height) == (found_width, found_height) {
            return Ok(());
        }
        Err(CameraFileError::OtherSize { width, height, found_width, found_height })
    }
}

fn intrinsics(file: &File) -> Result<PinholeCamera, CameraFileError> {
    let coefficients = &file.distortion_coefficients.data;
    let lens = match (file.distortion_model.as_str(), coefficients.len()) {
        ("plumb_bob", 4 | 5) => {
            let mut five = [0.0; 5];
            five[..coefficients.len()].copy_from_slice(coefficients);
            PlumbBob::from_array(five)
        }
        (found, coefficients) => return Err(CameraFileError::Lens { found: found.to_owned(), coefficients }),
    };
    let (width, height) = (file.image_width, file.image_height);
    let refused = || CameraFileError::Matrix { found: file.camera_matrix.data.clone(), width, height };
    let &[fx, skew, cx, zero, fy, cy, p, q, one] = &file.camera_matrix.data[..] else { return Err(refused()) };
    let is_in_picture = |center: f64, side: u32| (0.0..f64::from(side)).contains(&center);
    let is_one = [skew, zero, p, q] == [0.0; 4] && one == 1.0 && is_in_picture(cx, width) && is_in_picture(cy, height);
    let camera = PinholeCamera { width, height, fx, fy, cx: cx + 0.5, cy: cy + 0.5, lens };
    camera.checked().ok().filter(|_| is_one).ok_or_else(refused)
}

impl TablePose {
    fn read(file: Table) -> Result<Self, CameraFileError> {
        let Pose { translation_m, rotation_xyzw } = file.frame_from_camera;
        let &[x, y, z] = &translation_m[..] else {
            return Err(pose_error("translation_m", "three numbers", &translation_m));
        };
        let &[i, j, k, w] = &rotation_xyzw[..] else {
            return Err(pose_error("rotation_xyzw", "four numbers", &rotation_xyzw));
        };
        if ![x, y, z].iter().all(|value| value.is_finite()) {
            return Err(pose_error("translation_m", "finite", &translation_m));
        }
        let rotation = Quaternion::new(w, i, j, k);
        let has_unit_length = (rotation.norm() - 1.0).abs() <= MAX_QUATERNION_ERROR;
        if !has_unit_length {
            return Err(pose_error("rotation_xyzw", "a quaternion of length 1", &rotation_xyzw));
        }
        let height = z - file.height_m;
        if !(HEIGHTS_M[0]..=HEIGHTS_M[1]).contains(&height) {
            let hint = if height > HEIGHTS_M[1] { ": millimetres given as metres?" } else { "" };
            return Err(CameraFileError::Height { height, hint });
        }
        let workspace = file.workspace_m.map(|Ranges { x, y }| Workspace { x_m: x, y_m: y });
        if let Some(Workspace { x_m: x, y_m: y }) = workspace
            && !(x[0] < x[1] && y[0] < y[1])
        {
            return Err(CameraFileError::Workspace { x, y });
        }
        Ok(Self {
            frame: file.frame,
            height_m: file.height_m,
            frame_from_camera: Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::from_quaternion(rotation),
            ),
            workspace,
        })
    }

    fn write(&self, text: &mut String) {
        let Isometry3 { rotation, translation } = self.frame_from_camera;
        let [x, y, z]: [f64; 3] = translation.vector.into();
        let [i, j, k, w]: [f64; 4] = rotation.coords.into();
        let frame = self.frame.name();
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "table:\n  frame: {frame}\n  height_m: {:?}\n  frame_from_camera:\n    translation_m: [{x:?}, {y:?}, {z:?}]\n    \
             rotation_xyzw: [{i:?}, {j:?}, {k:?}, {w:?}]\n",
            self.height_m
        );
        if let Some(Workspace { x_m, y_m }) = self.workspace {
            let _ = writeln!(text, "  workspace_m: {{x: {x_m:?}, y: {y_m:?}}}");
        }
    }
}

fn pose_error(name: &'static str, expected: &'static str, found: &[f64]) -> CameraFileError {
    CameraFileError::Pose { name, expected, found: found.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `ros2 run camera_calibration cameracalibrator` saves it.
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
        assert!(matches!(with("438.783367", "-438.8"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("438.783367, 0.000000", "438.783367, 0.5"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("305.593336", "1305.6"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("305.593336", ".nan"), CameraFileError::Matrix { .. }));
        assert!(matches!(with("[1, 0, 0, 0]}", "[1, 1, 0, 0]}"), CameraFileError::Pose { .. }));
        assert!(matches!(with("[1, 0, 0, 0]}", "[1, 0, 0]}"), CameraFileError::Pose { .. }));
        let metres = with("0.58]", "580]").to_string();
        assert!(metres.contains("579.99 m: millimetres given as metres?"), "{metres}");
        assert!(matches!(with("0.58]", "-0.58]"), CameraFileError::Height { hint: "", .. }));
        assert!(matches!(with("[0.3, 0.7]", "[0.7, 0.3]"), CameraFileError::Workspace { .. }));
    }
}
