//! The limits of a motion, and a motion that was checked against them.

use nalgebra::{Isometry3, Vector3, Vector6};
use sdg_fci::Limits;
use sdg_kinematics::{
    ArmGeometry, ArmPart, CartesianLimits, Clearance, JointLimits, JointVector, NUM_JOINTS, Trajectory,
};

use crate::arm_state::PERIOD_SECS;
use crate::safety::self_collision::self_collision;
use crate::safety::violation::Violation;

/// The workspace of the hand, in the robot's base frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkspaceBox {
    /// Smallest x, y and z.
    pub min_m: Vector3<f64>,
    /// Largest x, y and z.
    pub max_m: Vector3<f64>,
}

/// The limits of every motion.
#[derive(Debug, Clone)]
pub struct SafetyLimits {
    /// Limits of the joints.
    pub joints: JointLimits,
    /// Limits of the tcp.
    pub cartesian: CartesianLimits,
    /// The workspace of tcp and flange; `None` for no bound.
    pub workspace: Option<WorkspaceBox>,
    /// Height of the table in the base frame, m.
    pub table_height_m: f64,
    /// Distance of the finger tips beyond the tcp, m.
    pub fingertip_beyond_tcp_m: f64,
    /// Minimum height of finger tips, hand, wrist and elbow above the table, m.
    /// [`sdg_kinematics::ArmGeometry::clearance`] defines these parts.
    pub min_table_clearance_m: f64,
    /// Minimum distance between two of the arm's own bodies, m.
    pub min_self_distance_m: f64,
    /// The limits that the robot applies to its client: an FR3's velocity limits decrease near the ends of the joints'
    /// ranges. `None` if only the other limits are checked.
    pub robot: Option<&'static Limits>,
    /// The arm.
    pub geometry: ArmGeometry,
}

impl Default for SafetyLimits {
    /// The Panda's limits above a table at the height of the base.
    fn default() -> Self {
        Self { robot: Some(&Limits::PANDA), ..Self::of(ArmGeometry::panda()) }
    }
}

impl SafetyLimits {
    /// The limits of an arm above a table at the height of the base.
    pub fn of(geometry: ArmGeometry) -> Self {
        Self {
            joints: geometry.limits.clone(),
            cartesian: geometry.cartesian_limits,
            workspace: None,
            table_height_m: 0.0,
            fingertip_beyond_tcp_m: 0.004,
            min_table_clearance_m: 0.001,
            min_self_distance_m: 0.010,
            robot: None,
            geometry,
        }
    }

    /// The FR3's limits above a table at the height of the base. The speed limit of the tcp is that of a Panda.
    pub fn fr3() -> Self {
        Self { robot: Some(&Limits::FR3), ..Self::of(ArmGeometry::fr3()) }
    }
}

/// A motion that satisfies [`SafetyLimits`]; made only by [`SafetyLimits::check`].
#[derive(Debug, Clone)]
pub struct CheckedMotion {
    trajectory: Trajectory,
}

impl CheckedMotion {
    /// Duration of the motion, s.
    pub fn duration_secs(&self) -> f64 {
        self.trajectory.duration_secs()
    }

    /// Joint positions at the start, rad.
    pub fn start(&self) -> &JointVector {
        self.trajectory.start()
    }

    /// Joint positions at the end, rad.
    pub fn end(&self) -> &JointVector {
        self.trajectory.end()
    }

    /// Positions (rad), velocities (rad/s) and accelerations (rad/s²) at a time; at rest before the start and after the
    /// end.
    pub fn sample(&self, time_secs: f64) -> (JointVector, JointVector, JointVector) {
        self.trajectory.sample(time_secs)
    }
}

/// Tolerance as a fraction of a limit: planned motions reach their limits exactly, and rounding and differences over a
/// cycle exceed them slightly.
const ROUNDING: f64 = 1e-3;
/// Tolerance of positions, rad, and of velocities where the limit is 0, rad/s.
const JOINT_ROUNDING: f64 = 1e-6;

impl SafetyLimits {
    /// Checks a whole motion.
    ///
    /// # Errors
    /// The first limit that it violates.
    pub fn check(&self, trajectory: Trajectory) -> Result<CheckedMotion, Violation> {
        let num_cycles = (trajectory.duration_secs() / PERIOD_SECS).ceil() as usize;
        let mut before = Derivatives::default();
        for cycle in 0..=num_cycles {
            let time_secs = cycle as f64 * PERIOD_SECS;
            let (q, dq, ddq) = trajectory.sample(time_secs);
            before = self.check_joints(time_secs, (&q, &dq, &ddq), &before)?.cartesian_of(&before);
            let frames = self.geometry.frames(&q);
            let twist = self.geometry.jacobian(&q) * dq;
            before = self.check_twist(time_secs, twist, &before)?;
            self.check_workspace(time_secs, "tcp", &frames.base_from_tcp)?;
            self.check_workspace(time_secs, "flange", &frames.base_from_flange)?;
            self.check_table(time_secs, &q)?;
            if let Some(collision) = self_collision(&self.geometry, &frames, self.min_self_distance_m) {
                return Err(Violation::SelfCollision { time_secs, collision });
            }
        }
        Ok(CheckedMotion { trajectory })
    }

