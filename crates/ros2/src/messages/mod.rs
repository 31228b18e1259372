//! The supported messages, field by field as in their packages (ROS 2 Humble to Jazzy).

mod action;
mod diagnostic;
mod geometry;
mod interfaces;
mod sensor;
mod standard;
mod vision;

use crate::cdr::{Cdr, CdrError, Reader, Writer};

pub use action::{
    AfterStatus, Duration, FollowJointTrajectoryFeedback, FollowJointTrajectoryGoal, FollowJointTrajectoryResult,
    GripperCommandFeedback, GripperCommandGoal, GripperCommandResult, JointComponentTolerance, JointTolerance,
    JointTrajectory, JointTrajectoryPoint, MultiDofTrajectory, MultiDofTrajectoryPoint,
};
pub use diagnostic::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use geometry::{
    Point, Pose, PoseStamped, PoseWithCovariance, Quaternion, Transform, TransformStamped, Twist, Vector3,
};
pub use interfaces::{DetectRequest, DetectResponse, GraspRequest, GraspResponse, TeachRequest, TeachResponse};
pub use sensor::{CameraInfo, CompressedImage, Image, JointState, RegionOfInterest, TfMessage};
pub use standard::{Header, Time, TriggerRequest, TriggerResponse};
pub use vision::{
    BoundingBox2D, Detection2D, Detection2DArray, ObjectHypothesis, ObjectHypothesisWithPose, Point2D, Pose2D,
};

/// A message with its package and name.
pub trait Message: Cdr {
    /// Name of the package, such as `sensor_msgs`.
    const PACKAGE: &'static str;
    /// Name of the message, such as `Image`.
    const NAME: &'static str;
}

/// Defines a structure whose fields are encoded in sequence.
macro_rules! structure {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct $name { $($(#[$field_doc])* pub $field: $type,)+ }

        impl $crate::cdr::Cdr for $name {
            const MIN_BYTES: usize = 0 $(+ <$type as $crate::cdr::Cdr>::MIN_BYTES)+;

            fn write(&self, to: &mut $crate::cdr::Writer) {
                $($crate::cdr::Cdr::write(&self.$field, to);)+
            }

            fn read(from: &mut $crate::cdr::Reader<'_>) -> Result<Self, $crate::cdr::CdrError> {
                Ok(Self { $($field: $crate::cdr::Cdr::read(from)?,)+ })
            }
        }
    };
}

/// Defines a structure that is also a message.
macro_rules! message {
    ($package:literal, $(#[$doc:meta])* $name:ident { $($fields:tt)+ }) => {
        $crate::messages::structure! { $(#[$doc])* $name { $($fields)+ } }

        impl $crate::messages::Message for $name {
            const PACKAGE: &'static str = $package;
            const NAME: &'static str = stringify!($name);
        }
    };
}

use {message, structure};

/// A message without fields, which is one byte on the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Empty;

impl Cdr for Empty {
    const MIN_BYTES: usize = 1;

    fn write(&self, to: &mut Writer) {
        0_u8.write(to);
    }

    /// Reads nothing, because some senders omit the byte.
    fn read(_from: &mut Reader<'_>) -> Result<Self, CdrError> {
        Ok(Self)
    }
}
