//! Robot poses that contradict the pictures: which mistake explains it.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use sdg_geometry::PinholeCamera;

use super::solve::{MAX_ROBOT_SCALE, SUSPECT_ROBOT_SCALE, Solved};
use super::view::{HandEyeView, Mount};
use crate::board::Board;
use crate::error::CalibrationError;
use crate::pose::BoardPose;

/// What a robot's pose may mean instead.
type Reading = fn(&Isometry3<f64>) -> Isometry3<f64>;

/// Another reading explains what is seen where it leaves at most this share of the reprojection.
const MAX_SHARE: f64 = 0.3;

/// What was found, unless poses and pictures contradict each other or another reading of the poses fits far better.
pub(super) fn checked<'a>(
    solved: Result<Solved<'a>, CalibrationError>,
    camera: &PinholeCamera,
    board: &Board,
    mount: Mount,
    views: &[HandEyeView],
    poses: &[BoardPose],
) -> Result<Solved<'a>, CalibrationError> {
    let scale = solved.as_ref().map_or(f64::INFINITY, |solved| solved.robot_scale.unwrap_or_default());
    let solved = match solved {
        Ok(solved) if scale < SUSPECT_ROBOT_SCALE => return Ok(solved),
        solved => solved.ok(),
    };
    let rms_px = solved.as_ref().map_or(f64::INFINITY, |solved| solved.minimum.at.rms_px());
    // A camera on the hand with poses inverted is a camera beside the robot: both have one equation.
    let readings: [(&str, Reading); 4] = [
        ("rotation_xyzw seems to hold w first", w_first),
        ("the poses seem to be flange_from_base, or --mount to be the other one", Isometry3::inverse),
        ("rotation_xyzw seems to hold w first, and --mount to be the other one", |pose| w_first(pose).inverse()),
        ("the translations seem to be in millimetres", |pose| {
            Isometry3::from_parts((pose.translation.vector / 1000.0).into(), pose.rotation)
        }),
    ];
    let tried = readings.iter().filter_map(|(name, reading)| {
        let robot: Vec<_> = views.iter().map(|view| reading(&view.base_from_flange)).collect();
        let other = Solved::of(camera, board, mount, views, &robot, poses).ok()?;
        Some((*name, other.minimum.at.rms_px()))
    });
    let best = tried.filter(|(_, rms)| *rms < MAX_SHARE * rms_px).min_by(|a, b| a.1.total_cmp(&b.1));
    let hint = match best {
        Some((name, rms)) => format!(": {name}, which leaves {rms:.2} px"),
        None if scale > MAX_ROBOT_SCALE => {
            ": check that each picture stands with its own pose, that the robot stood still, and that neither board nor camera was moved"
                .to_owned()
        }
        None => return solved.ok_or(CalibrationError::NoPose),
    };
    let found = match solved.filter(|_| rms_px.is_finite()) {
        Some(solved) => {
            format!("{rms_px:.1} px between them where the board alone leaves {:.2} px", solved.board_rms_px)
        }
        None => "no place of the camera that explains both".to_owned(),
    };
    Err(CalibrationError::HandEyeDisagrees { found, hint })
}

/// The pose whose quaternion was written w, x, y, z and read x, y, z, w.
fn w_first(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let read = pose.rotation.coords;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(read[0], read[1], read[2], read[3]));
    Isometry3::from_parts(pose.translation, rotation)
}
