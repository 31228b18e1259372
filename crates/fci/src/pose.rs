//! Conversion between poses and the protocol's transforms, and twists between poses.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::wire::Transform;

/// Largest deviation from 1 of the lengths of a commanded rotation's columns and rows (libfranka's bound).
const LENGTH_TOLERANCE: f64 = 1e-5;

/// Whether a matrix consists of a rotation and a translation, all finite, with the last row 0 0 0 1. Unlike libfranka,
/// this rejects mirrored frames.
pub fn is_rigid(transform: &Transform) -> bool {
    if !transform.iter().all(|value| value.is_finite()) {
        return false;
    }
    let bottom = [transform[3], transform[7], transform[11], transform[15]];
    let rotation = rotation_of(transform);
    let is_long_as_one = |length: f64| (length - 1.0).abs() <= LENGTH_TOLERANCE;
    bottom == [0.0, 0.0, 0.0, 1.0]
        && rotation.column_iter().all(|column| is_long_as_one(column.norm()))
        && rotation.row_iter().all(|row| is_long_as_one(row.norm()))
        && rotation.determinant() > 0.0
}

/// The pose of a rigid transform.
pub fn isometry(transform: &Transform) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(rotation_of(transform));
    Isometry3::from_parts(
        Translation3::new(transform[12], transform[13], transform[14]),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// The transform of a pose.
pub fn transform(pose: &Isometry3<f64>) -> Transform {
    let mut values = [0.0; 16];
    values.copy_from_slice(pose.to_homogeneous().as_slice());
    values
}

/// Translation and rotation vector, in the base frame, from one pose to another.
pub(crate) fn difference(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let translation = to.translation.vector - from.translation.vector;
    let rotation = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z)
}

/// The pose after a small motion in the base frame: the inverse of [`difference`].
pub(crate) fn moved(pose: &Isometry3<f64>, motion: &Vector6<f64>) -> Isometry3<f64> {
    let translation: Vector3<f64> = motion.fixed_rows::<3>(0).into();
    let turn = UnitQuaternion::from_scaled_axis(motion.fixed_rows::<3>(3).into_owned());
    Isometry3::from_parts(Translation3::from(pose.translation.vector + translation), turn * pose.rotation)
}

fn rotation_of(transform: &Transform) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| transform[4 * column + row])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_behind_each_other() {
        let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::z() * std::f64::consts::FRAC_PI_2);
        let values = transform(&pose);
        // The rotation maps x to y: the first column is 0 1 0 0.
        for (found, expected) in values[..4].iter().zip([0.0, 1.0, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert_eq!(values[12..], [1.0, 2.0, 3.0, 1.0]);
        assert!((isometry(&values).inverse() * pose).rotation.angle() < 1e-7);
    }

    #[test]
    fn only_rotations_are_rigid() {
        let mut values = transform(&Isometry3::identity());
        assert!(is_rigid(&values));
        values[0] = 1.001;
        assert!(!is_rigid(&values));
        values[0] = -1.0;
        assert!(!is_rigid(&values), "a mirror");
        values[0] = f64::NAN;
        assert!(!is_rigid(&values));
        // Row-major instead of column-major: the translation is in the bottom row.
        let mut transposed = transform(&Isometry3::identity());
        transposed[3] = 0.5;
        assert!(!is_rigid(&transposed));
    }

    #[test]
    fn a_difference_leads_from_one_pose_to_the_other() {
        let from = Isometry3::new(Vector3::new(0.3, -0.1, 0.5), Vector3::new(3.1, 0.0, 0.2));
        let to = Isometry3::new(Vector3::new(0.31, -0.12, 0.5), Vector3::new(3.0, 0.1, 0.2));
        let end = moved(&from, &difference(&from, &to));
        assert!((end.translation.vector - to.translation.vector).norm() < 1e-12);
        assert!(end.rotation.angle_to(&to.rotation) < 1e-7);
    }
}
