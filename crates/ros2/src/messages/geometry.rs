//! Messages of geometry_msgs.

use nalgebra::{Isometry3, Quaternion as Quat, Translation3, UnitQuaternion};

use super::{Header, message, structure};

structure! {
    /// `geometry_msgs/msg/Point`, m.
    Point {
        /// x.
        x: f64,
        /// y.
        y: f64,
        /// z.
        z: f64,
    }
}

structure! {
    /// `geometry_msgs/msg/Vector3`.
    Vector3 {
        /// x.
        x: f64,
        /// y.
        y: f64,
        /// z.
        z: f64,
    }
}

structure! {
    /// `geometry_msgs/msg/Quaternion`; all zeros by default, which is not a rotation.
    Quaternion {
        /// x.
        x: f64,
        /// y.
        y: f64,
        /// z.
        z: f64,
        /// w.
        w: f64,
    }
}

structure! {
    /// `geometry_msgs/msg/Pose`.
    Pose {
        /// Position.
        position: Point,
        /// Orientation.
        orientation: Quaternion,
    }
}

message! { "geometry_msgs",
    /// `geometry_msgs/msg/PoseStamped`.
    PoseStamped {
        /// Time and frame.
        header: Header,
        /// The pose.
        pose: Pose,
    }
}

structure! {
    /// `geometry_msgs/msg/PoseWithCovariance`.
    PoseWithCovariance {
        /// The pose.
        pose: Pose,
        /// Covariance of x, y, z and of the rotations about them, row by row; zeros for unknown values.
        covariance: Covariance,
    }
}

/// A matrix of 6 × 6, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covariance(pub [f64; 36]);

impl Default for Covariance {
    fn default() -> Self {
        Self([0.0; 36])
    }
}

impl crate::cdr::Cdr for Covariance {
    const MIN_BYTES: usize = 36 * 8;

    fn write(&self, to: &mut crate::cdr::Writer) {
        self.0.iter().for_each(|value| value.write(to));
    }

    fn read(from: &mut crate::cdr::Reader<'_>) -> Result<Self, crate::cdr::CdrError> {
        let mut values = [0.0; 36];
        for value in &mut values {
            *value = f64::read(from)?;
        }
        Ok(Self(values))
    }
}

structure! {
    /// `geometry_msgs/msg/Transform`.
    Transform {
        /// Translation.
        translation: Vector3,
        /// Rotation.
        rotation: Quaternion,
    }
}

structure! {
    /// `geometry_msgs/msg/TransformStamped`: the pose of the child's frame in the frame of the header.
    TransformStamped {
        /// Time, and the parent's frame.
        header: Header,
        /// The child's frame.
        child_frame_id: String,
        /// The pose `parent_from_child`.
        transform: Transform,
    }
}

structure! {
    /// `geometry_msgs/msg/Twist`.
    Twist {
        /// Linear velocity, m/s.
        linear: Vector3,
        /// Angular velocity, rad/s.
        angular: Vector3,
    }
}

/// Largest deviation of a rotation's quaternion from length 1.
const MAX_LENGTH_ERROR: f64 = 1e-2;

impl Quaternion {
    /// The rotation; `None` for an invalid one.
    pub fn rotation(&self) -> Option<UnitQuaternion<f64>> {
        let quaternion = Quat::new(self.w, self.x, self.y, self.z);
        ((quaternion.norm() - 1.0).abs() < MAX_LENGTH_ERROR).then(|| UnitQuaternion::from_quaternion(quaternion))
    }
}

impl From<UnitQuaternion<f64>> for Quaternion {
    fn from(rotation: UnitQuaternion<f64>) -> Self {
        Self { x: rotation.i, y: rotation.j, z: rotation.k, w: rotation.w }
    }
}

impl Transform {
    /// The transform as an isometry; `None` if a number is not finite or the rotation is invalid.
    pub fn isometry(&self) -> Option<Isometry3<f64>> {
        let Vector3 { x, y, z } = self.translation;
        let rotation = self.rotation.rotation()?;
        [x, y, z]
            .iter()
            .all(|value| value.is_finite())
            .then(|| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }
}

impl From<Isometry3<f64>> for Transform {
    fn from(isometry: Isometry3<f64>) -> Self {
        let vector = isometry.translation.vector;
        Self { translation: Vector3 { x: vector.x, y: vector.y, z: vector.z }, rotation: isometry.rotation.into() }
    }
}

impl From<Isometry3<f64>> for Pose {
    fn from(isometry: Isometry3<f64>) -> Self {
        let vector = isometry.translation.vector;
        Self { position: Point { x: vector.x, y: vector.y, z: vector.z }, orientation: isometry.rotation.into() }
    }
}
