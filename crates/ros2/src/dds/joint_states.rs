//! The names of an arm's topics and actions, and the content of its joint_states.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::SVector;
use sdg_robot::ArmGeometry;

use super::panics::network_thread;
use super::topic::Subscription;
use crate::error::RosError;
use crate::messages::JointState;

pub(super) type Joints = SVector<f64, 7>;

/// An arm's geometry, and the names of its topics, actions and joints.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmConfig {
    /// The arm's links, limits and hand.
    pub geometry: ArmGeometry,
    /// The action FollowJointTrajectory.
    pub trajectory_action: String,
    /// The action GripperCommand.
    pub gripper_action: String,
    /// The topic of JointState.
    pub joint_states: String,
    /// The arm's seven joints from the base.
    pub joints: [String; 7],
    /// The joints whose positions sum to the opening between the fingers.
    pub finger_joints: Vec<String>,
    /// The gripper's position divided by the opening: 0.5 if the position is that of one finger.
    pub gripper_position_per_m: f64,
}

impl Default for ArmConfig {
    /// The names of franka_ros2 and of the Panda's MoveIt configuration.
    fn default() -> Self {
        Self {
            geometry: ArmGeometry::panda(),
            trajectory_action: "/panda_arm_controller/follow_joint_trajectory".to_owned(),
            gripper_action: "/panda_hand_controller/gripper_cmd".to_owned(),
            joint_states: "/joint_states".to_owned(),
            joints: std::array::from_fn(|idx| format!("panda_joint{}", idx + 1)),
            finger_joints: vec!["panda_finger_joint1".to_owned(), "panda_finger_joint2".to_owned()],
            gripper_position_per_m: 0.5,
        }
    }
}

/// The last content of joint_states.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) q: Joints,
    pub(super) dq: Joints,
    pub(super) opening_m: Option<f64>,
    /// Stamp of the message, s.
    pub(super) stamp_secs: f64,
    /// Arrival of the first message with this stamp. The checks of a motion compare stamps: a source whose stamp is
    /// constant counts as one that sends no states.
    pub(super) arrived: Instant,
}

/// Receives joint_states in a thread.
pub(super) struct StateReader {
    known: Arc<Mutex<Option<Known>>>,
    is_stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    pub(super) topic: String,
}

impl StateReader {
    pub(super) fn spawn(states: Subscription<JointState>, config: &ArmConfig) -> Result<Self, RosError> {
        let known = Arc::<Mutex<Option<Known>>>::default();
        let is_stopped = Arc::<AtomicBool>::default();
        let (shared, stop, config, topic) =
            (Arc::clone(&known), Arc::clone(&is_stopped), config.clone(), states.topic().to_owned());
        let thread = network_thread("joint states", move || {
            while !stop.load(Ordering::SeqCst) {
                // Malformed messages are skipped; missing states are reported by the functions that read the states.
                let Ok(Some(received)) = states.receive(Duration::from_millis(100)) else { continue };
                let mut known = shared.lock().unwrap_or_else(PoisonError::into_inner);
                *known = merged(*known, &received.message, received.arrived, &config).or(*known);
            }
        })?;
        Ok(Self { known, is_stopped, thread: Some(thread), topic })
    }

    pub(super) fn latest(&self) -> Option<Known> {
        *self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for StateReader {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Takes the message's values for the joints of arm and fingers. Messages with finger joints only are accepted once the
/// arm's joints are known, because drivers publish both on one topic.
fn merged(before: Option<Known>, message: &JointState, arrived: Instant, config: &ArmConfig) -> Option<Known> {
    let value = |values: &[f64], joint: &str| {
        let at = message.name.iter().position(|name| name == joint)?;
        values.get(at).copied()
    };
    let fingers: Option<Vec<f64>> = config.finger_joints.iter().map(|joint| value(&message.position, joint)).collect();
    let opening_m = fingers.filter(|fingers| !fingers.is_empty()).map(|fingers| fingers.iter().sum());
    let positions: Option<Vec<f64>> = config.joints.iter().map(|joint| value(&message.position, joint)).collect();
    match positions {
        Some(positions) => {
            let velocity = |joint: &String| value(&message.velocity, joint).unwrap_or(0.0);
            let stamp_secs = message.header.stamp.secs();
            let same = before.filter(|before| before.stamp_secs == stamp_secs);
            Some(Known {
                q: Joints::from_iterator(positions),
                dq: Joints::from_iterator(config.joints.iter().map(velocity)),
                opening_m: opening_m.or(before.and_then(|before| before.opening_m)),
                stamp_secs,
                arrived: same.map_or(arrived, |same| same.arrived),
            })
        }
        None => Some(Known { opening_m: Some(opening_m?), ..before? }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn states(names: &[&str], position: &[f64]) -> JointState {
        let name = names.iter().map(|name| (*name).to_owned()).collect();
        JointState { name, position: position.to_vec(), ..JointState::default() }
    }

    #[test]
    fn joints_are_found_by_name_and_fingers_may_come_apart() {
        let config = ArmConfig::default();
        let names: Vec<&str> = config.joints.iter().map(String::as_str).rev().collect();
        let now = Instant::now();
        let arm = merged(None, &states(&names, &[7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0]), now, &config).unwrap();
        assert_eq!((arm.q[0], arm.q[6], arm.opening_m), (1.0, 7.0, None));
        let fingers = states(&["panda_finger_joint1", "panda_finger_joint2"], &[0.02, 0.03]);
        assert!(merged(None, &fingers, now, &config).is_none(), "nothing is known of the arm yet");
        let both = merged(Some(arm), &fingers, now, &config).unwrap();
        assert_eq!((both.q[0], both.opening_m), (1.0, Some(0.05)));
        assert!(merged(None, &states(&names[1..], &[0.0; 6]), now, &config).is_none());
        assert!(merged(None, &states(&names, &[0.0; 3]), now, &config).is_none());
    }

    #[test]
    fn states_whose_stamp_does_not_advance_become_old() {
        let config = ArmConfig::default();
        let names: Vec<&str> = config.joints.iter().map(String::as_str).collect();
        let mut message = states(&names, &[0.0; 7]);
        let first = Instant::now();
        let later = first + Duration::from_secs(1);
        let known = merged(None, &message, first, &config);
        assert_eq!(merged(known, &message, later, &config).unwrap().arrived, first);
        message.header.stamp.nanosec = 1;
        assert_eq!(merged(known, &message, later, &config).unwrap().arrived, later);
    }
}
