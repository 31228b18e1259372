//! The client's settings: frames, load, impedances, thresholds.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::plant::JointVector;
use crate::pose::{is_rigid, isometry};
use crate::wire::{CollisionBehavior, Load, Request, Status};

/// Bounds of the internal controllers' stiffnesses, as libfranka documents them.
const MAX_JOINT_STIFFNESS: f64 = 14250.0;
const TRANSLATION_STIFFNESS: std::ops::RangeInclusive<f64> = 10.0..=3000.0;
const ROTATION_STIFFNESS: std::ops::RangeInclusive<f64> = 1.0..=300.0;
/// Largest accepted load. The payload of a Panda is 3 kg; a load above the robot's own mass is probably in wrong units.
const MAX_LOAD_KG: f64 = 18.0;

/// Mass of Franka's hand, kg.
pub const HAND_MASS_KG: f64 = 0.73;
/// Centre of mass of Franka's hand in the flange's frame, m.
pub const HAND_CENTER_M: [f64; 3] = [-0.01, 0.0, 0.03];
/// Inertia of Franka's hand about its centre of mass, column by column, kg·m².
pub const HAND_INERTIA: [f64; 9] = [0.001, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.0017];

/// The settings of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Nominal end effector relative to the flange: Franka's hand, rotated by -45°, with its tip at 0.1034 m.
    pub flange_from_ne: Isometry3<f64>,
    /// End effector relative to the nominal one.
    pub ne_from_ee: Isometry3<f64>,
    /// Stiffness frame relative to the end effector.
    pub ee_from_stiffness: Isometry3<f64>,
    /// The load of the robot in addition to its hand.
    pub load: Load,
    /// Stiffness of the joints, N·m/rad.
    pub joint_stiffness: JointVector,
    /// Cartesian stiffness, N/m and N·m/rad.
    pub cartesian_stiffness: [f64; 6],
    /// Thresholds at which contacts are reported and collisions stop the robot.
    pub collision: CollisionBehavior,
}

impl Default for Settings {
    fn default() -> Self {
        let torque = [20.0, 20.0, 18.0, 18.0, 16.0, 14.0, 12.0];
        let force = [20.0, 20.0, 20.0, 25.0, 25.0, 25.0];
        Self {
            flange_from_ne: Isometry3::from_parts(
                Translation3::new(0.0, 0.0, 0.1034),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_4),
            ),
            ne_from_ee: Isometry3::identity(),
            ee_from_stiffness: Isometry3::identity(),
            load: Load::default(),
            joint_stiffness: JointVector::from([3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0]),
            cartesian_stiffness: [3000.0, 3000.0, 3000.0, 300.0, 300.0, 300.0],
            collision: CollisionBehavior::new(torque, torque, force, force),
        }
    }
}

impl Settings {
    /// The end effector relative to the flange.
    pub fn flange_from_ee(&self) -> Isometry3<f64> {
        self.flange_from_ne * self.ne_from_ee
    }

    /// Executes a setter and returns the answer; `None` for a request that sets nothing.
    pub fn set(&mut self, request: &Request) -> Option<Status> {
        Some(match self.accept(request)? {
            true => Status::Success,
            false => Status::InvalidArgument,
        })
    }

    fn accept(&mut self, request: &Request) -> Option<bool> {
        let is_accepted = match request {
            Request::SetCollisionBehavior(behavior) => {
                let is_valid = is_positive(behavior);
                if is_valid {
                    self.collision = *behavior;
                }
                is_valid
            }
            Request::SetJointImpedance(stiffness) => {
                let is_valid = stiffness.iter().all(|value| (0.0..=MAX_JOINT_STIFFNESS).contains(value));
                if is_valid {
                    self.joint_stiffness = JointVector::from(*stiffness);
                }
                is_valid
            }
            Request::SetCartesianImpedance(stiffness) => {
                let is_valid = stiffness[..3].iter().all(|value| TRANSLATION_STIFFNESS.contains(value))
                    && stiffness[3..].iter().all(|value| ROTATION_STIFFNESS.contains(value));
                if is_valid {
                    self.cartesian_stiffness = *stiffness;
                }
                is_valid
            }
            Request::SetEeToStiffness(transform) => {
                let is_valid = is_rigid(transform);
                if is_valid {
                    self.ee_from_stiffness = isometry(transform);
                }
                is_valid
            }
            Request::SetNeToEe(transform) => {
                let is_valid = is_rigid(transform);
                if is_valid {
                    self.ne_from_ee = isometry(transform);
                }
                is_valid
            }
            Request::SetLoad(load) => {
                let is_valid = (0.0..=MAX_LOAD_KG).contains(&load.mass)
                    && load.center.iter().chain(&load.inertia).all(|value| value.is_finite());
                if is_valid {
                    self.load = *load;
                }
                is_valid
            }
            // Hand guiding and filters have no effect on the simulated robot.
            Request::SetGuidingMode(_) => true,
            Request::SetFilters(frequencies) => frequencies.iter().all(|value| *value > 0.0 && *value <= 1000.0),
            _ => return None,
        };
        Some(is_accepted)
    }
}

fn is_positive(behavior: &CollisionBehavior) -> bool {
    let torques = [
        behavior.lower_torque_acceleration,
        behavior.upper_torque_acceleration,
        behavior.lower_torque_nominal,
        behavior.upper_torque_nominal,
    ];
    let forces = [
        behavior.lower_force_acceleration,
        behavior.upper_force_acceleration,
        behavior.lower_force_nominal,
        behavior.upper_force_nominal,
    ];
    torques.iter().flatten().chain(forces.iter().flatten()).all(|value| value.is_finite() && *value >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_changes_nothing() {
        let mut settings = Settings::default();
        let before = settings.clone();
        for request in [
            Request::SetJointImpedance([f64::NAN; 7]),
            Request::SetJointImpedance([14251.0; 7]),
            Request::SetCartesianImpedance([5.0; 6]),
            Request::SetNeToEe([0.0; 16]),
            Request::SetLoad(Load { mass: -0.1, ..Load::default() }),
            Request::SetCollisionBehavior(CollisionBehavior::new([-1.0; 7], [1.0; 7], [1.0; 6], [1.0; 6])),
        ] {
            assert_eq!(settings.set(&request), Some(Status::InvalidArgument), "{request:?}");
            assert_eq!(settings, before);
        }
        assert_eq!(settings.set(&Request::StopMove), None);
        assert_eq!(settings.set(&Request::SetLoad(Load { mass: 0.3, ..Load::default() })), Some(Status::Success));
        assert_eq!(settings.load.mass, 0.3);
    }
}
