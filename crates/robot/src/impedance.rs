//! Cartesian impedance: joint torques that make the tcp compliant like a spring, for contact.
//!
//! ```text
//! τ = Jᵀ (-K e - ∫ k_i K e dt - D (J q̇ - v_d))  +  (I - Jᵀ Jᵀ⁺) (k_n (q_n - q) - 2 √k_n q̇)  +  coriolis
//!     └ spring, its integral and damper of the tcp   └ spring of the elbow, without moving the tcp
//! ```
//! J is the tcp's Jacobian in the base frame, v_d the desired twist, and D = 2 √(K m) for a mass m of the tcp. e is the
//! deviation of the tcp from its desired pose: the translation in m, and about half of the rotation vector in rad. k_i
//! is the growth rate of the integral; k_n is the elbow's stiffness about its configuration q_n. Gravity is not
//! included: the robot adds it, also for a load that was set.
//!
//! A spring is not exact: at 150 N/m an unreported part of 0.7 kg pulls the tcp down by 46 mm, and joint friction of
//! 1 N·m causes an error of about 20 mm. In free air the integral compensates both; during contact it would press with
//! increasing force, and is therefore frozen.
//!
//! # Source
//! `cartesian_impedance_control.cpp` of libfranka's examples; the null space and the limit of the torque's rate as in
//! franka_ros.

use nalgebra::{Isometry3, SMatrix, Vector6};
use sdg_kinematics::{ArmGeometry, JointVector};

use crate::arm_state::PERIOD_SECS;
use crate::error::{Result, check_not_negative, check_positive};

/// Keeps the pseudoinverse bounded near singular poses.
const DAMPING: f64 = 1e-2;

/// Stiffness of the tcp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impedance {
    /// Stiffness along x, y and z of the base, N/m, and about them, N·m/rad.
    pub stiffness: Vector6<f64>,
    /// Mass of the tcp assumed by the damper, kg along and kg·m² about each direction: libfranka's example has 1 for
    /// all.
    pub mass: Vector6<f64>,
    /// Growth rate of the integral force in each direction, as a multiple of the spring's force per second, 1/s.
    pub integral_per_sec: Vector6<f64>,
    /// Stiffness of the elbow about its configuration at the start, N·m/rad.
    pub null_stiffness: f64,
    /// Largest change of a joint's torque per cycle, N·m; the robot stops above 1 N·m.
    pub max_torque_step_nm: f64,
}

impl Impedance {
    /// libfranka's example in all directions: 150 N/m and 10 N·m/rad.
    pub const SOFT: Self = Self {
        stiffness: Vector6::new(150.0, 150.0, 150.0, 10.0, 10.0, 10.0),
        mass: Vector6::new(1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
        integral_per_sec: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        null_stiffness: 10.0,
        max_torque_step_nm: 0.9,
    };
    /// Stiff in all directions, with integral action: for free air. The damping is for the arm's own mass at the tcp,
    /// about 5 kg; with less damping, integral action makes the tcp oscillate.
    pub const FREE_AIR: Self = Self {
        stiffness: Vector6::new(1000.0, 1000.0, 1000.0, 50.0, 50.0, 50.0),
        mass: Vector6::new(5.0, 5.0, 5.0, 1.0, 1.0, 1.0),
        integral_per_sec: Vector6::new(5.0, 5.0, 5.0, 5.0, 5.0, 5.0),
        null_stiffness: 10.0,
        max_torque_step_nm: 0.9,
    };
    /// Soft along z, stiff sideways and in rotation: for pressing on a surface.
    pub const SOFT_DOWN: Self = Self {
        stiffness: Vector6::new(1000.0, 1000.0, 150.0, 50.0, 50.0, 50.0),
        mass: Vector6::new(5.0, 5.0, 1.0, 1.0, 1.0, 1.0),
        integral_per_sec: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        null_stiffness: 10.0,
        max_torque_step_nm: 0.9,
    };
}

impl Impedance {
    /// Checks that every value is finite, of the right sign and not above its maximum. `when` completes the names in
    /// the error.
    ///
    /// # Errors
    /// [`RobotError::Configuration`](crate::RobotError::Configuration).
    pub(crate) fn validate(&self, when: &str) -> Result<()> {
        /// Along and about each direction, N/m and N·m/rad. At 1000 N/m, a reference 15 mm ahead of the tcp presses
        /// with 15 N.
        const MAX_STIFFNESS: [f64; 2] = [1000.0, 100.0];
        /// Roughly the mass of an arm, kg; the same number limits the rotational values, kg·m².
        const MAX_MASS: f64 = 20.0;
        const MAX_INTEGRAL_PER_SEC: f64 = 10.0;
        const MAX_NULL_STIFFNESS: f64 = 100.0;
        /// Above this step the robot stops.
        const MAX_TORQUE_STEP_NM: f64 = 1.0;
        for idx in 0..6 {
            let is_turn = idx >= 3;
            let axis = format!("{} {}", if is_turn { "about" } else { "along" }, ["x", "y", "z"][idx % 3]);
            let [stiffness_unit, mass_unit] = if is_turn { ["N·m/rad", "kg·m²"] } else { ["N/m", "kg"] };
            let max_stiffness = MAX_STIFFNESS[usize::from(is_turn)];
            check_positive(
                &format!("stiffness {axis} {when} in {stiffness_unit}"),
                self.stiffness[idx],
                max_stiffness,
            )?;
            check_positive(&format!("mass {axis} {when} in {mass_unit}"), self.mass[idx], MAX_MASS)?;
            let integral = self.integral_per_sec[idx];
            check_not_negative(&format!("integral {axis} {when} in 1/s"), integral, MAX_INTEGRAL_PER_SEC)?;
        }
        let elbow = format!("stiffness of the elbow {when} in N·m/rad");
        check_not_negative(&elbow, self.null_stiffness, MAX_NULL_STIFFNESS)?;
        let step = format!("change of torque per cycle {when} in N·m");
        check_positive(&step, self.max_torque_step_nm, MAX_TORQUE_STEP_NM)
    }
}

/// The desired state of the tcp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TcpReference {
    /// The pose.
    pub base_from_tcp: Isometry3<f64>,
    /// The velocity of the tcp, m/s and rad/s in the base frame.
    pub twist: Vector6<f64>,
}

