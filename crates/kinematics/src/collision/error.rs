//! Errors of the collision model.

/// Errors of building a collision model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CollisionError {
    /// A length is outside its range.
    #[error("{obstacle}: {what} must be {expected}, found {found}")]
    Size {
        /// The obstacle.
        obstacle: String,
        /// The length.
        what: &'static str,
        /// The expected values.
        expected: &'static str,
        /// The given value, m.
        found: f64,
    },
    /// A pose contains NaN or infinity, or its quaternion is not of unit length.
    #[error("{obstacle}: {reason}")]
    Pose {
        /// The obstacle.
        obstacle: String,
        /// The error of the pose.
        reason: String,
    },
    /// Two obstacles have the same name, so that a message could not distinguish them.
    #[error("two obstacles are named \"{name}\"")]
    NameTwice {
        /// The name of both.
        name: String,
    },
    /// A contact was allowed with an obstacle that does not exist.
    #[error("no obstacle is named \"{name}\"; the obstacles are: {existing}")]
    UnknownObstacle {
        /// The name that was given.
        name: String,
        /// The names of the obstacles.
        existing: String,
    },
}
