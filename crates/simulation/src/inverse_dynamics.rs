//! MuJoCo's inverse dynamics of the arm, as a reference for the torques of `sdg-kinematics`.

use std::sync::Arc;

use crate::data::Data;
use crate::error::Result;
use crate::model::{Asset, Body, Model};
use crate::panda::{ArmVector, NUM_ARM_JOINTS, PANDA_FILE, PandaIds, panda_asset};

/// The simulated Panda alone, with fingers at rest in the hand; there are no time steps.
pub struct InverseDynamics {
    data: Data,
    ids: PandaIds,
}

impl InverseDynamics {
    /// The arm with its fingers at an opening (m).
    ///
    /// # Errors
    /// As for [`Model::from_xml`].
    pub fn new(opening_m: f64) -> Result<Self> {
        Self::with_load(opening_m, 0.0, [0.0; 3])
    }

    /// The arm with a point load: its mass (kg) and its position in the flange's frame (m).
    ///
    /// # Errors
    /// As for [`Model::from_xml`].
    pub fn with_load(opening_m: f64, mass_kg: f64, center_in_flange_m: [f64; 3]) -> Result<Self> {
        let mut text = String::from_utf8_lossy(&panda_asset().bytes).into_owned();
        if mass_kg > 0.0 {
            let [x, y, z] = center_in_flange_m;
            // MuJoCo requires an inertia; this one is negligible.
            let load = format!(
                "<body name=\"load\" pos=\"0 0 {}\"><inertial mass=\"{mass_kg}\" pos=\"{x} {y} {z}\" diaginertia=\"1e-12 1e-12 1e-12\"/></body>",
                sdg_kinematics::ArmGeometry::panda().flange_offset_m
            );
            let hand = "<!-- Flange 0.107 m on";
            text = text.replacen(hand, &format!("{load}{hand}"), 1);
        }
        let xml = format!(
            "<mujoco><compiler angle=\"radian\"/><option><flag contact=\"disable\" limit=\"disable\"/></option>\
             <include file=\"{PANDA_FILE}\"/></mujoco>"
        );
        let model =
            Arc::new(Model::from_xml(&xml, &[Asset { name: PANDA_FILE.to_owned(), bytes: text.into_bytes() }])?);
        let ids = PandaIds::find(&model)?;
        assert_eq!(model.id::<Body>("load").is_ok(), mass_kg > 0.0, "the load is in the hand");
        let mut data = Data::new(model)?;
        ids.set_finger_position_m(&mut data, 0.5 * opening_m);
        Ok(Self { data, ids })
    }

    /// The torques (N·m) of a motion: positions in rad, velocities in rad/s, accelerations in rad/s².
    ///
    /// # Errors
    /// [`crate::SimulationError::MuJoCo`] if MuJoCo stops. Numbers that are not finite are no error.
    pub fn torques_nm(&mut self, q: &ArmVector, velocity: &ArmVector, acceleration: &ArmVector) -> Result<ArmVector> {
        self.ids.set_position(&mut self.data, q);
        let joints = *self.ids.qvel_indices();
        for joint in 0..NUM_ARM_JOINTS {
            self.data.qvel_mut()[joints[joint]] = velocity[joint];
        }
        self.data.forward()?;
        let mass = self.data.mass_matrix();
        let (bias, passive) = (self.data.qfrc_bias(), self.data.qfrc_passive());
        Ok(ArmVector::from_fn(|row, _| {
            let inertial: f64 =
                (0..NUM_ARM_JOINTS).map(|column| mass[(joints[row], joints[column])] * acceleration[column]).sum();
            inertial + bias[joints[row]] - passive[joints[row]]
        }))
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;
    use sdg_kinematics::ArmGeometry;
    use sdg_kinematics::dynamics::ArmDynamics;

    use super::*;

    #[test]
    fn torques_are_mujocos() {
        // Allows for rounding over seven links: MuJoCo stores quaternions, and rotations in its XML have 16 digits.
        const TOLERANCE: f64 = 1e-9;
        let mut rng = Pcg64::seed_from_u64(71);
        for load in [None, Some((0.7, [0.02, -0.01, 0.15])), Some((3.0, [0.0, 0.0, 0.1034]))] {
            let opening_m = rng.random_range(0.0..0.08);
            let arm = ArmGeometry::panda();
            let mut dynamics = ArmDynamics::new(&arm, opening_m);
            let (mass_kg, center_m) = load.unwrap_or((0.0, [0.0; 3]));
            if load.is_some() {
                dynamics = dynamics.with_load(mass_kg, center_m);
            }
            let mut mujoco = InverseDynamics::with_load(opening_m, mass_kg, center_m).unwrap();
            for _ in 0..200 {
                let q = ArmVector::from_fn(|joint, _| {
                    rng.random_range(arm.limits.position_min[joint]..arm.limits.position_max[joint])
                });
                let qd = ArmVector::from_fn(|_, _| rng.random_range(-2.5..2.5));
                let qdd = ArmVector::from_fn(|_, _| rng.random_range(-15.0..15.0));
                let expected = mujoco.torques_nm(&q, &qd, &qdd).unwrap();
                let error = dynamics.torques_nm(&q, &qd, &qdd) - expected;
                let relative = error.component_div(&arm.limits.torque_max).amax();
                assert!(relative < TOLERANCE, "{relative}: {error}, {expected}");
            }
        }
    }
}
