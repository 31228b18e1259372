//! All configurations of a Franka that reach a flange pose with joint 7 at a given angle, in closed form
//! (`ClosedForm::Franka`).
//!
//! With q7 fixed the arm has six joints and at most eight solutions. Seen from the flange, joint 7 determines the wrist
//! centre W (the common origin of links 5 and 6) and the axis of joint 6. Shoulder S, elbow axis E and W then form a
//! triangle of known sides: its angle at E determines q4 (two solutions). The triangle may rotate about SW by ψ; the
//! forearm must be perpendicular to the axis of joint 6, which allows two values of ψ. Shoulder (ZYZ Euler angles, two
//! solutions) and wrist follow from the frames.
//!
//! Only the geometry is considered: solutions may violate joint limits. If no solution exists, the nearest degenerate
//! one is returned, with an `infeasibility` that gives a search over q7 a gradient.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Vector3};

use crate::geometry::ArmGeometry;
use crate::joints::JointVector;

/// Number of branches for one q7: elbow (2) × rotation of the arm plane (2) × shoulder (2).
pub(crate) const NUM_BRANCHES: usize = 8;

/// One solution of the inverse kinematics.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AnalyticSolution {
    pub q: JointVector,
    /// 0 if the pose is reached exactly; otherwise the excess of the construction's two cosines beyond [-1, 1].
    pub infeasibility: f64,
}

/// The solutions for one q7, by branch; `None` if the construction is degenerate.
///
/// `q1_if_free` is used if the upper arm points along the axis of joint 1, where only q1 + q3 is determined. Joint 6,
/// whose range is not centred at 0, is returned in [-π + 1.87, π + 1.87), centred on the middle of the Panda's range.
pub(crate) fn analytic_solutions(
    arm: &ArmGeometry,
    base_from_flange: &Isometry3<f64>,
    q7: f64,
    q1_if_free: f64,
) -> [Option<AnalyticSolution>; NUM_BRANCHES] {
    let mut found = [None; NUM_BRANCHES];
    let (shoulder_m, upper_m, fore_m) = (arm.joints[0].d_m, arm.joints[2].d_m, arm.joints[4].d_m);
    let (elbow_m, after_elbow_m, wrist_m) = (arm.joints[3].a_m, arm.joints[4].a_m, arm.joints[6].a_m);

    let flange = base_from_flange.rotation.to_rotation_matrix();
    let (x7, y7, z7) = columns(flange.matrix());
    let (sin_q7, cos_q7) = q7.sin_cos();
    let x6 = x7 * cos_q7 - y7 * sin_q7;
    let z6 = x7 * sin_q7 + y7 * cos_q7;
    let wrist = base_from_flange.translation.vector - z7 * arm.flange_offset_m - x6 * wrist_m;

    let shoulder = Vector3::new(0.0, 0.0, shoulder_m);
    let shoulder_to_wrist = wrist - shoulder;
    let reach = shoulder_to_wrist.norm();
    if reach < MIN_REACH_M {
        return found;
    }
    // Axes (u, a, b): u from shoulder to wrist, a and b any perpendicular pair.
    let u = shoulder_to_wrist / reach;
    let a = perpendicular(&u);
    let b = u.cross(&a);

    let upper_arm = upper_m.hypot(elbow_m);
    let forearm = fore_m.hypot(after_elbow_m);
    let cos_elbow = (upper_arm * upper_arm + forearm * forearm - reach * reach) / (2.0 * upper_arm * forearm);
    let elbow = cos_elbow.clamp(-1.0, 1.0).acos();
    let excess_elbow = (cos_elbow.abs() - 1.0).max(0.0);

    // Angle about z4 from shoulder to wrist, seen from E, at q4 = 0.
    let wrist_direction = fore_m.atan2(after_elbow_m);
    let shoulder_direction = (-upper_m).atan2(-elbow_m);
    let elbow_at_zero = wrist_direction - shoulder_direction;

    for (elbow_idx, elbow_angle) in [elbow, TAU - elbow].into_iter().enumerate() {
        let q4 = elbow_angle - elbow_at_zero;
        let (sin_q4, cos_q4) = q4.sin_cos();
        // Shoulder and wrist in link 4, whose origin is E.
        let s_x = -elbow_m * cos_q4 - upper_m * sin_q4;
        let s_y = elbow_m * sin_q4 - upper_m * cos_q4;
        let (u_x, u_y) = (after_elbow_m - s_x, fore_m - s_y);
        let length = u_x.hypot(u_y);
        let (u_x, u_y) = (u_x / length, u_y / length);

        // The forearm y4 = u_y·u + u_x·v, v = cos ψ a + sin ψ b, must be perpendicular to z6.
        let (on_a, on_b) = (u_x * z6.dot(&a), u_x * z6.dot(&b));
        let amplitude = on_a.hypot(on_b);
        if amplitude < MIN_AMPLITUDE {
            continue;
        }
        let cos_psi = -u_y * z6.dot(&u) / amplitude;
        let infeasibility = excess_elbow + (cos_psi.abs() - 1.0).max(0.0);
        let phase = on_b.atan2(on_a);
        let psi = cos_psi.clamp(-1.0, 1.0).acos();

        for (turn_idx, psi) in [phase + psi, phase - psi].into_iter().enumerate() {
            let (sin_psi, cos_psi) = psi.sin_cos();
            let v = a * cos_psi + b * sin_psi;
            let z4 = b * cos_psi - a * sin_psi;
            let x4 = u * u_x - v * u_y;
            let y4 = u * u_y + v * u_x;

            let z3 = x4 * sin_q4 + y4 * cos_q4;
            let x3 = x4 * cos_q4 - y4 * sin_q4;
            let y3 = -z4;

            let q5 = z6.dot(&x4).atan2(z6.dot(&z4));
            let (sin_q5, cos_q5) = q5.sin_cos();
            let x5 = x4 * cos_q5 - z4 * sin_q5;
            let mut q6 = x6.dot(&y4).atan2(x6.dot(&x5));
            if q6 < MIDDLE_Q6 - PI {
                q6 += TAU;
            }

            let sin_q2 = z3.x.hypot(z3.y);
            for (shoulder_idx, sign) in [1.0, -1.0].into_iter().enumerate() {
                let q2 = sign * sin_q2.atan2(z3.z);
                let (q1, q3) = if sin_q2 > MIN_SIN_Q2 {
                    ((sign * z3.y).atan2(sign * z3.x), (sign * y3.z).atan2(-sign * x3.z))
                } else {
                    // With an upright upper arm, x3 is at the angle q1 + q3 in the horizontal plane.
                    (q1_if_free, wrap(x3.y.atan2(x3.x) - q1_if_free))
                };
                let branch = (elbow_idx * 2 + turn_idx) * 2 + shoulder_idx;
                found[branch] =
                    Some(AnalyticSolution { q: JointVector::from([q1, q2, q3, wrap(q4), q5, q6, q7]), infeasibility });
            }
        }
    }
    found
}

