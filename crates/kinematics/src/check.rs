//! Checks of input values.

use nalgebra::Isometry3;

use crate::error::KinematicsError;
use crate::ik::IkOptions;
use crate::joints::JointVector;

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
    if let Some(posture) = &options.posture {
        check_joints("posture", posture)?;
    }
    check_not_negative("seed_weight", options.seed_weight)?;
    check_not_negative("posture_weight", options.posture_weight)?;
    check_not_negative("limit_weight", options.limit_weight)?;
    check_not_negative("required_margin_rad", options.required_margin_rad)?;
    check_positive("comfortable_margin_rad", options.comfortable_margin_rad)?;
    check_positive("position_tolerance_m", options.position_tolerance_m)?;
    check_positive("angle_tolerance_rad", options.angle_tolerance_rad)?;
    check_positive("metres_per_rad", options.metres_per_rad)?;
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

pub(crate) fn check_positive(option: &'static str, found: f64) -> Result<(), KinematicsError> {
    if found.is_finite() && found > 0.0 {
        return Ok(());
    }
    Err(KinematicsError::InvalidOption { option, expected: "a finite number above 0", found })
}

pub(crate) fn check_not_negative(option: &'static str, found: f64) -> Result<(), KinematicsError> {
    if found.is_finite() && found >= 0.0 {
        return Ok(());
    }
    Err(KinematicsError::InvalidOption { option, expected: "a finite number of at least 0", found })
}
