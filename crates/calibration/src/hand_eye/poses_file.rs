//! Robot poses with their pictures, as YAML, JSON or CSV.
//!
//! ```yaml
//! poses:
//!   - picture: 00.png
//!     base_from_flange: {translation_m: [0.4, 0.0, 0.5], rotation_xyzw: [1.0, 0.0, 0.0, 0.0]}
//! ```
//! JSON has the same field names. CSV has the header `picture,x,y,z,qx,qy,qz,qw` and lengths in metres. Fields may be
//! separated by commas, semicolons, tabs or blanks, numbers may have decimal commas, and lines that start with `#` are
//! comments.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;

use crate::error::CalibrationError;

/// The robot's pose for a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotPose {
    /// The file name of the picture.
    pub picture: String,
    /// Pose of the flange in the base frame, lengths in metres.
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

/// Maximum distance of the flange from the base along each axis, in metres: larger than any arm's reach.
const MAX_REACH_M: f64 = 5.0;
/// Tolerance of a quaternion's length, for rounding in files.
const MAX_QUATERNION_ERROR: f64 = 1e-3;
const HEADER: &str = "picture,x,y,z,qx,qy,qz,qw";

/// The format of a poses file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Json,
    Yaml,
}

impl Format {
    /// The format, from the first line that is neither empty nor a comment if that line is unambiguous, otherwise from
    /// the extension of the file's name.
    fn of(name: &str, text: &str) -> Self {
        let first = text.lines().find(|line| is_row(line)).unwrap_or_default();
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
        let starts_with_picture = first.get(..7).is_some_and(|word| word.eq_ignore_ascii_case("picture"));
        let is_header = starts_with_picture && first[7..].starts_with([',', ';', '\t', ' ']);
        match ending.as_str() {
            _ if is_header => Self::Csv,
            _ if first.trim_start().starts_with('{') => Self::Json,
            "csv" | "tsv" => Self::Csv,
            "json" => Self::Json,
            _ => Self::Yaml,
        }
    }
}

/// Whether a line of CSV is neither empty nor a comment.
fn is_row(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with('#')
}

/// Reads robot poses from the text of a file with this name.
///
/// # Errors
/// [`CalibrationError::PosesUnreadable`]; [`CalibrationError::RobotPose`] for an invalid pose or one in millimetres.
pub fn read_robot_poses(name: &str, text: &str) -> Result<Vec<RobotPose>, CalibrationError> {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let entries = match Format::of(name, text) {
        Format::Csv => read_csv(text)?,
        Format::Json => {
            let file: Result<File, _> = serde_json::from_str(text);
            file.map_err(|error| unreadable(format!("as JSON, {error}")))?.poses
        }
        Format::Yaml => {
            let file: Result<File, _> = serde_saphyr::from_str(text);
            let said = |error: serde_saphyr::Error| {
                let message = error.to_string();
                let first = message.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
                unreadable(format!("as YAML, {first}"))
            };
            file.map_err(said)?.poses
        }
    };
    entries.into_iter().map(Entry::checked).collect()
}

fn unreadable(found: String) -> CalibrationError {
    CalibrationError::PosesUnreadable { found }
}

fn read_csv(text: &str) -> Result<Vec<Entry>, CalibrationError> {
    let mut rows = text.lines().map(str::trim).filter(|line| is_row(line));
    let header = rows.next().unwrap_or_default();
    // Spreadsheets with decimal commas separate the fields with semicolons.
    let separator = [';', '\t', ','].into_iter().find(|separator| header.contains(*separator)).unwrap_or(' ');
    if !fields(header, separator).join(",").eq_ignore_ascii_case(HEADER) {
        return Err(unreadable(format!("as CSV, the header {header:?} instead of {HEADER}")));
    }
    rows.map(|row| entry_of_row(row, separator)).collect()
}

fn fields(row: &str, separator: char) -> Vec<&str> {
    if separator == ' ' { row.split_whitespace().collect() } else { row.split(separator).map(str::trim).collect() }
}