/// Middle of the Panda's range of joint 6, rad.
const MIDDLE_Q6: f64 = 1.8675;
/// Below these values a direction of the construction is not defined. Below [`MIN_REACH_M`] and [`MIN_AMPLITUDE`]
/// there is no solution; a neighbouring q7 has one.
const MIN_REACH_M: f64 = 1e-6;
const MIN_AMPLITUDE: f64 = 1e-9;
const MIN_SIN_Q2: f64 = 1e-9;

fn columns(m: &nalgebra::Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    (m.column(0).into_owned(), m.column(1).into_owned(), m.column(2).into_owned())
}

fn perpendicular(u: &Vector3<f64>) -> Vector3<f64> {
    let least = if u.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    u.cross(&least).normalize()
}

fn wrap(angle_rad: f64) -> f64 {
    let wrapped = (angle_rad + PI).rem_euclid(TAU) - PI;
    if wrapped == -PI { PI } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{ArmGeometry, pose_error};
    use crate::limits::JointLimits;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn every_solution_reaches_and_the_original_is_among_them() {
        // Cosines near ±1 lose half of their digits, so acos has an accuracy of 1e-7 rad there.
        const TOLERANCE: f64 = 1e-6;
        let panda = ArmGeometry::panda();
        let limits = JointLimits::panda();
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        for _ in 0..500 {
            let q = JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]));
            let target = panda.base_from_flange(&q);
            let mut original_distance = f64::INFINITY;
            let mut num_exact = 0;
            for solution in analytic_solutions(&panda, &target, q[6], q[0]).into_iter().flatten() {
                if solution.infeasibility > 0.0 {
                    continue;
                }
                num_exact += 1;
                let error = pose_error(&panda.base_from_flange(&solution.q), &target).norm();
                assert!(error < TOLERANCE, "{error} at {} from {q}", solution.q);
                original_distance = original_distance.min((solution.q - q).norm());
            }
            assert!(num_exact >= 4, "only {num_exact} solutions for {q}");
            assert!(original_distance < 1e-5, "{original_distance} for {q}");
        }
    }
}
