//! The simulated Panda driven by torques, with force measurement, for compliant descents.

use nalgebra::{SMatrix, Vector3, Vector6};
use sdg_kinematics::dynamics::GRAVITY_M_S2;
use sdg_kinematics::{ArmGeometry, JointVector};
use sdg_robot::{CompliantArm, Descent, Load, PERIOD_SECS, RobotError, TouchDown, Touched, Watch};

use crate::controller::ArmReference;
use crate::data::Data;
use crate::error::Result;
use crate::panda::{NUM_ARM_JOINTS, PandaIds};
use crate::workcell::Workcell;

/// Velocity above which most of the friction acts, rad/s; a lower value would require a shorter time step.
const FULL_FRICTION_RAD_S: f64 = 0.02;
/// Cut-off frequency of the measured force, Hz; a robot also filters its estimate.
const CUTOFF_HZ: f64 = 30.0;
/// Damping that keeps the least squares bounded at singular poses.
const DAMPING: f64 = 1e-4;

/// Torque of a joint's dry friction at a velocity (rad/s), N·m.
pub(crate) fn friction_torque_nm(friction_nm: f64, velocity_rad_s: f64) -> f64 {
    friction_nm * (velocity_rad_s / FULL_FRICTION_RAD_S).tanh()
}

/// Joint torques that hold a load against gravity, N·m.
fn load_torque(panda: &ArmGeometry, q: &JointVector, load: &Load) -> JointVector {
    let frames = panda.frames(q);
    let center = frames.base_from_flange * nalgebra::Point3::from(load.center_in_flange_m);
    let weight = Vector3::new(0.0, 0.0, load.mass_kg * GRAVITY_M_S2);
    JointVector::from_fn(|joint, _| {
        let base_from_link = &frames.base_from_link[joint];
        let axis = base_from_link.rotation * Vector3::z();
        axis.cross(&(center.coords - base_from_link.translation.vector)).dot(&weight)
    })
}

/// The vertical external force on the hand, upwards, N: by least squares from the contact torques of the joints.
fn felt_n(panda: &ArmGeometry, ids: &PandaIds, data: &Data) -> f64 {
    let joints = ids.qvel_indices();
    let torque = JointVector::from_fn(|joint, _| data.qfrc_constraint()[joints[joint]]);
    if torque == JointVector::zeros() {
        return 0.0;
    }
    let jacobian = panda.jacobian(&ids.position(data));
    let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * DAMPING;
    square.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&(jacobian * torque))).z
}

impl Workcell {
    /// Updates the filtered vertical force on the hand and its largest absolute value.
    pub(crate) fn feel(&mut self) {
        let gain = PERIOD_SECS / (PERIOD_SECS + 1.0 / (std::f64::consts::TAU * CUTOFF_HZ));
        self.felt_n += (felt_n(&self.panda, &self.panda_ids, &self.data) - self.felt_n) * gain;
        self.peak_felt_n = self.peak_felt_n.max(self.felt_n.abs());
    }

    /// The largest absolute value of the vertical force on the hand since the last call, N, as a robot estimates it.
    /// The force includes the load's weight.
    pub fn take_peak_felt_n(&mut self) -> f64 {
        std::mem::take(&mut self.peak_felt_n)
    }

    /// Advances one period: the motors get `torque`, plus the torques that hold the arm and its load, minus friction.
    fn torque_tick(&mut self, torque: &JointVector) -> Result<()> {
        let q = self.panda_ids.position(&self.data);
        let dq = self.panda_ids.velocity(&self.data);
        let joints = *self.panda_ids.qvel_indices();
        let load = load_torque(&self.panda, &q, &self.load);
        for joint in 0..NUM_ARM_JOINTS {
            let held = self.data.qfrc_bias()[joints[joint]] - self.data.qfrc_passive()[joints[joint]] + load[joint];
            let friction = friction_torque_nm(self.config().errors.joint_friction_nm, dq[joint]);
            let max = self.controller.max_torque_nm[joint];
            self.data.ctrl_mut()[self.panda_ids.motors[joint].index()] =
                (torque[joint] + held - friction).clamp(-max, max);
        }
        self.gripper.apply(&mut self.data, &self.panda_ids, PERIOD_SECS);
        self.data.step2()?;
        self.data.step1()?;
        self.look_on()
    }
}

impl CompliantArm for Workcell {
    fn touch_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> sdg_robot::Result<Touched> {
        self.data.step1().map_err(RobotError::from)?;
        let panda = self.panda.clone();
        let mut descent = Descent::new(*touch_down, &panda, self.panda_ids.position(&self.data), JointVector::zeros());
        loop {
            let (q, dq) = (self.panda_ids.position(&self.data), self.panda_ids.velocity(&self.data));
            let (torque, is_last) = descent.next(&panda, &q, &dq, self.felt_n);
            self.torque_tick(&torque)?;
            // Position control continues at the arm's present position.
            self.set_reference(ArmReference::at_rest(self.panda_ids.position(&self.data)));
            if let Some(reason) = self.observe_moving(watch)? {
                return Err(RobotError::Stopped(reason));
            }
            if is_last {
                return Ok(descent.touched());
            }
        }
    }
}