fn entry_of_row(row: &str, separator: char) -> Result<Entry, CalibrationError> {
    let num_fields = HEADER.split(',').count();
    let mut fields = fields(row, separator);
    if fields.len() != num_fields {
        // If both decimals and fields use commas, blanks separate the fields.
        fields = row.split_whitespace().map(|field| field.trim_end_matches(separator)).collect();
    }
    let expected = || unreadable(format!("as CSV, the line {row:?}, which does not have the fields {HEADER}"));
    let [picture, numbers @ ..] = &fields[..] else { return Err(expected()) };
    let numbers: Option<Vec<f64>> = numbers.iter().map(|field| field.replace(',', ".").parse().ok()).collect();
    let numbers = numbers.filter(|numbers| numbers.len() + 1 == num_fields).ok_or_else(expected)?;
    let base_from_flange = Pose { translation_m: numbers[..3].to_vec(), rotation_xyzw: numbers[3..].to_vec() };
    Ok(Entry { picture: (*picture).to_owned(), base_from_flange })
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
        let yaml = read_robot_poses("poses.yaml", YAML).unwrap();
        let json = r#"{"poses": [{"picture": "a.png", "base_from_flange":
            {"translation_m": [0.4, 0.0, 0.5], "rotation_xyzw": [1.0, 0.0, 0.0, 0.0]}}]}"#;
        assert_eq!(read_robot_poses("poses.json", json).unwrap(), yaml);
        let csv = "picture,x,y,z,qx,qy,qz,qw\na.png,0.4,0,0.5,1,0,0,0\n";
        assert_eq!(read_robot_poses("poses.csv", csv).unwrap(), yaml);
        let by_spreadsheets = [
            format!("\u{feff}{csv}"),
            csv.replace("picture,x,y,z", "Picture,X,Y,Z"),
            csv.replace(',', ";"),
            csv.replace(',', ";").replace("0.", "0,"),
            csv.replace(',', "\t"),
            csv.replace(',', " "),
            csv.replace(',', " ").replace("0.", "0,"),
            csv.replace("a.png,0.4,0,0.5,", "a.png, 0,4, 0, 0,5, ").replace("1,0,0,0", "1, 0, 0, 0"),
            format!("# of the arm on the left\n\n{csv}# the end\n"),
        ];
        for text in by_spreadsheets {
            assert_eq!(read_robot_poses("poses", &text).unwrap(), yaml, "{text}");
        }
        assert_eq!(read_robot_poses("poses.yml", &format!("\u{feff}{YAML}")).unwrap(), yaml);
    }

    #[test]
    fn nonsense_is_refused() {
        let error =
            |from: &str, to: &str| read_robot_poses("poses.yaml", &YAML.replace(from, to)).unwrap_err().to_string();
        assert!(error("[0.4, 0, 0.5]", "[400, 0, 500]").contains("millimetres given as metres?"));
        assert!(error("[0.4, 0, 0.5]", "[0.4, 0]").contains("three numbers"));
        assert!(error("[0.4, 0, 0.5]", "[.nan, 0, 0]").contains("a.png"));
        assert!(error("[1, 0, 0, 0]", "[1, 1, 0, 0]").contains("length 1"));
        assert!(error("poses", "pose").contains("docs/calibration.md"));
        assert!(read_robot_poses("poses.txt", "picture,x\n").is_err());
        assert!(read_robot_poses("poses.txt", "picture,x,y,z,qx,qy,qz,qw\na.png,1,2\n").is_err());
    }

    #[test]
    fn the_reader_of_the_files_format_says_what_is_wrong() {
        let found = |name: &str, text: &str| read_robot_poses(name, text).unwrap_err().to_string();
        let csv = found("poses.csv", "# comment\nname,x,y\na.png,1,2\n");
        assert!(csv.contains("as CSV, the header \"name,x,y\" instead of picture,x,y,z"), "{csv}");
        let row = found("poses.csv", "picture,x,y,z,qx,qy,qz,qw\na.png,1,2\n");
        assert!(row.contains("as CSV, the line \"a.png,1,2\""), "{row}");
        for name in ["poses.json", "poses.txt"] {
            let json = found(name, "{\"poses\": [}");
            assert!(json.contains("as JSON") && json.contains("line 1 column 12"), "{json}");
        }
        assert!(found("poses.yaml", "poses: 3\n").contains("as YAML"));
    }
}
