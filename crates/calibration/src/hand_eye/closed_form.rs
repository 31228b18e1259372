//! `A X = X B` in closed form.
//!
//! Legend: `α`, `β` the rotation vectors (axis times angle) of `A_ij = A_i A_j⁻¹` and `B_ij = B_i B_j⁻¹`; `α = R_X β`
//! and `(R_A - I) t_X = R_X t_B - t_A`.
//!
//! # Source
//! Park and Martin, Robot sensor calibration: solving AX = XB on the Euclidean group, 1994. The rotation is computed
//! here by singular values, which give a proper rotation even under strong noise.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use sdg_geometry::Mount;

use crate::error::CalibrationError;

/// Largest angle of a usable rotation, in radians: near π the sign of the axis is undetermined.
const MAX_ANGLE: f64 = 2.9;
/// Minimum root mean square rotation about the axis with the second largest one, in degrees: forty times a noise of 0.1
/// degrees.
const MIN_SECOND_TURN_DEG: f64 = 4.0;

/// The lever arm, in metres, that converts shifts to angles: about the distance of boards from flanges.
const LEVER_M: f64 = 0.3;

/// The size of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BoardSize {
    /// The given size.
    Told,
    /// The board's size is a multiple of the given one; the factor is estimated.
    Free,
}

/// A solution of the equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closed {
    pub(super) x: Isometry3<f64>,
    pub(super) y: Isometry3<f64>,
    pub(super) board_scale: f64,
    /// Residual of the equations of motions between pictures: root mean square, in radians, with shifts divided by
    /// [`LEVER_M`].
    pub(super) left_rad: f64,
}

/// A motion of the flange between two pictures, and the motion of the board.
type Pair = (Isometry3<f64>, Isometry3<f64>);

/// Solves for `X` and `Y` from motions and the board's poses; `None` if they are not determined.
pub(super) fn solve(motions: &[Isometry3<f64>], boards: &[Isometry3<f64>], size: BoardSize) -> Option<Closed> {
    let pairs = pairs(motions, boards, usize::MAX);
    let rotation = turn_between(&pairs)?;
    let mut matrix = DMatrix::zeros(3 * pairs.len(), 4);
    let mut side = DVector::zeros(3 * pairs.len());
    for (k, (a, b)) in pairs.iter().enumerate() {
        let turned = a.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        let of_board = rotation * b.translation.vector;
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&turned);
        // The board's scale multiplies the shifts of the board.
        let told = match size {
            BoardSize::Told => of_board,
            BoardSize::Free => {
                matrix.fixed_view_mut::<3, 1>(3 * k, 3).copy_from(&-of_board);
                Vector3::zeros()
            }
        };
        side.fixed_rows_mut::<3>(3 * k).copy_from(&(told - a.translation.vector));
    }
    // Normal equations, because the singular values for hundreds of pairs would take longer than everything else.
    let mut normal = (matrix.transpose() * &matrix).fixed_view::<4, 4>(0, 0).into_owned();
    if size == BoardSize::Told {
        normal[(3, 3)] = 1.0;
    }
    let found = normal.cholesky()?.solve(&(matrix.transpose() * &side).fixed_rows::<4>(0).into_owned());
    let shifts_left =
        (&matrix * DVector::from_column_slice(found.as_slice()) - side).norm_squared() / (LEVER_M * LEVER_M);
    let left = (shifts_left + squares_of_turns(&rotation, &pairs)) / pairs.len() as f64;
    let board_scale = if size == BoardSize::Free { found[3] } else { 1.0 };
    let x = Isometry3::from_parts(found.fixed_rows::<3>(0).into_owned().into(), rotation);
    let board = boards.first()?;
    let scaled = Isometry3::from_parts((board.translation.vector * board_scale).into(), board.rotation);
    // The Y of any picture is accurate enough as an initial value.
    let y = motions.first()?.inverse() * x * scaled;
    Some(Closed { x, y, board_scale, left_rad: left.sqrt() })
}

/// Residual of the rotations between pictures at most [`NEAR`] apart: root mean square, in radians.
pub(super) fn turns_left(motions: &[Isometry3<f64>], boards: &[Isometry3<f64>]) -> f64 {
    let pairs = pairs(motions, boards, NEAR);
    let left = turn_between(&pairs).map(|rotation| squares_of_turns(&rotation, &pairs) / pairs.len() as f64);
    left.filter(|left| left.is_finite()).map_or(f64::INFINITY, f64::sqrt)
}

/// Number of previous pictures with which each picture is compared when thousands of readings are tried.
const NEAR: usize = 2;

/// All pairs of pictures at most `apart` indices apart.
fn pairs(motions: &[Isometry3<f64>], boards: &[Isometry3<f64>], apart: usize) -> Vec<Pair> {
    let indices = (0..motions.len()).flat_map(|i| (i.saturating_sub(apart)..i).map(move |j| (i, j)));
    let pairs = indices.map(|(i, j)| (motions[i] * motions[j].inverse(), boards[i] * boards[j].inverse()));
    pairs.filter(|(a, b)| a.rotation.angle() < MAX_ANGLE && b.rotation.angle() < MAX_ANGLE).collect()
}

/// The rotation `R_X`.
fn turn_between(pairs: &[Pair]) -> Option<UnitQuaternion<f64>> {
    let products: Matrix3<f64> =
        pairs.iter().map(|(a, b)| a.rotation.scaled_axis() * b.rotation.scaled_axis().transpose()).sum();
    let svd = products.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
}

fn squares_of_turns(rotation: &UnitQuaternion<f64>, pairs: &[Pair]) -> f64 {
    pairs.iter().map(|(a, b)| (a.rotation.scaled_axis() - rotation * b.rotation.scaled_axis()).norm_squared()).sum()
}

/// Checks that the robot's poses differ by rotations about two axes.
pub(super) fn check_turns(mount: Mount, motions: &[Isometry3<f64>]) -> Result<(), CalibrationError> {
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
        (format!("rotations of {:.1} degrees", turns[0]), format!("{frame} x, and others about {frame} y"))
    } else {
        let main = name(0);
        let others: Vec<&str> = ["x", "y", "z"].into_iter().filter(|axis| *axis != main).collect();
        (
            format!("rotations of {:.0} degrees about nearly {frame} {main} alone", turns[0]),
            format!("{frame} {} or {}", others[0], others[1]),
        )
    };
    Err(CalibrationError::TurnsAlike { found, missing })
}

fn nearest_axis(direction: &Vector3<f64>) -> &'static str {
    ["x", "y", "z"][direction.abs().imax()]
}
