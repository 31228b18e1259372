//! The configuration within the joint limits whose tcp is nearest to a pose, by damped least squares with bounds.

use nalgebra::{Isometry3, SMatrix, Vector6};

use crate::geometry::{ArmGeometry, pose_error};
use crate::joints::{JointVector, NUM_JOINTS};
use crate::limits::JointLimits;

const MAX_ITERATIONS: usize = 300;
const INITIAL_DAMPING: f64 = 1e-3;
const MIN_DAMPING: f64 = 1e-12;
const MAX_DAMPING: f64 = 1e6;
/// Relative decrease of the cost below which the descent ends.
const MIN_RELATIVE_GAIN: f64 = 1e-10;
const NEGLIGIBLE_COST: f64 = 1e-26;

/// Levenberg–Marquardt from `start`; projection keeps the joints inside `limits`.
///
/// Minimises |Δposition|² + (`metres_per_rad` · Δangle)². A joint at its limit whose step points outwards is left out
/// of the step, so that the other joints continue along the limit.
pub(crate) fn descend(
    arm: &ArmGeometry,
    limits: &JointLimits,
    target: &Isometry3<f64>,
    start: &JointVector,
    metres_per_rad: f64,
) -> JointVector {
    let weights = Vector6::new(1.0, 1.0, 1.0, metres_per_rad, metres_per_rad, metres_per_rad);
    let mut q = limits.clamp(start);
    let mut damping = INITIAL_DAMPING;
    let (mut pose, mut jacobian) = arm.forward_and_jacobian(&q);
    let mut error = pose_error(&pose, target).component_mul(&weights);

    for _ in 0..MAX_ITERATIONS {
        let cost = error.norm_squared();
        if cost < NEGLIGIBLE_COST {
            break;
        }
        for mut column in jacobian.column_iter_mut() {
            column.component_mul_assign(&weights);
        }
        let gradient = jacobian.transpose() * error;
        let normal = jacobian.transpose() * jacobian;
        let is_free: [bool; NUM_JOINTS] = std::array::from_fn(|i| {
            !(q[i] >= limits.position_max[i] && gradient[i] > 0.0
                || q[i] <= limits.position_min[i] && gradient[i] < 0.0)
        });

        let mut next = None;
        while damping < MAX_DAMPING {
            let step = damped_step(&normal, &gradient, &is_free, damping);
            let q_next = limits.clamp(&(q + step));
            let (pose_next, jacobian_next) = arm.forward_and_jacobian(&q_next);
            let error_next = pose_error(&pose_next, target).component_mul(&weights);
            if error_next.norm_squared() < cost {
                damping = (damping * 0.2).max(MIN_DAMPING);
                next = Some((q_next, pose_next, jacobian_next, error_next));
                break;
            }
            damping *= 4.0;
        }
        let Some((q_next, pose_next, jacobian_next, error_next)) = next else {
            break;
        };
        let gain = cost - error_next.norm_squared();
        (q, pose, jacobian, error) = (q_next, pose_next, jacobian_next, error_next);
        if gain < MIN_RELATIVE_GAIN * cost {
            break;
        }
    }
    debug_assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
    q
}

fn damped_step(
    normal: &SMatrix<f64, NUM_JOINTS, NUM_JOINTS>,
    gradient: &JointVector,
    is_free: &[bool; NUM_JOINTS],
    damping: f64,
) -> JointVector {
    let mut matrix = *normal;
    let mut right = *gradient;
    for joint_idx in 0..NUM_JOINTS {
        matrix[(joint_idx, joint_idx)] += damping;
        if !is_free[joint_idx] {
            matrix.row_mut(joint_idx).fill(0.0);
            matrix.column_mut(joint_idx).fill(0.0);
            matrix[(joint_idx, joint_idx)] = 1.0;
            right[joint_idx] = 0.0;
        }
    }
    match matrix.cholesky() {
        Some(factor) => factor.solve(&right),
        // The matrix is positive definite except for rounding errors; a gradient step always decreases the cost.
        None => right / (damping + normal.trace()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::ready_pose;

    #[test]
    fn descent_recovers_a_pose_close_by() {
        let panda = ArmGeometry::panda();
        let target = panda.forward(&ready_pose().add_scalar(0.1));
        let q = descend(&panda, &panda.limits, &target, &ready_pose(), 0.3);
        assert!(pose_error(&panda.forward(&q), &target).norm() < 1e-9);
    }

    #[test]
    fn descent_stops_inside_the_limits_and_slides_along_them() {
        // So close to the base, joint 4 would have to fold beyond its limit.
        let panda = ArmGeometry::panda();
        let mut target = panda.forward(&ready_pose());
        target.translation.vector = nalgebra::Vector3::new(0.1, 0.0, 0.1);
        let q = descend(&panda, &panda.limits, &target, &ready_pose().add_scalar(0.2), 0.3);
        assert_eq!(panda.limits.worst_violation(&q, 0.0), None);
        assert_eq!(q[3], panda.limits.position_min[3]);
        // At the result, no joint can lower the cost by a small move inside the limits: joint 4 at its limit did not
        // stop the other joints.
        let cost = |q: &JointVector| {
            let error = pose_error(&panda.forward(q), &target);
            error.fixed_rows::<3>(0).norm_squared() + 0.09 * error.fixed_rows::<3>(3).norm_squared()
        };
        for joint_idx in 0..NUM_JOINTS {
            for step in [-1e-3, 1e-3] {
                let mut moved = q;
                moved[joint_idx] += step;
                let moved = panda.limits.clamp(&moved);
                assert!(cost(&moved) >= cost(&q) - 1e-9, "joint {}", joint_idx + 1);
            }
        }
    }
}
