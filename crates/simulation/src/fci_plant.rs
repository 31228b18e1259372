//! The workcell's Panda for the Franka Control Interface: `sdg_fci`'s server commands its torques and its hand.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Isometry3, SMatrix, Vector3};
use sdg_fci::server::{Jacobian, JointVector, Observation, Plant};
use sdg_kinematics::{ArmGeometry, ready_pose};
use sdg_robot::PERIOD_SECS;

use crate::compliant::friction_torque_nm;
use crate::data::Data;
use crate::error::Result;
use crate::gripper::Gripper;
use crate::model::Model;
use crate::panda::{FINGER_TRAVEL_M, NUM_ARM_JOINTS, PANDA_FILE, PandaIds, panda_asset};
use crate::self_distance::LinkCapsules;
use crate::workcell::{WorkcellConfig, build_model};

/// The generalised positions of a plant, for readers while a server owns it; see [`PandaPlant::positions`].
#[derive(Debug, Clone, Default)]
pub struct SharedPositions(Arc<Mutex<Vec<f64>>>);

impl SharedPositions {
    /// Positions after the last step, in the order of [`Data::qpos`].
    pub fn get(&self) -> Vec<f64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set(&self, qpos: &[f64]) {
        let mut positions = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        positions.clear();
        positions.extend_from_slice(qpos);
    }
}

/// A Panda with its hand at a table, driven by torques.
pub struct PandaPlant {
    data: Data,
    ids: PandaIds,
    panda: ArmGeometry,
    gripper: Gripper,
    capsules: LinkCapsules,
    /// Arm and hand alone, at rest, for computing the torques of gravity.
    standing: (Data, PandaIds),
    positions: SharedPositions,
    /// Dry friction of each joint, N·m.
    friction_nm: f64,
}

impl PandaPlant {
    /// Creates a scene with the arm at rest in its ready pose and the hand open.
    ///
    /// # Errors
    /// `Model` if MuJoCo rejects the scene, `Library` for the wrong libmujoco, `TooManyContacts` for a crowded scene,
    /// `Configuration` for a camera lens whose model does not cover the corners of its own picture.
    pub fn new(config: &WorkcellConfig) -> Result<Self> {
        let model = build_model(config, "")?;
        let ids = PandaIds::find(&model)?;
        let mut data = Data::new(model)?;
        ids.set_position(&mut data, &ready_pose());
        ids.set_finger_position_m(&mut data, FINGER_TRAVEL_M);
        Self::from_data(data, ids)
    }

    /// Like [`PandaPlant::new`], but with everything at rest at the positions `qpos` ([`Data::qpos`]) of a workcell of
    /// the same configuration.
    ///
    /// # Errors
    /// As for [`PandaPlant::new`].
    ///
    /// # Panics
    /// If the number of positions differs from that of the scene.
    pub fn with_positions(config: &WorkcellConfig, qpos: &[f64]) -> Result<Self> {
        let model = build_model(config, "")?;
        let ids = PandaIds::find(&model)?;
        let mut data = Data::new(model)?;
        data.qpos_mut().copy_from_slice(qpos);
        Self::from_data(data, ids)
    }

    fn from_data(mut data: Data, ids: PandaIds) -> Result<Self> {
        data.forward()?;
        data.step1()?;
        let xml = format!("<mujoco><compiler angle='radian'/><include file='{PANDA_FILE}'/></mujoco>");
        let alone = Arc::new(Model::from_xml(&xml, &[panda_asset()])?);
        let standing_ids = PandaIds::find(&alone)?;
        let capsules = LinkCapsules::find(data.model());
        let opening_m = ids.finger_position_m(&data).iter().sum();
        let positions = SharedPositions::default();
        positions.set(data.qpos());
        Ok(Self {
            data,
            ids,
            panda: ArmGeometry::panda(),
            gripper: Gripper::at_opening_m(opening_m),
            capsules,
            standing: (Data::new(alone)?, standing_ids),
            positions,
            friction_nm: 0.0,
        })
    }

    /// Adds dry friction (N·m) to every joint, which the robot does not compensate.
    #[must_use]
    pub fn with_friction_nm(self, friction_nm: f64) -> Self {
        Self { friction_nm, ..self }
    }

    /// The positions of all objects, updated while the plant moves.
    pub fn positions(&self) -> SharedPositions {
        self.positions.clone()
    }

    fn gravity(&mut self) -> JointVector {
        let (alone, ids) = &mut self.standing;
        let q = self.ids.position(&self.data);
        ids.set_position(alone, &q);
        // The error is ignored: a posture that is stable in the scene is stable here.
        let _ = alone.step1();
        JointVector::from_fn(|joint, _| alone.qfrc_bias()[ids.qvel_indices()[joint]])
    }
}

impl Plant for PandaPlant {
    fn observe(&mut self) -> Observation {
        let gravity = self.gravity();
        let joints = *self.ids.qvel_indices();
        let pick = |values: &[f64]| JointVector::from_fn(|joint, _| values[joints[joint]]);
        let mass = self.data.mass_matrix();
        Observation {
            q: self.ids.position(&self.data),
            dq: self.ids.velocity(&self.data),
            mass: SMatrix::<f64, NUM_ARM_JOINTS, NUM_ARM_JOINTS>::from_fn(|row, column| {
                mass[(joints[row], joints[column])]
            }),
            gravity,
            coriolis: pick(self.data.qfrc_bias()) - gravity,
            contact_torque: pick(self.data.qfrc_constraint()),
            self_collision: self.capsules.distance_m(&self.data) <= 0.0,
        }
    }

    fn flange(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian) {
        let frames = self.panda.frames(q);
        let flange = frames.base_from_flange;
        let mut jacobian = Jacobian::zeros();
        for (joint, base_from_link) in frames.base_from_link.iter().enumerate() {
            let axis = base_from_link.rotation * Vector3::z();
            let lever = flange.translation.vector - base_from_link.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&axis.cross(&lever));
            jacobian.fixed_view_mut::<3, 1>(3, joint).copy_from(&axis);
        }
        (flange, jacobian)
    }

    fn step(&mut self, torque: &JointVector) -> std::result::Result<(), String> {
        let joints = *self.ids.qvel_indices();
        let dq = self.ids.velocity(&self.data);
        for joint in 0..NUM_ARM_JOINTS {
            // The robot's own control compensates the joints' damping, but not the added dry friction.
            let compensated = self.data.qfrc_passive()[joints[joint]];
            let friction = friction_torque_nm(self.friction_nm, dq[joint]);
            self.data.ctrl_mut()[self.ids.motors[joint].index()] = torque[joint] - compensated - friction;
        }
        self.gripper.apply(&mut self.data, &self.ids, PERIOD_SECS);
        self.data.step2().map_err(|error| error.to_string())?;
        self.data.step1().map_err(|error| error.to_string())?;
        self.positions.set(self.data.qpos());
        Ok(())
    }

    fn move_hand(&mut self, width_m: f64, speed_m_s: f64, force_n: f64) {
        // The fingers start from their present position: the reference of earlier pressing is up to 14 mm beyond it,
        // and would have to return first.
        self.gripper = Gripper::at_opening_m(self.hand_width().0);
        self.gripper.drive(width_m, speed_m_s, force_n);
    }

    fn hand_width(&self) -> (f64, f64) {
        let width = self.ids.finger_position_m(&self.data).iter().sum();
        (width, self.ids.finger_velocity_m_s(&self.data).iter().sum())
    }
}
