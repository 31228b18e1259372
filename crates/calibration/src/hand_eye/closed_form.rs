//! `A X = X B` in closed form.
//!
//! Legend: `α`, `β` rotation vectors (axis times angle) of `A_ij = A_i A_j⁻¹` and `B_ij = B_i B_j⁻¹`; `α = R_X β` and
//! `(R_A - I) t_X = R_X t_B - t_A`.
//!
//! # Source
//! Park and Martin, Robot sensor calibration: solving AX = XB on the Euclidean group, 1994; the rotation here by singular values, which keeps it
//! proper where noise is large.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::view::Mount;
use crate::error::CalibrationError;

/// A turn by nearly half has an axis of either sign.
const MAX_ANGLE: f64 = 2.9;
/// The least root mean square turn about the second axis, in degrees: at 4 degrees, noise of 0.1 degrees is a fortieth.
const MIN_SECOND_TURN_DEG: f64 = 4.0;

/// `X` and `Y` from motions and the board's poses; `None` where they leave it open.
pub(super) fn solve(motions: &[Isometry3<f64>], boards: &[Isometry3<f64>]) -> Option<(Isometry3<f64>, Isometry3<f64>)> {
    let pairs: Vec<_> = (0..motions.len())
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| (motions[i] * motions[j].inverse(), boards[i] * boards[j].inverse()))
        .filter(|(a, b)| a.rotation.angle() < MAX_ANGLE && b.rotation.angle() < MAX_ANGLE)
        .collect();
    let products: Matrix3<f64> =
        pairs.iter().map(|(a, b)| a.rotation.scaled_axis() * b.rotation.scaled_axis().transpose()).sum();
    let svd = products.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let mut matrix = DMatrix::zeros(3 * pairs.len(), 3);
    let mut side = DVector::zeros(3 * pairs.len());
    for (k, (a, b)) in pairs.iter().enumerate() {
        let turned = a.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&turned);
        side.fixed_rows_mut::<3>(3 * k).copy_from(&(rotation * b.translation.vector - a.translation.vector));
    }
    let translation = matrix.svd(true, true).solve(&side, 1e-9).ok()?;
    let x = Isometry3::from_parts(Vector3::new(translation[0], translation[1], translation[2]).into(), rotation);
    // Any picture's Y is near enough to start from.
    let y = motions.first()?.inverse() * x * boards.first()?;
    Some((x, y))
}

/// Whether the robot's poses turn about two axes.
pub(super) fn check_turns(mount: Mount, robot: &[Isometry3<f64>]) -> Result<(), CalibrationError> {
    let motions: Vec<_> = robot.iter().map(|pose| mount.motion(pose)).collect();
    let mut scatter = Matrix3::zeros();
    let mut count = 0.0;
    for (i, a) in motions.iter().enumerate() {
        for b in &motions[..i] {
            let turn = (a.rotation * b.rotation.inverse()).scaled_axis();
            scatter += turn * turn.transpose();
            count += 1.0;
        }
    }
    let eigen = (scatter / count).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let turns = order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt().to_degrees());
    if turns[1] >= MIN_SECOND_TURN_DEG {
        return Ok(());
    }
    let frame = match mount {
        Mount::Hand => "the flange's",
        Mount::Base => "the base's",
    };
    let name = |k: usize| nearest_axis(&eigen.eigenvectors.column(order[k]).into_owned());
    let (found, missing) = if turns[0] < MIN_SECOND_TURN_DEG {
        (format!("turns of {:.1} degrees", turns[0]), format!("{frame} x, and others about {frame} y"))
    } else {
        let main = name(0);
        let others: Vec<&str> = ["x", "y", "z"].into_iter().filter(|axis| *axis != main).collect();
        (
            format!("turns of {:.0} degrees about nearly {frame} {main} alone", turns[0]),
            format!("{frame} {} or {}", others[0], others[1]),
        )
    };
    Err(CalibrationError::TurnsAlike { found, missing })
}

fn nearest_axis(direction: &Vector3<f64>) -> &'static str {
    ["x", "y", "z"][direction.abs().imax()]
}
