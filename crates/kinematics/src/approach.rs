//! The straight motion from a pregrasp pose to a grasp, from a configuration for which the whole motion is within the
//! limits.
//!
//! The best configuration for the pregrasp may lead to a joint limit before the grasp. The arm has several branches and
//! two interchangeable fingers, so the choice is made among whole approaches.

use std::f64::consts::PI;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::error::KinematicsError;
use crate::geometry::ArmGeometry;
use crate::ik::{IkOptions, IkSolution};
use crate::joints::JointVector;
use crate::path::{JointPath, LineOptions};

/// Whether a rotation of the hand by 180° about its own axis gives the same grasp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GraspSymmetry {
    /// Only the given pose is valid.
    Fixed,
    /// The two fingers may be exchanged.
    #[default]
    HalfTurn,
}

/// Configurations from a pregrasp to a grasp along a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct Approach {
    /// The configuration before the line.
    pub pregrasp: IkSolution,
    /// The line, from the pregrasp to the grasp.
    pub path: JointPath,
    /// Whether the hand was rotated by 180°, see [`GraspSymmetry::HalfTurn`].
    pub half_turned: bool,
}

/// The same grasp with exchanged fingers: rotated by 180° about the hand's own z axis.
pub fn with_fingers_exchanged(base_from_tcp: &Isometry3<f64>) -> Isometry3<f64> {
    base_from_tcp * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI)
}

impl ArmGeometry {
    /// Finds the configuration of lowest cost at the pregrasp from which the straight line to the grasp can be
    /// followed.
    ///
    /// Both poses are in m in the base frame; both are rotated by 180° if `symmetry` allows it and the cost is then
    /// lower. `seed` is that of [`ArmGeometry::inverse`].
    ///
    /// # Errors
    /// If no approach exists, the reason of the best candidate; see [`ArmGeometry::inverse`] and
    /// [`ArmGeometry::straight_path`].
    pub fn approach(
        &self,
        base_from_pregrasp: &Isometry3<f64>,
        base_from_grasp: &Isometry3<f64>,
        symmetry: GraspSymmetry,
        seed: &JointVector,
        ik_options: &IkOptions,
        line_options: &LineOptions,
    ) -> Result<Approach, KinematicsError> {
        let turns: &[bool] = match symmetry {
            GraspSymmetry::Fixed => &[false],
            GraspSymmetry::HalfTurn => &[false, true],
        };
        let mut first_error = None;
        let mut starts = Vec::new();
        for &half_turned in turns {
            let [pregrasp, grasp] = [base_from_pregrasp, base_from_grasp]
                .map(|pose| if half_turned { with_fingers_exchanged(pose) } else { *pose });
            match self.inverse_all(&pregrasp, seed, ik_options) {
                Ok(solutions) => {
                    starts.extend(solutions.into_iter().map(|s| (s, grasp, half_turned)));
                }
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        starts.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));

        let mut path_error = None;
        for (pregrasp, grasp, half_turned) in starts {
            match self.straight_path(&pregrasp.q, &grasp, line_options) {
                Ok(path) => {
                    return Ok(Approach { pregrasp, path, half_turned });
                }
                Err(error) => {
                    path_error.get_or_insert(error);
                }
            }
        }
        // The error of a reachable pregrasp is more informative than the error of an unreachable one.
        Err(path_error
            .or(first_error)
            .expect("without a start there was an error, and a start gives an approach or an error"))
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::geometry::pose_error;
    use crate::joints::ready_pose;
    use crate::test_poses::top_grasp;

    fn approach(
        from: &Isometry3<f64>,
        to: &Isometry3<f64>,
        symmetry: GraspSymmetry,
    ) -> Result<Approach, KinematicsError> {
        ArmGeometry::panda().approach(from, to, symmetry, &ready_pose(), &IkOptions::default(), &LineOptions::default())
    }

    #[test]
    fn top_grasps_are_approached_from_above_at_any_yaw() {
        let panda = ArmGeometry::panda();
        let mut rng = Pcg64Mcg::seed_from_u64(41);
        for symmetry in [GraspSymmetry::Fixed, GraspSymmetry::HalfTurn] {
            let mut num_found = 0;
            for _ in 0..300 {
                let (x, y) = (rng.random_range(0.3..0.65), rng.random_range(-0.3..0.3));
                let yaw = rng.random_range(-PI..PI);
                let (above, grasp) = (top_grasp(x, y, 0.2, yaw), top_grasp(x, y, 0.01, yaw));
                match approach(&above, &grasp, symmetry) {
                    Ok(found) => {
                        num_found += 1;
                        let expected = if found.half_turned { with_fingers_exchanged(&grasp) } else { grasp };
                        let error = pose_error(&panda.forward(found.path.end()), &expected);
                        assert!(error.norm() < 1e-8);
                        assert_eq!(*found.path.start(), found.pregrasp.q);
                    }
                    Err(error) => println!("{x:.2} {y:.2} {yaw:.2}: {error}"),
                }
            }
            assert!(num_found >= 298, "{symmetry:?}: {num_found} of 300");
        }
    }

    #[test]
    fn exchanged_fingers_save_a_turn_of_the_wrist() {
        // The ready pose has the hand at yaw 0; at yaw 170° the exchanged fingers are only 10° away.
        let (above, grasp) = (top_grasp(0.45, 0.0, 0.3, 2.967), top_grasp(0.45, 0.0, 0.1, 2.967));
        let found = approach(&above, &grasp, GraspSymmetry::HalfTurn).unwrap();
        assert!(found.half_turned);
        let fixed = approach(&above, &grasp, GraspSymmetry::Fixed).unwrap();
        assert!(!fixed.half_turned);
        assert!(found.pregrasp.cost < fixed.pregrasp.cost);
    }

    #[test]
    fn an_approach_below_reach_is_refused_with_the_reason() {
        let (above, grasp) = (top_grasp(0.6, 0.0, 0.2, 0.0), top_grasp(1.3, 0.0, 0.2, 0.0));
        let error = approach(&above, &grasp, GraspSymmetry::HalfTurn).unwrap_err();
        assert!(matches!(error, KinematicsError::PathBlocked { .. } | KinematicsError::PathJointLimit { .. }));
        let error = approach(&grasp, &above, GraspSymmetry::HalfTurn).unwrap_err();
        assert!(matches!(error, KinematicsError::OutOfReach { .. }), "{error}");
    }
}
