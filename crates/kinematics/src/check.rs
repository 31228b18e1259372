//! Checks of what comes in.

use nalgebra::Isometry3;

use crate::error::KinematicsError;
use crate::inverse::IkOptions;
use crate::limits::JointVector;

pub(crate) fn check_pose(what: &'static str, pose: &Isometry3<f64>) -> Result<(), KinematicsError> {
    const UNIT_TOLERANCE: f64 = 1e-6;
    let length = pose.rotation.as_ref().norm();
    if !pose.translation.vector.iter().all(|x| x.is_finite()) || !length.is_finite() {
        return Err(KinematicsError::NotFinite {
            what,
            found: format!(
                "position {:?}, quaternion {:?}",
                pose.translation.vector.as_slice(),
                pose.rotation.coords.as_slice()
            ),
        });
    }
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(KinematicsError::NotARotation { what, found: length });
    }
    Ok(())
}

pub(crate) fn check_joints(what: &'static str, q: &JointVector) -> Result<(), KinematicsError> {
    if q.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(KinematicsError::NotFinite { what, found: format!("{:?}", q.as_slice()) })
}

pub(crate) fn check_options(options: &IkOptions) -> Result<(), KinematicsError> {
    check_joints("posture", &options.posture)?;
    let non_negative = "a finite number of at least 0";
    let positive = "a finite number above 0";
    let checks = [
        ("seed_weight", options.seed_weight, false),
        ("posture_weight", options.posture_weight, false),
        ("limit_weight", options.limit_weight, false),
        ("required_margin_rad", options.required_margin_rad, false),
        ("comfortable_margin_rad", options.comfortable_margin_rad, true),
        ("position_tolerance_m", options.position_tolerance_m, true),
        ("angle_tolerance_rad", options.angle_tolerance_rad, true),
        ("metres_per_rad", options.metres_per_rad, true),
    ];
    for (option, found, must_be_positive) in checks {
        let is_valid = found.is_finite() && found >= 0.0 && !(must_be_positive && found == 0.0);
        if !is_valid {
            let expected = if must_be_positive { positive } else { non_negative };
            return Err(KinematicsError::InvalidOption { option, expected, found });
        }
    }
    if options.required_margin_rad > 1.0 {
        return Err(KinematicsError::InvalidOption {
            option: "required_margin_rad",
            expected: "at most 1 rad, so that every joint keeps a range",
            found: options.required_margin_rad,
        });
    }
    if options.num_redundancy_samples < 2 {
        return Err(KinematicsError::InvalidOption {
            option: "num_redundancy_samples",
            expected: "at least 2",
            found: options.num_redundancy_samples as f64,
        });
    }
    Ok(())
}
