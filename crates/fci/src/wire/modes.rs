//! Modes of the robot and of its motions, in states and in Move requests.

use crate::wire_error::WireError;

/// Defines an enum of bytes and its conversion from a byte.
macro_rules! byte_enum {
    ($(#[$doc:meta])* $name:ident, $what:literal { $($(#[$variant_doc:meta])* $variant:ident = $value:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $value,)+
        }

        impl $name {
            /// The value of a byte.
            ///
            /// # Errors
            /// [`WireError::Value`] for a byte without a meaning.
            pub fn from_byte(byte: u8) -> Result<Self, WireError> {
                match byte {
                    $($value => Ok($name::$variant),)+
                    _ => Err(WireError::Value { field: $what, found: byte.into() }),
                }
            }
        }
    };
}

byte_enum! {
    /// The generator of the references; `Idle` if there is none.
    MotionGeneratorMode, "motion_generator_mode" {
        /// No motion.
        Idle = 0,
        /// Joint positions.
        JointPosition = 1,
        /// Joint velocities.
        JointVelocity = 2,
        /// Poses of the end effector.
        CartesianPosition = 3,
        /// Twists of the end effector.
        CartesianVelocity = 4,
        /// Torques alone (version 10).
        None = 5,
    }
}

byte_enum! {
    /// The controller, which computes the torques.
    ControllerMode, "controller_mode" {
        /// The robot's own joint impedance.
        JointImpedance = 0,
        /// The robot's own Cartesian impedance.
        CartesianImpedance = 1,
        /// The client's torques.
        External = 2,
        /// Any other controller.
        Other = 3,
    }
}

byte_enum! {
    /// The robot's mode.
    RobotMode, "robot_mode" {
        /// Any other mode.
        Other = 0,
        /// At rest, ready for a motion.
        Idle = 1,
        /// In a motion.
        Move = 2,
        /// Guided by hand.
        Guiding = 3,
        /// Stopped by an error, waiting for recovery.
        Reflex = 4,
        /// Stopped by a person.
        UserStopped = 5,
        /// Recovering.
        AutomaticErrorRecovery = 6,
    }
}