/// The control law with its state between cycles.
#[derive(Debug, Clone)]
pub struct ImpedanceControl {
    impedance: Impedance,
    q_null: JointVector,
    torque: JointVector,
    /// Force and torque of the integral, N and N·m.
    integral: Vector6<f64>,
}

/// Largest force and torque of the integral, N and N·m.
const MAX_INTEGRAL: Vector6<f64> = Vector6::new(15.0, 15.0, 15.0, 5.0, 5.0, 5.0);

impl ImpedanceControl {
    /// Starts at joint positions `q` (rad), to which the elbow's spring pulls, after a last `torque` (N·m, without
    /// gravity).
    pub fn new(impedance: Impedance, q: JointVector, torque: JointVector) -> Self {
        Self { impedance, q_null: q, torque, integral: Vector6::zeros() }
    }

    /// Continues with another stiffness; force and torque of the integral are kept.
    pub fn change(&mut self, impedance: Impedance) {
        self.impedance = impedance;
    }

    /// The torques of the next cycle (N·m) for measured joint positions (rad) and velocities (rad/s). `coriolis` may be
    /// zero if the robot does not report it: at contact speeds it is smaller than friction.
    pub fn torque(
        &mut self,
        arm: &ArmGeometry,
        q: &JointVector,
        dq: &JointVector,
        reference: &TcpReference,
        coriolis: &JointVector,
    ) -> JointVector {
        let (base_from_tcp, jacobian) = arm.forward_and_jacobian(q);
        let Impedance { stiffness, mass, integral_per_sec, null_stiffness, max_torque_step_nm } = self.impedance;
        let spring = stiffness.component_mul(&pose_error(&base_from_tcp, &reference.base_from_tcp));
        self.integral += spring.component_mul(&integral_per_sec) * PERIOD_SECS;
        self.integral = self.integral.sup(&-MAX_INTEGRAL).inf(&MAX_INTEGRAL);
        let damping = stiffness.component_mul(&mass).map(|value| 2.0 * value.sqrt());
        let force = -spring - self.integral - damping.component_mul(&(jacobian * dq - reference.twist));
        let wanted_null = (self.q_null - q) * null_stiffness - dq * (2.0 * null_stiffness.sqrt());
        let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * (DAMPING * DAMPING);
        // The force with which the elbow's torque would press at the tcp; it is subtracted below. `square` is positive
        // definite, so that its Cholesky factor exists.
        let pressing = square.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&(jacobian * wanted_null)));
        let wanted = jacobian.transpose() * (force - pressing) + wanted_null + coriolis;
        self.torque = JointVector::from_fn(|joint, _| {
            let last = self.torque[joint];
            wanted[joint].clamp(last - max_torque_step_nm, last + max_torque_step_nm)
        });
        self.torque
    }

    /// The torques of the last cycle, N·m.
    pub fn last_torque(&self) -> &JointVector {
        &self.torque
    }
}