    fn check_joints(
        &self,
        time_secs: f64,
        (q, dq, ddq): (&JointVector, &JointVector, &JointVector),
        before: &Derivatives,
    ) -> Result<Derivatives, Violation> {
        let jerk = before.ddq.map_or_else(JointVector::zeros, |before| (ddq - before) / PERIOD_SECS);
        let zero = JointVector::zeros();
        let limits = &self.joints;
        for idx in 0..NUM_JOINTS {
            let joint = idx + 1;
            if ![q[idx], dq[idx], ddq[idx]].iter().all(|value| value.is_finite()) {
                return Err(Violation::NotFinite { time_secs, joint });
            }
            for (quantity, unit, value, min, max) in [
                ("position", "rad", q, &limits.position_min, &limits.position_max),
                ("velocity", "rad/s", dq, &zero, &limits.velocity_max),
                ("acceleration", "rad/s²", ddq, &zero, &limits.acceleration_max),
                ("jerk", "rad/s³", &jerk, &zero, &limits.jerk_max),
            ] {
                let (found, max) = (value[idx], max[idx]);
                let min = if quantity == "position" { min[idx] } else { -max };
                let rounding = if quantity == "position" { JOINT_ROUNDING } else { ROUNDING * max };
                if found < min - rounding || found > max + rounding {
                    return Err(Violation::Joint { time_secs, quantity, joint, found, min, max, unit });
                }
            }
            let Some(robot) = self.robot else { continue };
            let [min, max] = robot.velocity_range(idx, q[idx]);
            let [below, above] = [min, max].map(|limit| (ROUNDING * limit.abs()).max(JOINT_ROUNDING));
            if dq[idx] < min - below || dq[idx] > max + above {
                let (quantity, found, unit) = ("velocity", dq[idx], "rad/s");
                return Err(Violation::Joint { time_secs, quantity, joint, found, min, max, unit });
            }
        }
        Ok(Derivatives { ddq: Some(*ddq), ..Derivatives::default() })
    }

    fn check_twist(&self, time_secs: f64, twist: Vector6<f64>, before: &Derivatives) -> Result<Derivatives, Violation> {
        let differ =
            |now: &Vector6<f64>, before: Option<Vector6<f64>>| before.map(|before| (now - before) / PERIOD_SECS);
        let acceleration = differ(&twist, before.twist);
        let jerk = acceleration.as_ref().and_then(|acceleration| differ(acceleration, before.acceleration));
        let limits = &self.cartesian;
        let linear = |value: &Vector6<f64>| value.fixed_rows::<3>(0).norm();
        let angular = |value: &Vector6<f64>| value.fixed_rows::<3>(3).norm();
        let zero = Vector6::zeros();
        let [acceleration_now, jerk] = [acceleration, jerk].map(|value| value.unwrap_or(zero));
        for (quantity, unit, found, max) in [
            ("velocity", "m/s", linear(&twist), limits.velocity_m_s),
            ("acceleration", "m/s²", linear(&acceleration_now), limits.acceleration_m_s2),
            ("jerk", "m/s³", linear(&jerk), limits.jerk_m_s3),
            ("angular velocity", "rad/s", angular(&twist), limits.angular_velocity_rad_s),
            ("angular acceleration", "rad/s²", angular(&acceleration_now), limits.angular_acceleration_rad_s2),
            ("angular jerk", "rad/s³", angular(&jerk), limits.angular_jerk_rad_s3),
        ] {
            if found > max * (1.0 + ROUNDING) {
                return Err(Violation::Cartesian { time_secs, quantity, found, max, unit });
            }
        }
        Ok(Derivatives { ddq: before.ddq, twist: Some(twist), acceleration })
    }

    fn check_workspace(
        &self,
        time_secs: f64,
        part: &'static str,
        base_from_part: &Isometry3<f64>,
    ) -> Result<(), Violation> {
        let Some(workspace) = &self.workspace else { return Ok(()) };
        let p = base_from_part.translation.vector;
        for (k, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
            let (found_m, min_m, max_m) = (p[k], workspace.min_m[k], workspace.max_m[k]);
            if !(min_m..=max_m).contains(&found_m) {
                return Err(Violation::Workspace { time_secs, part, axis, found_m, min_m, max_m });
            }
        }
        Ok(())
    }

    /// The lowest part of the arm, with finger tips that extend beyond the tcp.
    pub(super) fn table_clearance(&self, q: &JointVector) -> Clearance {
        self.geometry.clearance_beyond(q, self.table_height_m, self.fingertip_beyond_tcp_m)
    }

    fn check_table(&self, time_secs: f64, q: &JointVector) -> Result<(), Violation> {
        let Clearance { part, lowest_m, .. } = self.table_clearance(q);
        let part = match part {
            ArmPart::FingerTips => "finger tips",
            ArmPart::Hand => "hand",
            ArmPart::Wrist => "wrist",
            ArmPart::Elbow => "elbow",
        };
        if lowest_m < self.min_table_clearance_m {
            let (found_mm, min_mm) = (lowest_m * 1e3, self.min_table_clearance_m * 1e3);
            return Err(Violation::Table { time_secs, part, found_mm, min_mm });
        }
        Ok(())
    }
}

/// Values of the last cycle, from which the derivatives of the next one are computed.
#[derive(Debug, Default)]
struct Derivatives {
    ddq: Option<JointVector>,
    /// Twist of the tcp, linear in m/s, angular in rad/s.
    twist: Option<Vector6<f64>>,
    acceleration: Option<Vector6<f64>>,
}

impl Derivatives {
    /// The joints' values of `self` with the tcp's values of `other`.
    fn cartesian_of(self, other: &Self) -> Self {
        Self { twist: other.twist, acceleration: other.acceleration, ..self }
    }
}

#[cfg(test)]
mod tests;
