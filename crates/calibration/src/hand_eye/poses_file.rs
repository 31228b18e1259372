//! Robot poses and the pictures taken there, as YAML, JSON or CSV.
//!
//! ```yaml
//! poses:
//!   - picture: 00.png
//!     base_from_flange: {translation_m: [0.4, 0.0, 0.5], rotation_xyzw: [1.0, 0.0, 0.0, 0.0]}
//! ```
//! JSON has the same names. CSV has the header `picture,x,y,z,qx,qy,qz,qw`, lengths in metres.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;

use crate::error::CalibrationError;

/// Where the robot was for a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotPose {
    /// The picture's file.
    pub picture: String,
    /// Pose of the flange in the base frame; lengths in metres.
    pub base_from_flange: Isometry3<f64>,
}

#[derive(Deserialize)]
struct File {
    poses: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    picture: String,
    base_from_flange: Pose,
}

#[derive(Deserialize)]
struct Pose {
    translation_m: Vec<f64>,
    rotation_xyzw: Vec<f64>,
}

/// No arm reaches as far, metres.
const MAX_REACH_M: f64 = 5.0;
/// How far a quaternion may be from length 1: files round.
const MAX_QUATERNION_ERROR: f64 = 1e-3;
const HEADER: &str = "picture,x,y,z,qx,qy,qz,qw";

/// Reads robot poses.
///
/// # Errors
/// [`CalibrationError::PosesUnreadable`]; [`CalibrationError::RobotPose`] for a pose that is none, or in millimetres.
pub fn read_robot_poses(text: &str) -> Result<Vec<RobotPose>, CalibrationError> {
    let unreadable = |found: String| CalibrationError::PosesUnreadable { found };
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let first = text.lines().next().unwrap_or_default();
    // Spreadsheets of countries with decimal commas put semicolons between the fields.
    let separator = [',', ';', '\t'].into_iter().find(|separator| {
        first.split_once(*separator).is_some_and(|(name, _)| name.trim().eq_ignore_ascii_case("picture"))
    });
    let entries = if let Some(separator) = separator {
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let header = lines.next().unwrap_or_default().replace(' ', "").replace(separator, ",").to_ascii_lowercase();
        if header != HEADER {
            return Err(unreadable(format!("the header {header} instead of {HEADER}")));
        }
        lines.map(|line| entry_of_line(line, separator)).collect::<Result<_, _>>()?
    } else {
        let file: File = serde_saphyr::from_str(text).map_err(|error| {
            let message = error.to_string();
            unreadable(message.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned())
        })?;
        file.poses
    };
    entries.into_iter().map(Entry::checked).collect()
}

fn entry_of_line(line: &str, separator: char) -> Result<Entry, CalibrationError> {
    let unreadable = || CalibrationError::PosesUnreadable { found: format!("the line {line}, expected {HEADER}") };
    let fields: Vec<&str> = line.split(separator).map(str::trim).collect();
    let numbers: Option<Vec<f64>> = fields.iter().skip(1).map(|field| field.replace(',', ".").parse().ok()).collect();
    let numbers = numbers.filter(|numbers| numbers.len() == 7).ok_or_else(unreadable)?;
    let base_from_flange = Pose { translation_m: numbers[..3].to_vec(), rotation_xyzw: numbers[3..].to_vec() };
    Ok(Entry { picture: fields[0].to_owned(), base_from_flange })
}

impl Entry {
    fn checked(self) -> Result<RobotPose, CalibrationError> {
        let Pose { translation_m, rotation_xyzw } = &self.base_from_flange;
        let refused = |name, expected, found: &Vec<f64>| CalibrationError::RobotPose {
            picture: self.picture.clone(),
            name,
            expected,
            found: found.clone(),
        };
        let &[x, y, z] = &translation_m[..] else {
            return Err(refused("translation_m", "three numbers", translation_m));
        };
        let is_near = [x, y, z].iter().all(|value: &f64| value.abs() < MAX_REACH_M);
        if !is_near {
            let expected = "within 5 m of the base (millimetres given as metres?)";
            return Err(refused("translation_m", expected, translation_m));
        }
        let &[i, j, k, w] = &rotation_xyzw[..] else {
            return Err(refused("rotation_xyzw", "four numbers", rotation_xyzw));
        };
        let rotation = Quaternion::new(w, i, j, k);
        let has_unit_length = (rotation.norm() - 1.0).abs() <= MAX_QUATERNION_ERROR;
        if !has_unit_length {
            return Err(refused("rotation_xyzw", "a quaternion of length 1", rotation_xyzw));
        }
        let rotation = UnitQuaternion::from_quaternion(rotation);
        Ok(RobotPose {
            picture: self.picture,
            base_from_flange: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YAML: &str = "\
poses:
  - picture: a.png
    base_from_flange: {translation_m: [0.4, 0, 0.5], rotation_xyzw: [1, 0, 0, 0]}
";

    #[test]
    fn yaml_json_and_csv_say_the_same() {
        let yaml = read_robot_poses(YAML).unwrap();
        let json = r#"{"poses": [{"picture": "a.png", "base_from_flange":
            {"translation_m": [0.4, 0.0, 0.5], "rotation_xyzw": [1.0, 0.0, 0.0, 0.0]}}]}"#;
        assert_eq!(read_robot_poses(json).unwrap(), yaml);
        let csv = "picture,x,y,z,qx,qy,qz,qw\na.png,0.4,0,0.5,1,0,0,0\n";
        assert_eq!(read_robot_poses(csv).unwrap(), yaml);
        let by_spreadsheets = [
            format!("\u{feff}{csv}"),
            csv.replace("picture,x,y,z", "Picture,X,Y,Z"),
            csv.replace(',', ";"),
            csv.replace(',', ";").replace("0.", "0,"),
            csv.replace(',', "\t"),
        ];
        for text in by_spreadsheets {
            assert_eq!(read_robot_poses(&text).unwrap(), yaml, "{text}");
        }
        assert_eq!(read_robot_poses(&format!("\u{feff}{YAML}")).unwrap(), yaml);
    }

    #[test]
    fn nonsense_is_refused() {
        let error = |from: &str, to: &str| read_robot_poses(&YAML.replace(from, to)).unwrap_err().to_string();
        assert!(error("[0.4, 0, 0.5]", "[400, 0, 500]").contains("millimetres given as metres?"));
        assert!(error("[0.4, 0, 0.5]", "[0.4, 0]").contains("three numbers"));
        assert!(error("[0.4, 0, 0.5]", "[.nan, 0, 0]").contains("a.png"));
        assert!(error("[1, 0, 0, 0]", "[1, 1, 0, 0]").contains("length 1"));
        assert!(error("poses", "pose").contains("docs/calibration.md"));
        assert!(read_robot_poses("picture,x\n").is_err());
        assert!(read_robot_poses("picture,x,y,z,qx,qy,qz,qw\na.png,1,2\n").is_err());
    }
}