/// Deviation of a pose from the desired one: m, and the vector part of the quaternion between them, in the base frame.
pub(crate) fn pose_error(base_from_tcp: &Isometry3<f64>, wanted: &Isometry3<f64>) -> Vector6<f64> {
    let translation = base_from_tcp.translation.vector - wanted.translation.vector;
    let tcp_from_wanted = base_from_tcp.rotation.inverse() * wanted.rotation;
    // Of the two quaternions of a rotation, this sign selects the one with the smaller angle.
    let sign = if tcp_from_wanted.w < 0.0 { -1.0 } else { 1.0 };
    let rotation = base_from_tcp.rotation * (tcp_from_wanted.imag() * -sign);
    Vector6::new(translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use sdg_kinematics::ready_pose;

    fn still(base_from_tcp: Isometry3<f64>) -> TcpReference {
        TcpReference { base_from_tcp, twist: Vector6::zeros() }
    }

    /// The torques of an arm held at `q`, once their rate is no longer limited.
    fn settled(impedance: Impedance, q_null: JointVector, q: &JointVector, wanted: Isometry3<f64>) -> JointVector {
        let mut control = ImpedanceControl::new(impedance, q_null, JointVector::zeros());
        let zero = JointVector::zeros();
        for _ in 0..200 {
            control.torque(&ArmGeometry::panda(), q, &zero, &still(wanted), &zero);
        }
        *control.last_torque()
    }

    #[test]
    fn a_tcp_beside_its_place_is_pressed_back_by_its_stiffness() {
        let (panda, q) = (ArmGeometry::panda(), ready_pose());
        let (here, jacobian) = panda.forward_and_jacobian(&q);
        assert!(settled(Impedance::SOFT, q, &q, here).amax() < 1e-12);
        // 10 mm too low at 150 N/m: 1.5 N up.
        let mut wanted = here;
        wanted.translation.z += 0.010;
        let torque = settled(Impedance::SOFT, q, &q, wanted);
        let expected = jacobian.transpose() * Vector6::new(0.0, 0.0, 1.5, 0.0, 0.0, 0.0);
        assert!((torque - expected).amax() < 1e-9, "{torque} {expected}");
        // The stiffness depends on the direction: 10 mm sideways at 1000 N/m.
        let mut wanted = here;
        wanted.translation.y += 0.010;
        let torque = settled(Impedance::SOFT_DOWN, q, &q, wanted);
        let expected = jacobian.transpose() * Vector6::new(0.0, 10.0, 0.0, 0.0, 0.0, 0.0);
        assert!((torque - expected).amax() < 1e-9, "{torque} {expected}");
        // A rotation by 0.1 rad: the sine of half the angle, at 10 N·m/rad.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.1);
        let wanted = Isometry3::from_parts(here.translation, turn * here.rotation);
        let torque = settled(Impedance::SOFT, q, &q, wanted);
        let expected = jacobian.transpose() * Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * 0.05_f64.sin());
        assert!((torque - expected).amax() < 1e-9, "{torque} {expected}");
    }

    #[test]
    fn the_integral_grows_with_the_error_up_to_its_limit_and_stays_when_the_stiffness_changes() {
        let (panda, q, zero) = (ArmGeometry::panda(), ready_pose(), JointVector::zeros());
        let (here, jacobian) = panda.forward_and_jacobian(&q);
        let mut wanted = here;
        wanted.translation.z -= 0.001;
        let mut control = ImpedanceControl::new(Impedance::FREE_AIR, q, zero);
        for _ in 0..500 {
            control.torque(&panda, &q, &zero, &still(wanted), &zero);
        }
        // 1 mm at 1000 N/m is 1 N; at 5/s the integral adds 2.5 N in half a second.
        let expected = jacobian.transpose() * Vector6::new(0.0, 0.0, -3.5, 0.0, 0.0, 0.0);
        assert!((control.last_torque() - expected).amax() < 1e-6, "{}", control.last_torque());
        for _ in 0..8000 {
            control.torque(&panda, &q, &zero, &still(wanted), &zero);
        }
        control.change(Impedance::SOFT_DOWN);
        for _ in 0..500 {
            control.torque(&panda, &q, &zero, &still(here), &zero);
        }
        let expected = jacobian.transpose() * Vector6::new(0.0, 0.0, -15.0, 0.0, 0.0, 0.0);
        assert!((control.last_torque() - expected).amax() < 1e-6, "{}", control.last_torque());
    }

    #[test]
    fn the_elbows_spring_does_not_press_with_the_tcp() {
        let (panda, q) = (ArmGeometry::panda(), ready_pose());
        let (here, jacobian) = panda.forward_and_jacobian(&q);
        let mut q_null = q;
        q_null[2] += 0.5;
        let torque = settled(Impedance::SOFT, q_null, &q, here);
        assert!(torque.amax() > 0.1, "{torque}");
        // The tcp's force that balances these torques.
        let square = jacobian * jacobian.transpose();
        let force = square.cholesky().unwrap().solve(&(jacobian * torque));
        assert!(force.amax() < 0.02, "{force}");
    }

    #[test]
    fn velocity_is_damped_and_torques_change_by_steps() {
        let (panda, q) = (ArmGeometry::panda(), ready_pose());
        let here = panda.forward(&q);
        let (zero, mut dq) = (JointVector::zeros(), JointVector::zeros());
        dq[3] = 0.5;
        let mut control = ImpedanceControl::new(Impedance::SOFT, q, zero);
        let mut last = zero;
        for _ in 0..50 {
            let torque = control.torque(&panda, &q, &dq, &still(here), &zero);
            assert!((torque - last).amax() <= Impedance::SOFT.max_torque_step_nm + 1e-12);
            last = torque;
        }
        // The damping torques remove power from the motion.
        assert!(last.dot(&dq) < 0.0, "{last}");
        // Known Coriolis torques are added.
        let mut coriolis = zero;
        coriolis[1] = 0.3;
        let with = ImpedanceControl::new(Impedance::SOFT, q, zero).torque(&panda, &q, &zero, &still(here), &coriolis);
        assert!((with - coriolis).amax() < 1e-12);
    }
}
