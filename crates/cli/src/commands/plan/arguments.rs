//! Parsers of the numeric arguments of `sdg plan`.

use std::f64::consts::FRAC_PI_4;
use std::str::FromStr;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use sdg_kinematics::{JointVector, NUM_JOINTS};

use crate::shared_args::{METRES, millimetres};

/// `--start`: joint angles, given in degrees.
#[derive(Debug, Clone, Copy)]
pub struct JointsDeg(pub JointVector);

/// `--goal`: `base_from_tcp`, given in mm and degrees.
#[derive(Debug, Clone, Copy)]
pub struct GoalPose(pub Isometry3<f64>);

/// `--held-mm`: the held object.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    pub diameter_m: f64,
    pub length_m: f64,
}

/// `--margin-mm`. At most 100 mm, because no workcell has room for a larger distance.
pub fn margin_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a distance", [0.1, 100.0])
}

impl FromStr for JointsDeg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let angles = numbers(text)?;
        if angles.len() != NUM_JOINTS {
            return Err(format!("expected {NUM_JOINTS} angles in degrees, found {}", angles.len()));
        }
        Ok(Self(JointVector::from_fn(|joint, _| angles[joint].to_radians())))
    }
}

impl FromStr for GoalPose {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = numbers(text)?;
        let ([x, y, z], [roll, pitch, yaw]) = match numbers[..] {
            [x, y, z] => ([x, y, z], [180.0, 0.0, 0.0]),
            [x, y, z, yaw] => ([x, y, z], [180.0, 0.0, yaw]),
            [x, y, z, roll, pitch, yaw] => ([x, y, z], [roll, pitch, yaw]),
            _ => {
                let found = numbers.len();
                return Err(format!("expected X,Y,Z or X,Y,Z,YAW or X,Y,Z,ROLL,PITCH,YAW, found {found} numbers"));
            }
        };
        if [x, y, z].iter().all(|value| value.abs() < MIN_DISTANCE_MM) {
            return Err(format!("expected X,Y,Z in mm, found {x},{y},{z}{METRES}"));
        }
        let given = &numbers[3..];
        if are_radians(given) {
            return Err(format!("expected angles in degrees, found {given:?}: radians given as degrees?"));
        }
        let turn = UnitQuaternion::from_euler_angles(roll.to_radians(), pitch.to_radians(), yaw.to_radians());
        Ok(Self(Isometry3::from_parts(Translation3::new(x * 1e-3, y * 1e-3, z * 1e-3), turn)))
    }
}

impl FromStr for Held {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [diameter, length] = text.split(',').collect::<Vec<_>>()[..] else {
            return Err(format!("expected DIAMETER,LENGTH in mm, found \"{text}\""));
        };
        let size_m = |text: &str, name| Ok::<_, String>(1e-3 * millimetres(text.trim(), name, [1.0, 1000.0])?);
        Ok(Self { diameter_m: size_m(diameter, "a DIAMETER")?, length_m: size_m(length, "a LENGTH")? })
    }
}

/// A goal whose coordinates are all below this absolute value, in mm, is rejected, because it was probably given in
/// metres.
const MIN_DISTANCE_MM: f64 = 10.0;
/// Maximum distance of an angle from a multiple of 45 degrees that is attributed to rounding, in radians.
const ROUNDING_RAD: f64 = 0.006;

/// Whether the angles look like multiples of 45 degrees in radians, such as 3.14 and 0.785. An input of 3.14 degrees is
/// unlikely.
fn are_radians(angles: &[f64]) -> bool {
    let is_part = |angle: f64| {
        let eighths = angle.abs() / FRAC_PI_4;
        eighths < 8.5 && (eighths - eighths.round()).abs() * FRAC_PI_4 < ROUNDING_RAD && angle.fract() != 0.0
    };
    angles.iter().any(|angle| *angle != 0.0) && angles.iter().all(|angle| *angle == 0.0 || is_part(*angle))
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|part| match part.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("expected finite numbers with commas between them, found \"{part}\"")),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn poses_point_down_unless_told_otherwise() {
        let GoalPose(short) = "500,-100,200".parse().unwrap();
        assert!((short.translation.vector - Vector3::new(0.5, -0.1, 0.2)).norm() < 1e-12);
        assert!((short.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
        let GoalPose(turned) = "500,0,200,90".parse().unwrap();
        assert!((turned.rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
        let GoalPose(level) = "500,0,200,0,90,0".parse().unwrap();
        assert!((level.rotation * Vector3::z() - Vector3::x()).norm() < 1e-12);
        assert!("500,0".parse::<GoalPose>().unwrap_err().contains("found 2 numbers"));
        assert!("500,x,3".parse::<GoalPose>().unwrap_err().contains("found \"x\""));
        assert!("500,nan,3".parse::<GoalPose>().is_err());
        for radians in ["500,0,200,3.14159,0,1.5708", "500,0,200,3.14,0,0.785", "500,0,200,1.5708"] {
            assert!(radians.parse::<GoalPose>().unwrap_err().contains("radians given as degrees?"), "{radians}");
        }
        assert!("500,0,200,180,0,3".parse::<GoalPose>().is_ok() && "500,0,200,2.5".parse::<GoalPose>().is_ok());
        assert!("0.5,0,0.2".parse::<GoalPose>().unwrap_err().contains("metres given as millimetres?"));
    }

    #[test]
    fn joints_are_seven() {
        let JointsDeg(q) = "0,-45,0,-135,0,90,45".parse().unwrap();
        assert!((q - sdg_kinematics::ready_pose()).amax() < 1e-12);
        assert!("0,-45".parse::<JointsDeg>().unwrap_err().contains("found 2"));
        assert!("30,0".parse::<Held>().is_err() && "30".parse::<Held>().is_err());
        assert!("0.03,0.1".parse::<Held>().unwrap_err().contains("metres given as millimetres?"));
        assert!(margin_mm("0.003").unwrap_err().contains("metres given as millimetres?") && margin_mm("3") == Ok(3.0));
        assert!((("30,100".parse::<Held>().unwrap()).diameter_m - 0.03).abs() < 1e-12);
    }
}
