//! The hand: its opening is controlled, and its pressing force is limited.
//!
//! Each finger follows a reference that moves at a limited speed towards the wanted opening. A stiff spring and a
//! damper act between finger and reference; the sum of their forces is clamped at the allowed force. In free space this
//! is position control; on a part the spring saturates, which is force control.

use crate::data::Data;
use crate::panda::{FINGER_TRAVEL_M, PandaIds};

/// Largest permanent force of each finger, in newtons.
pub const MAX_FINGER_FORCE_N: f64 = 70.0;

/// Stiffness of a finger in N/m: 22 Hz with the finger's mass and armature of 0.26 kg.
const STIFFNESS_N_M: f64 = 5000.0;
/// Nearly critical damping of a finger, in N·s/m.
const DAMPING_N_S_M: f64 = 65.0;

/// The state of the hand's control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gripper {
    /// Wanted position of each finger in metres.
    target_m: f64,
    /// The present reference, in metres.
    reference_m: f64,
    /// Speed of each finger in m/s.
    speed_m_s: f64,
    /// Largest force of each finger in newtons.
    max_force_n: f64,
}

impl Gripper {
    /// A hand that holds its present opening `opening_m`, the distance between the fingers in metres.
    pub fn at_opening_m(opening_m: f64) -> Self {
        let position = finger_position_m(opening_m);
        Self { target_m: position, reference_m: position, speed_m_s: 0.05, max_force_n: 30.0 }
    }

    /// Starts to move to an opening (distance between the fingers, 0 to 0.08 m), which changes at a speed (m/s).
    pub fn move_to(&mut self, opening_m: f64, speed_m_s: f64) {
        let target_m = finger_position_m(opening_m);
        *self = Self { target_m, speed_m_s: 0.5 * speed_m_s, max_force_n: 30.0, ..*self };
    }

    /// Starts to close until each finger presses with `force_n` newtons.
    pub fn grasp(&mut self, force_n: f64) {
        // The reference may move into the part as far as the spring needs for the largest force.
        let beyond = MAX_FINGER_FORCE_N / STIFFNESS_N_M;
        *self =
            Self { target_m: -beyond, speed_m_s: 0.05, max_force_n: force_n.clamp(0.0, MAX_FINGER_FORCE_N), ..*self };
    }

    /// Starts to move to an opening (m), which changes at a speed (m/s), with at most `force_n` at each finger. An
    /// opening below zero presses on an object between the fingers.
    pub fn drive(&mut self, opening_m: f64, speed_m_s: f64, force_n: f64) {
        let beyond = MAX_FINGER_FORCE_N / STIFFNESS_N_M;
        *self = Self {
            target_m: (0.5 * opening_m).clamp(-beyond, FINGER_TRAVEL_M),
            speed_m_s: 0.5 * speed_m_s,
            max_force_n: force_n.clamp(0.0, MAX_FINGER_FORCE_N),
            ..*self
        };
    }

    /// Sets the fingers' motors for this instant and advances the reference by `period_secs`.
    pub fn apply(&mut self, data: &mut Data, panda: &PandaIds, period_secs: f64) {
        let step = self.speed_m_s * period_secs;
        let velocity = (self.target_m - self.reference_m).clamp(-step, step) / period_secs;
        self.reference_m += velocity * period_secs;
        let (position, speed) = (panda.finger_position_m(data), panda.finger_velocity_m_s(data));
        // The reference stays close to a blocked finger, so that no force remains after the obstacle is gone.
        let lead = self.max_force_n / STIFFNESS_N_M;
        let mean = 0.5 * (position[0] + position[1]);
        self.reference_m = self.reference_m.clamp(mean - lead, mean + lead);
        for finger in 0..2 {
            let force =
                STIFFNESS_N_M * (self.reference_m - position[finger]) + DAMPING_N_S_M * (velocity - speed[finger]);
            data.ctrl_mut()[panda.finger_motors[finger].index()] = force.clamp(-self.max_force_n, self.max_force_n);
        }
    }
}

fn finger_position_m(opening_m: f64) -> f64 {
    (0.5 * opening_m).clamp(0.0, FINGER_TRAVEL_M)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sdg_kinematics::ready_pose;

    use super::*;
    use crate::controller::{ArmController, ArmReference};
    use crate::model::Model;
    use crate::panda::panda_asset;

    /// The arm in its ready pose with a block, fixed in the air, between its fingers.
    fn hand_around_a_block(half_width_m: f64) -> (Data, PandaIds) {
        let xml = format!(
            "<mujoco><compiler angle='radian'/><option timestep='0.001' integrator='implicit' cone='elliptic'/>\
             <include file='panda.xml'/><worldbody><geom name='block' type='box' size='0.02 {half_width_m} 0.02' \
             pos='0.3069 0 0.4869'/></worldbody></mujoco>"
        );
        let model = Arc::new(Model::from_xml(&xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        let mut data = Data::new(model).unwrap();
        ids.set_position(&mut data, &ready_pose());
        ids.set_finger_position_m(&mut data, 0.04);
        (data, ids)
    }

    fn run(data: &mut Data, ids: &PandaIds, gripper: &mut Gripper, num_steps: usize) {
        for _ in 0..num_steps {
            data.step1().unwrap();
            ArmController::default().apply(data, ids, &ArmReference::at_rest(ready_pose()));
            gripper.apply(data, ids, 1e-3);
            data.step2().unwrap();
        }
    }

    #[test]
    fn it_opens_as_far_as_it_is_told() {
        let (mut data, ids) = hand_around_a_block(0.001);
        let mut gripper = Gripper::at_opening_m(0.08);
        gripper.move_to(0.05, 0.2);
        run(&mut data, &ids, &mut gripper, 600);
        for position in ids.finger_position_m(&data) {
            assert!((position - 0.025).abs() < 2e-4, "{position}");
        }
    }

    #[test]
    fn it_opens_as_fast_as_it_is_told() {
        let (mut data, ids) = hand_around_a_block(0.001);
        ids.set_finger_position_m(&mut data, 0.015);
        let mut gripper = Gripper::at_opening_m(0.03);
        gripper.move_to(0.05, 0.05);
        // Opening by 20 mm takes 0.4 s.
        for (num_steps, expected_m) in [(350, 0.0475), (200, 0.05)] {
            run(&mut data, &ids, &mut gripper, num_steps);
            let opening_m: f64 = ids.finger_position_m(&data).iter().sum();
            assert!((opening_m - expected_m).abs() < 1e-3, "{opening_m}");
        }
    }

    #[test]
    fn it_presses_with_the_force_it_is_told() {
        let (mut data, ids) = hand_around_a_block(0.01);
        let mut gripper = Gripper::at_opening_m(0.08);
        gripper.grasp(40.0);
        run(&mut data, &ids, &mut gripper, 1500);
        let block = data.model().id("block").unwrap();
        for finger in 0..2 {
            let force: f64 = data
                .contacts()
                .filter(|contact| contact.geom1 == block || contact.geom2 == block)
                .filter(|contact| {
                    [contact.geom1, contact.geom2].iter().any(|&g| ids.finger_of(data.model(), g) == Some(finger))
                })
                .map(|contact| contact.normal_force_n)
                .sum();
            assert!((force - 40.0).abs() < 2.0, "finger {finger} presses with {force} N");
        }
        let position = ids.finger_position_m(&data);
        assert!((position[0] - 0.01).abs() < 5e-4 && (position[1] - 0.01).abs() < 5e-4, "{position:?}");
    }
}
